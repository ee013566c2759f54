"""Gravity: the same acceleration everywhere, and k d^n towards a point at the distance d."""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {"g": Number("m/s^2", 3)}
USES_VELOCITY = False


def numbers(block):
    """g of the block."""
    return {"g": block.acceleration}


@ti.func
def acceleration(constants, particle):
    """The same everywhere."""
    return constants.g


@ti.func
def potential(constants, particle):
    """U = -m g.x."""
    return -particle.mass * constants.g.dot(particle.position)
