"""Pressure with compaction and tensile flow: the reference density follows, without any flag.

The pressure of the elastic path is limited to T(phi) and Sigma(phi). Where it would be outside, the
density at zero pressure moves so that the path meets the limit at the present density (G09 Fig 1):
it grows where the dust is compacted and falls where it flows in tension. The densities rho_c of
G09, where a path ends, are those at which it meets the limits, and need not be stored.
"""

from numpy import maximum, minimum, where

from dusttaichi.continuum.physics.chosen import reference_law
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
    limited = where(phi < m.phi_cap, minimum(compressive(phi, m), m.q_max * K), trial)
    return maximum(minimum(trial, limited), maximum(tensile(phi, m), -SOFTEST * K))


def reference_density(density, pressure, m):
    """Density at zero pressure [kg/m^3] of the elastic path through (density, pressure).

    The pressure over K(density) is between -SOFTEST and q_max.
    """
    return reference_law(density, pressure, m)


def pressure(density, reference, m):
    """(p [Pa], reference [kg/m^3]) after the density has changed to `density`."""
    trial = elastic_pressure(density, reference, m)
    p = limited_pressure(density, trial, m)
    return p, where(p == trial, reference, reference_density(density, p, m))
