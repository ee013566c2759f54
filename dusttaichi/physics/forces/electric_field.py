"""A field of the same strength everywhere, which may oscillate, on the charges of the particles.

Charges do not act on each other, which requires q/(4 pi eps_0 d^2) far below the field.
"""

from math import pi

import numpy as np

from dusttaichi.compute.engine import ti
from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {
    "field": Number("V/m", 3),
    "magnetic": Number("T", 3),
    "frequency": Number("rad/s"),
    "phase": Number("rad"),
}
USES_CHARGE = True


def numbers(block):
    """Constants of the block."""
    return {
        "field": block.field,
        "magnetic": block.magnetic_field,
        "frequency": 2.0 * pi * (block.frequency or 0.0),
        "phase": block.phase or 0.0,
    }


def timescale(block, particles):
    """The shorter one of the period of the field and that of gyration [s]."""
    strength = float(np.linalg.norm(block.magnetic_field))
    gyration = strength * float(np.max(np.abs(particles.charge) / particles.mass))
    rates = [2.0 * pi * (block.frequency or 0.0), gyration]
    return 2.0 * pi / max(rates) if max(rates) > 0.0 else np.inf


@ti.func
def acceleration(constants, particle):
    """(E cos(w t + phase) + v x B) q/m."""
    field = ti.cos(constants.frequency * particle.time + constants.phase) * constants.field
    return particle.charge / particle.mass * (field + particle.velocity.cross(constants.magnetic))
