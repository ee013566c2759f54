"""Pressure with compaction and tensile flow: the reference density follows, without any flag.

The pressure of the elastic path is limited to T(phi) and Sigma(phi). Where it would be outside, the
density at zero pressure moves so that the path meets the limit at the present density (G09 Fig 1):
it grows where the dust is compacted and falls where it flows in tension. The densities rho_c of
G09, where a path ends, are those at which it meets the limits, and need not be stored.
"""

from numpy import exp, log, maximum, minimum, where

from dusttaichi.continuum.physics.elasticity import bulk_modulus, elastic_pressure
from dusttaichi.continuum.physics.strength import compressive, tensile

SOFTEST = 0.5
"""Largest tension over the bulk modulus at the same density."""


def limited_pressure(density, trial, m):
    """The pressure `trial` of an elastic path [Pa], limited to T and Sigma at this density.

    From phi_cap on Sigma has no bound: dust as dense as that remains on its elastic path.
    A limit is at most a share of the modulus, `bulk_modulus(density)` times q_max in compression
    and SOFTEST in tension: this ends the path of dust that was torn to a filling factor of some
    hundredths, where its modulus has nearly vanished.
    """
    phi = density / m.rho_s
    K = bulk_modulus(density, m)
    most = where(phi < m.phi_cap, minimum(compressive(phi, m), m.q_max * K), trial)
    return maximum(minimum(trial, most), maximum(tensile(phi, m), -SOFTEST * K))


def reference_density(density, pressure, m):
    """Density at zero pressure [kg/m^3] of the elastic path through (density, pressure).

    With reference = (1 - d) density it is the smallest d that solves d (1 - d)^(gamma - 1) = q,
    q = pressure/K(density): q/(1 - (gamma - 1) q) and three steps of Newton's method, which leave
    round-off for |q| <= 0.04 at gamma = 4. q lies between -SOFTEST and q_max.
    """
    g = m.gamma
    q = pressure / bulk_modulus(density, m)
    d = q / (1.0 - (g - 1.0) * q)
    slope = exp((g - 2.0) * log(1.0 - d))
    d -= (d * (1.0 - d) * slope - q) / (slope * (1.0 - g * d))
    slope = exp((g - 2.0) * log(1.0 - d))
    d -= (d * (1.0 - d) * slope - q) / (slope * (1.0 - g * d))
    slope = exp((g - 2.0) * log(1.0 - d))
    d -= (d * (1.0 - d) * slope - q) / (slope * (1.0 - g * d))
    return (1.0 - d) * density


def pressure(density, reference, m):
    """(p [Pa], reference [kg/m^3]) after the density has changed to `density`."""
    trial = elastic_pressure(density, reference, m)
    p = limited_pressure(density, trial, m)
    return p, where(p == trial, reference, reference_density(density, p, m))
