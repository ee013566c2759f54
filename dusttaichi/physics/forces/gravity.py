"""Gravity: the same acceleration everywhere, and k d^n towards a point at the distance d."""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {"g": Number("m/s^2", 3)}
USES_VELOCITY = False


def numbers(block):
    """g of the block."""
    return {"g": block.acceleration}


@ti.func
def acceleration(p, at):
    """The same everywhere."""
    return p.g


@ti.func
def potential(p, at):
    """U = -m g.x."""
    return -at.mass * p.g.dot(at.position)
