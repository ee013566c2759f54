"""The forces from outside once more: plain NumPy, SI, no import from dusttaichi.

Each function returns one force, `force(body)`: accelerations and angular ones, (N, 3) each, of a
`Body` of grains. All but the drag of Epstein (1924) are textbook mechanics; the drag is his, with
the mean thermal speed of the gas.
"""

from dataclasses import dataclass

import numpy as np

G = 6.6743e-11  # CODATA 2018
K_B, ATOMIC_MASS = 1.380649e-23, 1.66053906660e-27


@dataclass
class Body:
    """Grains of position x, velocity v, spin w (N, 3), mass and radius at a time, SI."""

    x: np.ndarray
    v: np.ndarray
    w: np.ndarray
    mass: object
    radius: object
    time: float


def uniform(g):
    """The same acceleration everywhere."""
    return lambda body: (np.zeros_like(body.x) + g, np.zeros_like(body.x))


def attraction(mass, centre):
    """Newton's law towards a mass at a point."""

    def force(body):
        away = body.x - centre
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        return -G * mass * away / distance**3, np.zeros_like(away)

    return force


def epstein(density, temperature, molecular_mass, velocity):
    """F = -(4/3) pi r^2 rho v_th (v - u)."""
    thermal = np.sqrt(8 * K_B * temperature / (np.pi * molecular_mass * ATOMIC_MASS))

    def force(body):
        friction = 4 / 3 * np.pi * body.radius**2 * density * thermal
        return -friction / body.mass * (body.v - velocity), np.zeros_like(body.x)

    return force


def rotating(rate, centre):
    """Coriolis and centrifugal accelerations, and the turn of a spin that is steady outside."""

    def force(body):
        arm = body.x - centre
        linear = -2 * np.cross(rate, body.v) - np.cross(rate, np.cross(rate, arm))
        return linear, -np.cross(rate, body.w)

    return force


def electric(charge, field, magnetic, frequency, phase):
    """Lorentz's force, of an electric field that oscillates."""

    def force(body):
        now = np.asarray(field) * np.cos(2 * np.pi * frequency * body.time + phase)
        linear = charge / body.mass * (now + np.cross(body.v, magnetic))
        return linear, np.zeros_like(body.x)

    return force


def solve(forces, body, kick, turn, half):
    """Accelerations at the velocities that they lead to: v + kick + half a, by iteration.

    kick, turn: by all other loads in the half step of length `half`; 0 where velocities are those
    of the positions.
    """
    v, w = body.v + kick, body.w + turn
    linear = angular = np.zeros_like(body.x)
    for _ in range(40):
        body.v, body.w = v + half * linear, w + half * angular
        parts = [force(body) for force in forces]
        linear, angular = (np.sum(a, axis=0) for a in zip(*parts, strict=True))
    return linear, angular
