"""What two grains (a grain and a wall) need of the step when they meet at a speed. SI.

Head-on without damping the contact is pressed to the s = sqrt(a/a0) at which its potential holds
the kinetic energy and what forming has released (physics.contact.normal: U/(4 F_c delta0) =
6/5 s^10 - 2 s^7 + 1/2 s^4, -0.17471 at first touch). There it is stiffest and its damping
strongest. A contact is a physics.contact.constants.ContactConstants throughout.
"""

from math import inf, pi, sqrt

from scipy.optimize import brentq

from dusttaichi.physics.network import slope

FORMED = -0.174714  # U/(4 F_c delta0) at first touch, s^3 = 2/3
STICKING = 2.0 * 0.77224  # v_s^2 in units of F_c delta0/m

# Share of the period of the deepest contact: the energy of a bounce is then right within 0.5 %,
# and a contact is found before it has stored as much (measured over 1 cm/s to 100 m/s).
RESOLVED = 0.03
DAMPED = 0.1  # step times the damping rate of the deepest contact
WAY = 0.05  # of twice the reduced radius (the radius, of equal grains): way in a step
TURN = 0.025  # angle [rad] that a grain may turn by in a step
FADE = 4.0  # sticking speeds up to which a body's own step resolves its contacts well enough


def energy(s):
    """U/(4 F_c delta0) of a contact, s = sqrt(a/a0)."""
    return 1.2 * s**10 - 2.0 * s**7 + 0.5 * s**4


def deepest(contact, speed):
    """s = sqrt(a/a0) at the end of the approach of a head-on collision, speed [m/s]."""
    given = 0.5 * contact.mass * speed**2 / (4.0 * contact.F_c * contact.delta0) + FORMED
    high = ((given + 4.0) / 1.2) ** 0.1 + 2.0
    return brentq(lambda s: energy(s) - given, 1.0, high, xtol=1e-12)


def overlap(contact, speed):
    """Largest overlap of that collision [m]."""
    s = deepest(contact, speed)
    return contact.delta0 * (3.0 * s**4 - 2.0 * s)


def speed_of_overlap(contact, most):
    """Speed [m/s] of the head-on collision whose largest overlap is `most` [m], of at least that
    at rest."""
    s = brentq(lambda s: contact.delta0 * (3.0 * s**4 - 2.0 * s) - most, 1.0, 1e6, xtol=1e-12)
    return sqrt(8.0 * (energy(s) - FORMED) * contact.F_c * contact.delta0 / contact.mass)


def breaking_speed(contact):
    """Speed [m/s] at which a pair has the energy that breaks a contact at rest: it sticks below,
    where nothing else dissipates (the sticking speed v_s of `step`)."""
    return sqrt(STICKING * contact.F_c * contact.delta0 / contact.mass)


def step(contact, speed, alone):
    """Longest step [s] that resolves a collision at that speed.

    alone: True for scenes of few
    grains, in which the energy of one collision is all there is; in others a collision near the
    sticking speed is small beside what is bound already, and the limit fades away below it.
    """
    s = deepest(contact, speed)
    period = 2.0 * pi * sqrt(contact.mass / (contact.k_n * slope(s)))
    rate = contact.kappa_at(s) / contact.mass
    least = min(RESOLVED * period, DAMPED / rate if rate > 0.0 else inf)
    if speed > 0.0:
        least = min(least, WAY * 2.0 * contact.R / speed)
    if alone:
        return least
    if speed == 0.0:
        return inf
    return least * sqrt(1.0 + (FADE * breaking_speed(contact) / speed) ** 2)
