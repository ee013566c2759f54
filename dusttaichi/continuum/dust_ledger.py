"""Energies of a continuum, and the ledger of what enters and leaves it. SI inside."""

import numpy as np

from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.method import Measurement


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
        with self._state.at_rest():
            sums = self._motion.sum_particles()
            if self._motion.outside is not None:
                self.outside_at_start = sums.outside_energies()
            self.loss_at_start = self._sum_energies(sums)["loss"]

    # -- measuring -------------------------------------------------------------------------------

    def measure(self):
        """The Measurement now [J]; its parts are `measure_energies`, less the start."""
        outside, lost = self._motion.outside, {}
        with self._state.at_rest():
            sums = self._motion.sum_particles()
            m = self._sum_energies(sums) | {"force_work": 0.0}
            if outside is not None:
                change = sums.outside_energies() - self.outside_at_start
                m["force_work"], lost = outside.split_work(change)
        losses = np.append(m["loss"] - self.loss_at_start, list(lost.values()))
        potential = m["gravity_energy"] + m["elastic_energy"]
        work = m["work"] + m["force_work"]
        components = m | {"loss": losses}
        return Measurement.from_energies(
            m["kinetic"], potential, losses, work=work, parts=components
        )

    def measure_energies(self):
        """Energies [J], losses by channel, extremes: a dict of numbers and arrays."""
        with self._state.at_rest():
            return self._sum_energies(self._motion.sum_particles())

    def _sum_energies(self, sums):
        """`measure_energies` of ParticleSums."""
        state, motion = self._state, self._motion
        kinetic = sums.kinetic()
        speed, spin = motion.body_speeds()
        masses = state.of_bodies("mass")[FACES:, 0]
        kinetic += 0.5 * np.sum(masses * np.sum(speed[FACES:] ** 2, axis=1))
        kinetic += 0.5 * np.sum(spin * motion.angular_momenta())
        elastic = sums.elastic()
        loss = sums.loss() + state.of_bodies("loss").sum(axis=0)
        loss = loss - self._viscous_work(sums, speed, spin)
        return {
            "kinetic": float(kinetic),
            "gravity_energy": float(self._gravity_energy(sums, masses)),
            "elastic_energy": float(elastic.sum()),
            "loss": np.array([*(sums.work() - elastic), *loss, self._artificial_work(sums)]),
            "work": self._face_work(),
            "speed": sums.largest_speed(),
            "largest": sums.largest(),
            "momentum": sums.momentum() + masses @ speed[FACES:],
            "angular_momentum": sums.angular_momentum()
            + masses @ np.cross(state.of_bodies("centre")[FACES:], speed[FACES:])
            + motion.angular_momenta()[FACES:].sum(axis=0),
        }

    def _gravity_energy(self, sums, masses):
        """Energy in the fields of gravity; masses: of rigid bodies."""
        state, self_gravity = self._state, self._self_gravity
        centres = state.of_bodies("centre")[FACES:, state.axes]
        energy = sums.weight_energy(self._gravity, masses, centres)
        return energy + (0.0 if self_gravity is None else sums.attraction(self_gravity))

    # -- the half step up to the present ---------------------------------------------------------

    def _artificial_work(self, sums):
        """Work since the start against artificial stress and stiffness against hourglass modes.

        It is 0 where there is neither. Much of it is returned.
        """
        state = self._state
        if "taken" not in state:
            return 0.0
        return float(sums.taken() - state.half_step * sums.power("pushing"))

    def _viscous_work(self, sums, speed, spin):
        """Work of both viscosities in the half step, (2,).

        speed, spin: of faces and rigid bodies.
        """
        state, half = self._state, self._state.half_step
        speed = 0.5 * (state.of_bodies("speed") + speed)
        spin, drags = 0.5 * (state.of_bodies("spin") + spin), state.of_bodies("drags")
        by_pairs = np.array([0.0, half * sums.noise_power()])
        return -by_pairs + np.array(
            [
                half * sums.power(name)
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
