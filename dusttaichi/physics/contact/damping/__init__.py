"""Damping of the normal motion: F = -kappa u n_c on grain 1, u = (v1 - v2).n_c (S12 eq 7).

A law defines kappa: `numbers` at equilibrium, and `coefficient(motion, constants)` for the Motion
of a contact with its current contact_radius. The extrapolation of the force to the time of the
positions and its work are the same for all laws.
"""

from functools import cache

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import History

HISTORY = {
    "speed": History("m/s", "rate of the distance half a step ago", result="approach", sign=-1),
    "damping_force": History("N", "damping force of the last step"),
}


class Damping:
    """The effect of a damping law: any module or object with NUMBERS, numbers and coefficient."""

    HISTORY, CHANNEL, RADIAL = HISTORY, "damping", True

    def __init__(self, law):
        self.law, self.NUMBERS, self.numbers = law, law.NUMBERS, law.numbers
        self.update, self.push, self.pending = _update(law.coefficient), push, pending


damping_of = cache(Damping)
"""The one Damping of a law."""


def _update(coefficient):
    @ti.func
    def update(motion: ti.template(), history: ti.template(), constants, dt):
        """Set the current damping force; returns the work of the force of the last step.

        The speed is extrapolated by half a step from the last two half steps.
        """
        previous_speed = history.speed
        ahead = motion.speed + 0.5 * motion.touched_before * (
            motion.speed - previous_speed - motion.struck
        )
        lost = 0.5 * dt * history.damping_force * (previous_speed + motion.speed)
        history.damping_force = motion.touches * (coefficient(motion, constants) * ahead)
        history.speed = motion.touches * motion.speed
        return lost

    return update


@ti.func
def push(history: ti.template()):
    """Force along n_c on the first body."""
    return -history.damping_force


@ti.func
def pending(motion: ti.template(), history: ti.template(), constants, dt, along):
    """Half of the work of this step, that before the time of the positions."""
    return 0.5 * dt * history.speed * history.damping_force
