"""Records of a continuum: series and snapshots, all in SI."""

import numpy as np

from dusttaichi.continuum.dust_measure import compute_intact_fraction
from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.continuum.kernels.tensor_rows import read_deviators
from dusttaichi.continuum.physics.damage import carried_pressure
from dusttaichi.physics.geometry import WALLS


class DustRecorder:
    """Makes the records of a series and of snapshots.

    motion: DustMotion. environment: Environment. elastic_bodies: ElasticBodies. heat: DustHeat, or
    None. pressed: names of the walls whose force is summed.
    """

    def __init__(self, motion, environment, elastic_bodies, heat, *, pressed):
        self._motion, self._state, self._environment = motion, motion.state, environment
        self._elastic_bodies, self._heat = elastic_bodies, heat
        self._is_summed = np.array([wall in pressed for wall in WALLS])

    def sums(self):
        """Time integrals of the forces on faces and bodies since the start, by name.

        The force on an elastic body is the change of its momentum.
        """
        with self._state.at_rest():
            momenta = self._elastic_bodies.momenta()
            return {"impulse": np.concatenate([self._motion.impulses(), momenta])}

    def make_series(self, m, window):
        """Variables that the continuum adds to a record of the time series.

        m: result of DustLedger.measure. window: Window of `sums`, None at step 0.
        """
        with self._state.at_rest():
            return self._make_series(m, window)

    def _make_series(self, m, window):
        state, elastic = self._state, self._elastic_bodies.measure()
        sums = self._motion.sum_particles()
        force = np.zeros((FACES + state.bodies + len(elastic[0]), 3))
        if window is not None:
            force = window.mean("impulse")
        speed, spin = self._motion.body_speeds()
        record = m | {
            "substeps": state.substeps,
            "body_position": np.concatenate([state.of_bodies("centre")[FACES:], elastic[0]]),
            "body_velocity": np.concatenate([speed[FACES:], elastic[1]]),
            "body_spin": np.concatenate([spin[FACES:], elastic[2]]),
            "body_force": force[FACES:],
            "wall_force": -force[:FACES],
            "pressure": self._pressures(-force[:FACES]),
            "largest_filling_factor": max(phi for _, phi, _ in m["largest"]),
            "largest_speed": m["speed"],
        }
        record |= sums.average_dust()
        return record | (self._heat.make_series(sums) if self._heat else {})

    def _pressures(self, wall_force):
        """Pressures on the faces [Pa], (6,), of forces (6, 3); not a number of open ones."""
        areas = self._areas()
        inward = np.array([1, -1, 1, -1, 1, -1]) * wall_force[np.arange(6), np.arange(6) // 2]
        return np.divide(inward, areas, out=np.full(6, np.nan), where=areas > 0.0)

    def _areas(self):
        """Areas of the walls whose force is known [m^2], (6,).

        0 of the others: open faces, and mirrors, whose force is not summed.
        """
        if self._environment.box is None:
            return np.zeros(6)
        areas = self._environment.domain.wall_areas(self._environment.step)
        areas[~self._is_summed] = 0.0
        return areas

    def make_snapshot(self):
        """The present particles, in the order of the sample."""
        with self._state.at_rest():
            return self._make_snapshot()

    def _make_snapshot(self):
        state, snapshot = self._state, {}

        def put(name, values):
            """Put values in the order of the sample; those in internal order are then freed."""
            snapshot[name] = state.in_order(values)

        undamaged_fraction = compute_intact_fraction(state)
        put("position", state.raise_to_space(state.of_particles("x")))
        put("velocity", self._motion.velocities())
        put("density", state.of_particles("density"))
        put("reference_density", state.of_particles("reference"))
        put("pressure", carried_pressure(state.of_particles("pressure"), undamaged_fraction))
        deviators = state.of_particles("deviator")
        deviators *= undamaged_fraction[:, None]
        put("deviator", read_deviators(deviators, state.dimension))
        del deviators
        if state.layout.damage:
            put("damage", 1.0 - undamaged_fraction)
        return snapshot | (self._heat.make_snapshot() if self._heat else {})
