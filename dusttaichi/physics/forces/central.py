"""Attraction towards a point: (d/scale)^n times a strength, at the distance d from it."""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {
    "centre": Number("m", 3),
    "scale": Number("m"),  # distance at which the acceleration is `strength`
    "strength": Number("m/s^2"),
    "exponent": Number("1"),
    "nearest": Number("m"),  # distance below which the acceleration does not follow the law
}
USES_VELOCITY = False
UNIT, NEAREST = 1e-6, 1e-12  # [m]


def numbers(block):
    """Constants of the block; the acceleration by a mass at the distance of a micrometre."""
    central = block.central
    scale = central.distance or UNIT
    strength = central.strength * scale**central.exponent
    named = {"scale": scale, "strength": strength, "exponent": central.exponent}
    return named | {"centre": central.centre, "nearest": NEAREST}


@ti.func
def acceleration(constants, particle):
    """Towards the centre."""
    towards = constants.centre - particle.position
    square = ti.max(towards.norm_sqr(), constants.nearest**2) / constants.scale**2
    return (
        constants.strength
        / constants.scale
        * square ** (0.5 * (constants.exponent - 1.0))
        * towards
    )


@ti.func
def potential(constants, particle):
    """m k d^(n+1)/(n+1), or m k ln d for n = -1."""
    towards, power = constants.centre - particle.position, constants.exponent + 1.0
    distance = ti.sqrt(ti.max(towards.norm_sqr(), constants.nearest**2)) / constants.scale
    of_power = distance**power / ti.select(power == 0.0, 1.0, power)
    return (
        particle.mass
        * constants.strength
        * constants.scale
        * ti.select(power == 0.0, ti.log(distance), of_power)
    )
