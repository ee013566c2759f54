"""Damping of the normal motion: F = -kappa u n_c on grain 1, u = (v1 - v2).n_c (S12 eq 7).

A law defines kappa: `numbers` at equilibrium, and `coefficient(k, p)` for the Motion of a contact
with its current contact_radius. The extrapolation of the force to the time of the positions and its
work are the same for all laws.
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
    def update(k: ti.template(), h: ti.template(), p, dt):
        """Set the current damping force; returns the work of the force of the last step.

        The speed is extrapolated by half a step from the last two half steps.
        """
        previous_speed = h.speed
        ahead = k.speed + 0.5 * k.was * (k.speed - previous_speed - k.struck)
        lost = 0.5 * dt * h.damping_force * (previous_speed + k.speed)
        h.damping_force = k.now * (coefficient(k, p) * ahead)
        h.speed = k.now * k.speed
        return lost

    return update


@ti.func
def push(h: ti.template()):
    """Force along n_c on the first body."""
    return -h.damping_force


@ti.func
def pending(k: ti.template(), h: ti.template(), p, dt, along):
    """Half of the work of this step, that before the time of the positions."""
    return 0.5 * dt * h.speed * h.damping_force
