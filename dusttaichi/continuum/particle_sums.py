"""Sums over the particles of a continuum as they are now. SI inside.

`ParticleSums` are of copies of the fields; those that a device forms, of which the host reads
totals alone, are in continuum.device_sums.
"""

from functools import cached_property

import numpy as np

from dusttaichi.continuum.dust_measure import compute_intact_fraction, elastic_of_particles, largest
from dusttaichi.continuum.kernels.tensor_rows import read_deviators
from dusttaichi.continuum.physics.damage import carried_pressure
from dusttaichi.results.roles import DUST, ELASTIC


def describe_means(pressure, deviator, filling_factor, damage):
    """Variables of a record that are means over the dust; deviator: (6,), see `read_deviators`."""
    pressure = float(pressure)
    return {
        "pressure_mean": pressure,
        "stress_mean": deviator - pressure * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
        "filling_factor_mean": float(filling_factor),
        "damage_mean": float(damage),
    }


class ParticleSums:
    """Sums over the particles of a DustMotion, each formed where it is needed.

    Of no use once something has moved.
    """

    def __init__(self, motion):
        self._motion, self._state = motion, motion.state
        self._role, self._mass = (motion.state.of_particles(name) for name in ("role", "mass"))
        self._free = self._state.of_particles("group") < 0

    @cached_property
    def v(self):
        """Present velocities (n, 3) [m/s]."""
        return self._motion.velocities()

    @cached_property
    def _mean_v(self):
        """Mean velocities over the half step up to the present (n, 3) [m/s]."""
        state = self._state
        return 0.5 * (state.raise_to_space(state.of_particles("v")) + self.v)

    @cached_property
    def _speed2(self):
        return np.sum(self.v * self.v, axis=1)

    def kinetic(self):
        """Kinetic energy of free particles [J]."""
        return 0.5 * np.sum(self._mass[self._free] * self._speed2[self._free])

    def largest_speed(self):
        """Largest speed [m/s]."""
        return float(np.sqrt(self._speed2.max()))

    def momentum(self):
        """Momentum of free particles [kg m/s], (3,)."""
        return self._mass[self._free] @ self.v[self._free]

    def angular_momentum(self):
        """Angular momentum of free particles [kg m^2/s], (3,)."""
        state, free = self._state, self._free
        x = state.raise_to_space(state.of_particles("x"))
        return self._mass[free] @ np.cross(x[free], self.v[free])

    def weight_energy(self, gravity, masses, centres):
        """Energy of free particles and of bodies in uniform gravity [J].

        gravity, centres: in the axes of the kernels.
        """
        at = np.concatenate([self._state.of_particles("x")[self._free], centres])
        return -np.concatenate([self._mass[self._free], masses]) @ (at @ gravity)

    def attraction(self, self_gravity):
        """Energy of particles in the field of each other [J]; self_gravity: SelfGravity."""
        return self_gravity.energy()

    def outside_energies(self):
        """Potential energies and work of forces from outside, see DustForces.sum_energies [J]."""
        return self._motion.outside.sum_energies()

    def elastic(self):
        """Elastic energies [J], (3,), see dust_measure.elastic_of_particles."""
        gives = (self._role == DUST) | (self._role == ELASTIC)
        return elastic_of_particles(self._state, gives).sum(axis=0)

    def work(self):
        """Work of the stresses so far [J], (3,)."""
        return self._state.of_particles("work").sum(axis=0)

    def loss(self):
        """Work of both viscosities so far [J], (2,)."""
        return self._state.of_particles("loss").sum(axis=0)

    def noise_power(self):
        """Power by pairs that grid noise loses [W]."""
        return self._state.of_particles("noise_power").sum()

    def power(self, name):
        """Power of a force [W]: "viscous", "grid_force" or "pushing".

        Velocities are the means over the half step up to the present.
        """
        state = self._state
        return np.sum(state.raise_to_space(state.of_particles(name)) * self._mean_v)

    def taken(self):
        """Work so far against artificial stress and stiffness against hourglass modes [J]."""
        return self._state.of_particles("taken").sum()

    def largest(self):
        """See measure.largest."""
        return largest(self._state, self._role == DUST)

    def average_dust(self):
        """Means over the dust: pressure and stress over the volume, the others over the mass."""
        state, dust = self._state, self._role == DUST
        mass, density = self._mass[dust], state.of_particles("density")[dust]
        undamaged_fraction = compute_intact_fraction(state)[dust]
        pressures = carried_pressure(state.of_particles("pressure")[dust], undamaged_fraction)
        volume = mass / density
        volume_fraction = volume / volume.sum() if len(volume) else volume
        deviator = volume_fraction @ read_deviators(
            undamaged_fraction[:, None] * state.of_particles("deviator")[dust], state.dimension
        )
        solid, total = state.material_of(dust).rho_s, mass.sum() if len(mass) else 1.0
        return describe_means(
            *(volume_fraction @ pressures, deviator, mass @ (density / solid) / total),
            mass @ (1.0 - undamaged_fraction) / total,
        )
