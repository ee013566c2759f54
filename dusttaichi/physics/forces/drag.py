"""Drag of a gas on particles that are small compared with its mean free path (Epstein 1924).

F = -(4/3) pi r^2 rho_g v_th (v - u) with the thermal speed v_th = sqrt(8 k T/(pi m_g)) of the gas,
for diffuse or specular reflection to some ten per cent and speeds below v_th; the stopping time is
rho_s r/(rho_g v_th). Every particle meets the same gas: there is no shielding within an aggregate.
"""

from math import pi, sqrt

import numpy as np

from dusttaichi.compute.engine import ti
from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {
    "rate": Number("s^-1"),  # one over a stopping time common to all particles
    "friction": Number("kg/m^2 s"),  # (4/3) pi rho_g v_th
    "gas_velocity": Number("m/s", 3),
}
CHANNEL = "drag"
TEMPERATURE, MOLECULAR_MASS = 280.0, 2.34  # [K, atomic units], of hydrogen and helium at 1 au
BOLTZMANN, ATOMIC_MASS = 1.380649e-23, 1.66053906660e-27  # SI, CODATA 2018


def thermal_speed(temperature, molecular_mass):
    """Mean speed of the molecules [m/s]; temperature [K], mass in atomic units."""
    return sqrt(8.0 * BOLTZMANN * temperature / (pi * molecular_mass * ATOMIC_MASS))


def numbers(block):
    """A stopping time, or the constant of Epstein's law."""
    rate = friction = 0.0
    if block.stopping_time is not None:
        rate = 1.0 / block.stopping_time
    else:
        mass = block.molecular_mass or MOLECULAR_MASS
        speed = thermal_speed(block.temperature or TEMPERATURE, mass)
        friction = 4.0 / 3.0 * pi * block.density * speed
    return {"rate": rate, "friction": friction, "gas_velocity": block.velocity}


def timescale(block, particles):
    """The shortest stopping time [s]."""
    n = numbers(block)
    rates = n["rate"] + n["friction"] * particles.radius**2 / particles.mass
    return 1.0 / float(np.max(rates))


@ti.func
def flow(constants, particle):
    """Velocity of the gas, which does the work that moves particles along with it."""
    return constants.gas_velocity


@ti.func
def acceleration(constants, particle):
    """Against the velocity relative to the gas."""
    return (constants.rate + constants.friction * particle.radius**2 / particle.mass) * (
        constants.gas_velocity - particle.velocity
    )
