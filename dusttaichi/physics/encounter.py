"""Time step that resolves an impact of two grains (a grain and a wall) at a speed. SI.

Head-on without damping the contact is pressed to the overlap at which its potential holds the
kinetic energy and what forming has released. There it is stiffest and its damping strongest. A
contact is a physics.contact.constants.ContactConstants throughout, whatever its normal law.
"""

from functools import lru_cache
from math import inf, pi, sqrt
from typing import Any

import numpy as np

# Share of the period of the deepest contact: the energy of a bounce is then right within 0.5 %,
# and a contact is found before it has stored as much (measured over 1 cm/s to 100 m/s).
RESOLVED = 0.03
DAMPED = 0.1  # step times the damping rate of the deepest contact
WAY = 0.05  # of twice the reduced radius (the radius, of equal grains): distance moved in a step
TURN = 0.025  # angle [rad] that a grain may turn by in a step
FADE = 4.0  # sticking speeds up to which a body's own step resolves its contacts well enough


def energy(contact, overlap):
    """Potential energy [J] at an overlap [m]."""
    return float(contact.curve(np.float64(overlap))[1])


@lru_cache(maxsize=64)  # the runs of a study mostly have the same
def overlap(contact, speed):
    """Largest overlap [m] of a head-on collision, speed [m/s]."""
    energy_available = 0.5 * contact.mass * speed**2 + energy(contact, 0.0)
    low, high = contact.delta0, max(2.0 * contact.delta0, 1e-3 * contact.R)
    if energy(contact, low) >= energy_available:
        return low
    while energy(contact, high) < energy_available:
        low, high = high, 2.0 * high
    while high - low > 1e-12 * high:  # scipy.optimize alone takes longer to import
        trial = np.linspace(low, high, 20)
        above = np.searchsorted(contact.curve(trial)[1], energy_available)
        low, high = trial[above - 1 : above + 1]
    return float(high)


def speed_of_overlap(contact, largest_overlap):
    """Speed [m/s] of the head-on collision whose largest overlap is `most` [m].

    That overlap counts as at least the overlap at rest.
    """
    energy_available = energy(contact, largest_overlap) - energy(contact, 0.0)
    return sqrt(2.0 * max(energy_available, 0.0) / contact.mass)


def breaking_speed(contact: Any) -> float:
    """Speed [m/s] at which a pair has the energy that breaks a contact at rest.

    It sticks below, where nothing else dissipates; 0 without adhesion.
    """
    return sqrt(2.0 * max(contact.barrier, 0.0) / contact.mass)


def step(contact, speed, alone):
    """Longest step [s] that resolves a collision at that speed.

    alone: True for scenes of few grains, in which the energy of one collision is the whole energy;
    in others a collision near the sticking speed is small beside the binding energy, and the limit
    fades away below it.
    """
    deepest = np.float64(overlap(contact, speed))
    stiffness = float(contact.slope(deepest))
    period = 2.0 * pi * sqrt(contact.mass / stiffness) if stiffness > 0.0 else inf
    rate = float(contact.kappa_at(deepest, speed)) / contact.mass
    least = min(RESOLVED * period, DAMPED / rate if rate > 0.0 else inf)
    if speed > 0.0:
        least = min(least, WAY * 2.0 * contact.R / speed)
    if alone:
        return least
    if speed == 0.0:
        return inf
    return least * sqrt(1.0 + (FADE * breaking_speed(contact) / speed) ** 2)
