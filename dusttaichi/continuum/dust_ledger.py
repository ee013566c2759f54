"""Energies of a continuum, and the ledger of what enters and leaves it. SI inside."""

import numpy as np

from dusttaichi.continuum.dust_measure import elastic_of_particles, largest
from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.method import Measurement
from dusttaichi.results.roles import DUST, ELASTIC


class DustLedger:
    """Measures energies, losses by channel and work since the start.

    motion: DustMotion. self_gravity: SelfGravity, or None. gravity: acceleration in the axes of the
    kernels [m/s^2]. loss_at_start, (channels,), outside_at_start: losses and energies of the forces
    from outside at step 0, which count as 0.

    Velocities in memory are half a step behind: the work of the present forces in the half step up
    to the present belongs to the losses and to the work of faces as well.
    """

    def __init__(self, motion, self_gravity, gravity):
        self._motion, self._state = motion, motion.state
        self._self_gravity, self._gravity = self_gravity, gravity
        self.loss_at_start, self.outside_at_start = None, None

    def begin(self):
        """Count losses from now on."""
        if self._motion.outside is not None:
            self.outside_at_start = self._motion.outside.sum_energies()
        self.loss_at_start = self.measure_energies()["loss"]

    # -- measuring -------------------------------------------------------------------------------

    def measure(self):
        """The Measurement now [J]; its parts are `measure_energies`, less the start."""
        m, outside, lost = self.measure_energies(), self._motion.outside, {}
        m["force_work"] = 0.0
        if outside is not None:
            m["force_work"], lost = outside.energies_since(self.outside_at_start)
        losses = np.append(m["loss"] - self.loss_at_start, list(lost.values()))
        potential = m["gravity_energy"] + m["elastic_energy"]
        work = m["work"] + m["force_work"]
        components = m | {"loss": losses}
        return Measurement.from_energies(
            m["kinetic"], potential, losses, work=work, parts=components
        )

    def measure_energies(self):
        """Energies [J], losses by channel, extremes: a dict of numbers and arrays."""
        state, motion = self._state, self._motion
        role, mass = state.of_particles("role"), state.of_particles("mass")
        v = motion.velocities()
        gives = (role == DUST) | (role == ELASTIC)
        speed2 = np.sum(v * v, axis=1)
        free = state.of_particles("group") < 0
        kinetic = 0.5 * np.sum(mass[free] * speed2[free])
        speed, spin = motion.body_speeds()
        masses = state.of_bodies("mass")[FACES:, 0]
        kinetic += 0.5 * np.sum(masses * np.sum(speed[FACES:] ** 2, axis=1))
        kinetic += 0.5 * np.sum(spin * motion.angular_momenta())
        elastic = elastic_of_particles(state, gives).sum(axis=0)
        work = state.of_particles("work").sum(axis=0)
        loss = state.of_particles("loss").sum(axis=0) + state.of_bodies("loss").sum(axis=0)
        loss = loss - self._viscous_work(v, speed, spin)
        return {
            "kinetic": float(kinetic),
            "gravity_energy": float(self._gravity_energy(mass, masses, free)),
            "elastic_energy": float(elastic.sum()),
            "loss": np.array([*(work - elastic), *loss, self._artificial_work(v)]),
            "work": self._face_work(),
            "speed": float(np.sqrt(speed2.max())),
            "largest": largest(state, role == DUST),
            "momentum": (mass[free] @ v[free]) + masses @ speed[FACES:],
            "angular_momentum": self._angular_momentum(mass, masses, free, v, speed),
        }

    def _gravity_energy(self, mass, masses, free):
        """Energy in the fields of gravity; mass: of particles, masses: of rigid bodies."""
        state = self._state
        centres = state.of_bodies("centre")[FACES:, state.axes]
        at = np.concatenate([state.of_particles("x")[free], centres])
        energy = -np.concatenate([mass[free], masses]) @ (at @ self._gravity)
        return energy + (0.0 if self._self_gravity is None else self._self_gravity.energy())

    def _angular_momentum(self, mass, masses, free, v, speed):
        state = self._state
        return (
            mass[free] @ np.cross(state.raise_to_space(state.of_particles("x"))[free], v[free])
            + masses @ np.cross(state.of_bodies("centre")[FACES:], speed[FACES:])
            + self._motion.angular_momenta()[FACES:].sum(axis=0)
        )

    # -- the half step up to the present ---------------------------------------------------------

    def _artificial_work(self, v):
        """Work since the start against artificial stress and stiffness against hourglass modes.

        It is 0 where there is neither. Much of it is returned.
        """
        state = self._state
        if "taken" not in state:
            return 0.0
        half, mean = state.half_step, 0.5 * (state.raise_to_space(state.of_particles("v")) + v)
        last = half * np.sum(state.raise_to_space(state.of_particles("pushing")) * mean)
        return float(state.of_particles("taken").sum() - last)

    def _viscous_work(self, v, speed, spin):
        """Work of both viscosities in the half step, (2,).

        v: present velocities; speed, spin: of faces and rigid bodies.
        """
        state, half = self._state, self._state.half_step
        mean = 0.5 * (state.raise_to_space(state.of_particles("v")) + v)
        speed = 0.5 * (state.of_bodies("speed") + speed)
        spin, drags = 0.5 * (state.of_bodies("spin") + spin), state.of_bodies("drags")
        by_pairs = np.array([0.0, half * state.of_particles("noise_power").sum()])
        return -by_pairs + np.array(
            [
                half * np.sum(state.raise_to_space(state.of_particles(name)) * mean)
                + half * np.sum(drags[:, column : column + 3] * speed)
                + half * np.sum(drags[:, column + 3 : column + 6] * spin)
                for name, column in (("viscous", 0), ("grid_force", 6))
            ]
        )

    def _face_work(self):
        """Work of moving faces on the dust since the start."""
        state = self._state
        speed = state.of_bodies("speed")[:FACES]
        last = state.half_step * np.sum(state.of_bodies("force")[:FACES] * speed)
        return float(state.of_bodies("work")[:FACES].sum() - last)
