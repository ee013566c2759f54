"""An upright cylinder around the grains: a tube. s: its radius, and x and y of its axis."""

from dusttaichi.compute.engine import ti

LEAST = 1e-18
"""Square of the distance from the axis [um^2] that keeps the normal there a number."""


@ti.pyfunc
def from_axis(x, s):
    """Distance of a point from the axis."""
    return ((x[0] - s.x) * (x[0] - s.x) + (x[1] - s.y) * (x[1] - s.y) + LEAST) ** 0.5


@ti.pyfunc
def distance(x, s):
    """Distance of a point from the wall, positive inside."""
    return s.radius - from_axis(x, s)


@ti.pyfunc
def normal(x, s):
    """Components of the unit normal at a point, towards the axis."""
    rho = from_axis(x, s)
    return (s.x - x[0]) / rho, (s.y - x[1]) / rho, 0.0 * rho


@ti.pyfunc
def bend(x, s):
    """Angle by which the normal turns over the way of a point around the axis."""
    return 1.0 / from_axis(x, s)
