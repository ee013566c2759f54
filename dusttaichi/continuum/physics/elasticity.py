"""Elastic behaviour of porous dust: moduli, pressure on an elastic path, sound, stored energy.

On an elastic path the dust has the density `reference` at zero pressure (rho_0' of G09), and

    p = K (rho/reference - 1)      (G09 eq 7)

with K constant along the path, by default K_0 (reference/rho_i)^gamma (G09 eq 15); the law is
chosen by name (registry). The ratio of the shear modulus to K is fixed.
"""

from numpy import log, sqrt, where

from dusttaichi.continuum.physics.chosen import modulus_law

SMALL = 0.02
"""Elastic strain of the density below which its energy is computed as a series."""


def bulk_modulus(reference, m):
    """K [Pa] of the elastic path with density `reference` [kg/m^3] at zero pressure."""
    return modulus_law(reference, m)


def shear_modulus(reference, m):
    """mu [Pa] of that path."""
    return m.mu_over_K * bulk_modulus(reference, m)


def elastic_pressure(density, reference, m):
    """p [Pa] on an elastic path (G09 eq 7)."""
    return path_pressure(density, reference, bulk_modulus(reference, m))


def path_pressure(density, reference, K):
    """p [Pa] on the elastic path of modulus K [Pa] (G09 eq 7)."""
    return K * (density / reference - 1.0)


def sound_speed(density, reference, m):
    """Longitudinal speed of sound [m/s], sqrt((K + 4 mu/3)/rho)."""
    return sqrt(bulk_modulus(reference, m) * (1.0 + 4.0 / 3.0 * m.mu_over_K) / density)


def volume_energy(density, reference, m):
    """Energy stored by pressure in a unit of the present volume [J/m^3]."""
    return path_energy(density, reference, bulk_modulus(reference, m))


def path_energy(density, reference, K):
    """Energy per present volume [J/m^3] on the elastic path of modulus K [Pa].

    The integral of p drho/rho^2 from `reference` on, times rho: with y = rho/reference - 1 it is
    K (1 + y) (ln(1 + y) - y/(1 + y)). Where y is small the terms cancel, and it is computed as a
    series: at |y| = 0.02 that is 6e-9 of itself short.
    """
    y = density / reference - 1.0
    series = 1.0 / 2.0 + y * (-2.0 / 3.0 + y * (3.0 / 4.0 + y * (-4.0 / 5.0 + y * (5.0 / 6.0))))
    logarithm = log(density / reference) - y / (1.0 + y)
    return K * (1.0 + y) * where((y < SMALL) & (y > -SMALL), y * y * series, logarithm)


def shear_energy(J2, reference, m):
    """Energy stored by the deviator in a unit of volume [J/m^3], S:S/(4 mu) = J2/(2 mu)."""
    return J2 / (2.0 * shear_modulus(reference, m))
