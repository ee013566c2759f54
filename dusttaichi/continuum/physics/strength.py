"""Strengths of porous dust: compressive Sigma, tensile T and shear Y at a filling factor (G09).

    Sigma(phi) = p_m ((phi_2 - phi_1)/(phi_2 - phi) - 1)^(Delta ln 10)      (G09 eq 10)
    T(phi) = -10^(a + b phi) Pa, a = 2.8, b = 1.48                          (G09 eq 8)
    Y(phi) = C Sigma^a |T|^(1 - a), sqrt(Sigma |T|) by default (G09 section 4.1)

Sigma vanishes at phi_1 and is undefined below, which dust that was torn reaches: there it has its
value at phi_floor. It is infinite at phi_2: from phi_cap on dust is elastic (path), and Y has its
value at phi_cap. A compression curve of the laboratory is an axial stress, which is
Sigma + 2 Y/3 in uniaxial strain, and not Sigma.
"""

from numpy import exp, log, maximum, minimum


def compressive(phi, m):
    """Sigma [Pa]: the pressure under which the dust is compacted (G09 eq 10)."""
    limited = minimum(maximum(phi, m.phi_floor), m.phi_cap)
    return m.p_m * exp(m.power * log((limited - m.phi_1) / (m.phi_2 - limited)))


def filling_factor(pressure, m):
    """phi at which Sigma is `pressure` [Pa], above 0: the inverse of `compressive` (G09 eq 9)."""
    return m.phi_2 - (m.phi_2 - m.phi_1) / ((pressure / m.p_m) ** (1.0 / m.power) + 1.0)


def compressive_slope(phi, m):
    """dSigma/dphi [Pa] between phi_floor and phi_cap."""
    product = (phi - m.phi_1) * (m.phi_2 - phi)
    return compressive(phi, m) * m.power * (m.phi_2 - m.phi_1) / product


def tensile(phi, m):
    """T [Pa], negative: the pressure under which the dust is torn (G09 eq 8)."""
    return -m.T_0 * exp(m.T_rate * phi)


def shear(phi, m):
    """Y [Pa]: the largest von Mises stress sqrt(3 J2) (G09 section 4.1)."""
    pull = -tensile(phi, m)
    return m.C * pull * exp(m.a * log(compressive(phi, m) / pull))


def confined(phi, m):
    """Axial stress [Pa] of flow in uniaxial compression, Sigma + 2 Y/3."""
    return compressive(phi, m) + 2.0 / 3.0 * shear(phi, m)
