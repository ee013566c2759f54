"""Conditions on the numbers of a material, and the message for each that is violated."""

import numpy as np

from dusttaichi.continuum.physics import elasticity, strength

REACH = 0.9
"""Share of the interval from phi_1 to phi_2 in which the conditions must hold. Sigma is infinite at
phi_2, so that no material meets them there."""


def impossible(m):
    """Problems of the MaterialNumbers m, as (dotted path of the block, text)."""
    start = m.rho_i / m.rho_s
    if start >= m.phi_2:
        return [
            (
                "density",
                f"it is a filling factor of {start:.3g}, and phi_2 = {m.phi_2:g} is never reached, "
                "where the compressive strength ends; less density, or a larger phi_2, is needed",
            )
        ]
    end = m.phi_1 + REACH * (m.phi_2 - m.phi_1)
    phi = np.linspace(m.phi_floor, max(end, start), 200)
    phi = phi[phi < m.phi_cap]
    K = elasticity.bulk_modulus(phi * m.rho_s, m)
    # K/phi is the slope of the elastic path p(phi) with zero pressure at phi
    ratio = K / phi / strength.compressive_slope(phi, m)
    load_ratio = strength.compressive(phi, m) / K / m.q_max
    worst = int(np.argmax(np.maximum(1.0 / ratio, load_ratio)))
    if ratio[worst] > 1.0 and load_ratio[worst] < 1.0:
        return []
    return [
        (
            "bulk_modulus",
            f"at a filling factor of {phi[worst]:.3g} the dust resists compaction more than "
            f"elastic strain: K/phi = {K[worst] / phi[worst]:.3g} Pa must exceed dSigma/dphi = "
            f"{strength.compressive_slope(phi[worst], m):.3g} Pa, and Sigma = "
            f"{strength.compressive(phi[worst], m):.3g} Pa must stay below {m.q_max:.2g} K; "
            "a larger bulk_modulus or exponent, or a smaller compressive strength (p_m), is needed",
        )
    ]
