"""Attraction between particles: self-gravity of spheres, in plane strain of infinite cylinders.

A particle attracts like a homogeneous sphere of the softening radius a: beyond a by Newton's law,
inside in proportion to the distance. Times G and the mass of the particle,

    acceleration = -d / max(r, a)^3          potential = -(3 - r^2/q^2)/(2 q),  q = max(r, a)

and for a cylinder, times G and its mass per length,

    acceleration = -2 d / max(r, a)^2        potential = ln(q^2/a^2) + r^2/q^2 - 1
"""

from numpy import log, maximum, sqrt


def sphere_pull(r2, soft2):
    """Acceleration over distance, G and mass [1/m^3]; r2, soft2: squares of r and a [m^2]."""
    inverse = 1.0 / sqrt(maximum(r2, soft2))
    return inverse * inverse * inverse


def sphere_potential(r2, soft2):
    """Potential over G and mass [1/m]."""
    inverse = 1.0 / sqrt(maximum(r2, soft2))
    return -0.5 * inverse * (3.0 - r2 * inverse * inverse)


def cylinder_pull(r2, soft2):
    """Acceleration over distance, G and mass per length [1/m^2]."""
    return 2.0 / maximum(r2, soft2)


def cylinder_potential(r2, soft2):
    """Potential of a cylinder over G and mass per length [1].

    In the middle it is 1 less than at the softening radius.
    """
    q2 = maximum(r2, soft2)
    return log(q2 / soft2) + r2 / q2 - 1.0
