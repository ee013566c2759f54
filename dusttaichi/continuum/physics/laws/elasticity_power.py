"""Bulk modulus that is a power of the density, K = K_0 (rho_0'/rho_i)^gamma (G09 eq 15)."""

from numpy import exp, log

from dusttaichi.physics.contact.effect_numbers import Constant

NUMBERS = {
    "K_0": Constant("Pa", "bulk modulus at rho_i"),
    "gamma": Constant("1", "exponent of the bulk modulus"),
}


def numbers(material, law_block):
    return {"K_0": material.bulk_modulus, "gamma": material.exponent}


def modulus(reference, m):
    return m.K_0 * exp(m.gamma * log(reference / m.rho_i))


def exponent(reference, m):
    return m.gamma + 0.0 * reference


def reference_density(density, pressure, m):
    """Density at zero pressure [kg/m^3] of the elastic path through (density, pressure).

    With reference = (1 - d) density it is the smallest d that solves d (1 - d)^(gamma - 1) =
    strain, strain = pressure/K(density): strain/(1 - (gamma - 1) strain) and three steps of
    Newton's method, which leave round-off for |strain| <= 0.04 at gamma = 4.
    """
    gamma = m.gamma
    strain = pressure / modulus(density, m)
    d = strain / (1.0 - (gamma - 1.0) * strain)
    slope = exp((gamma - 2.0) * log(1.0 - d))
    d -= (d * (1.0 - d) * slope - strain) / (slope * (1.0 - gamma * d))
    slope = exp((gamma - 2.0) * log(1.0 - d))
    d -= (d * (1.0 - d) * slope - strain) / (slope * (1.0 - gamma * d))
    slope = exp((gamma - 2.0) * log(1.0 - d))
    d -= (d * (1.0 - d) * slope - strain) / (slope * (1.0 - gamma * d))
    return (1.0 - d) * density
