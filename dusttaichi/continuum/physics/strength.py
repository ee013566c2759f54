"""Strengths of porous dust: compressive Sigma, tensile T and shear Y at a filling factor.

The laws are chosen by name (registry). Sigma vanishes at phi_1 and is undefined below, which dust
that was torn reaches: there it has its value at phi_floor. It is infinite at phi_2: from phi_cap on
dust is elastic (path), and Y has its value at phi_cap. A compression curve of the laboratory is an
axial stress, which is Sigma + 2 Y/3 in uniaxial strain, and not Sigma.
"""

from numpy import maximum, minimum

from dusttaichi.continuum.physics.chosen import compressive_law, shear_law, tensile_law

SLOPE_STEP = 1e-6
"""Half the difference of the filling factors from which a slope is computed."""


def compressive(phi, m):
    """Sigma [Pa]: the pressure under which the dust is compacted."""
    return compressive_law(minimum(maximum(phi, m.phi_floor), m.phi_cap), m)


def compressive_slope(phi, m):
    """dSigma/dphi [Pa] between phi_floor and phi_cap."""
    above, below = compressive_law(phi + SLOPE_STEP, m), compressive_law(phi - SLOPE_STEP, m)
    return (above - below) / (2.0 * SLOPE_STEP)


def tensile(phi, m):
    """T [Pa], negative: the pressure under which the dust is torn."""
    return -tensile_law(phi, m)


def shear(phi, m):
    """Y [Pa]: the largest von Mises stress sqrt(3 J2) (G09 section 4.1)."""
    return shear_law(phi, compressive(phi, m), -tensile(phi, m), m)


def compute_confined(phi, m):
    """Axial stress [Pa] of flow in uniaxial compression, Sigma + 2 Y/3."""
    return compressive(phi, m) + 2.0 / 3.0 * shear(phi, m)
