"""A sphere, around the grains (side 1) or among them (side -1)."""

from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {"radius": Number("m"), "centre": Number("m", 3), "side": Number("1")}
LEAST = 1e-18
"""Square of the distance from the centre [um^2] that keeps the normal there a number."""


def numbers(block):
    """Constants of the block."""
    return {"radius": block.radius, "centre": block.centre, "side": block.side}


def distance(x, s):
    """Distance of a point from the surface."""
    a, b, c = x[0] - s.centre[0], x[1] - s.centre[1], x[2] - s.centre[2]
    return s.side * (s.radius - (a * a + b * b + c * c + LEAST) ** 0.5)


def normal(x, s):
    """Towards the centre from inside, away from it from outside."""
    a, b, c = x[0] - s.centre[0], x[1] - s.centre[1], x[2] - s.centre[2]
    scale = -s.side / (a * a + b * b + c * c + LEAST) ** 0.5
    return scale * a, scale * b, scale * c


def curvatures(s):
    """One over the radius, twice."""
    return s.side / s.radius, s.side / s.radius
