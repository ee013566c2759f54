"""Records of a continuum: series and snapshots, all in SI."""

import numpy as np

from dusttaichi.continuum.dust_measure import compute_intact_fraction
from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.continuum.physics.damage import carried_pressure
from dusttaichi.physics.geometry import WALLS
from dusttaichi.results.roles import DUST

IN_SPACE = [0, 4, 8, 1, 2, 5]  # xx yy zz xy xz yz of nine rows


def components(S, dimension):
    """Deviators (n, 6), xx yy zz xy xz yz, of those in memory (n, dimension^2)."""
    if dimension == 3:
        return S[:, IN_SPACE]
    out = np.zeros((len(S), 6))
    out[:, 0], out[:, 2], out[:, 4] = S[:, 0], S[:, 3], S[:, 1]
    out[:, 1] = -(S[:, 0] + S[:, 3])
    return out


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
        momenta = self._elastic_bodies.momenta()
        return {"impulse": np.concatenate([self._motion.impulses(), momenta])}

    def make_series(self, m, window):
        """Variables that the continuum adds to a record of the time series.

        m: result of DustLedger.measure. window: Window of `sums`, None at step 0.
        """
        state, elastic = self._state, self._elastic_bodies.measure()
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
        record |= self._average_dust()
        return record | (self._heat.make_series() if self._heat else {})

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

    def _average_dust(self):
        """Means over the dust: pressure and stress over the volume, the others over the mass."""
        state = self._state
        dust = state.of_particles("role") == DUST
        mass, density = state.of_particles("mass")[dust], state.of_particles("density")[dust]
        undamaged_fraction = compute_intact_fraction(state)[dust]
        pressures = carried_pressure(state.of_particles("pressure")[dust], undamaged_fraction)
        volume = mass / density
        volume_fraction = volume / volume.sum() if len(volume) else volume
        deviator = volume_fraction @ components(
            undamaged_fraction[:, None] * state.of_particles("deviator")[dust], state.dimension
        )
        pressure = float(volume_fraction @ pressures)
        solid, total = state.material_of(dust).rho_s, mass.sum() if len(mass) else 1.0
        return {
            "pressure_mean": pressure,
            "stress_mean": deviator - pressure * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
            "filling_factor_mean": float(mass @ (density / solid) / total),
            "damage_mean": float(mass @ (1.0 - undamaged_fraction) / total),
        }

    def make_snapshot(self):
        """The present particles, in the order of the sample."""
        state = self._state
        undamaged_fraction = compute_intact_fraction(state)
        current = {
            "position": state.raise_to_space(state.of_particles("x")),
            "velocity": self._motion.velocities(),
            "density": state.of_particles("density"),
            "reference_density": state.of_particles("reference"),
            "pressure": carried_pressure(state.of_particles("pressure"), undamaged_fraction),
            "deviator": components(
                undamaged_fraction[:, None] * state.of_particles("deviator"), state.dimension
            ),
        }
        if state.layout.damage:
            current["damage"] = 1.0 - undamaged_fraction
        snapshot = {name: state.in_order(values) for name, values in current.items()}
        return snapshot | (self._heat.make_snapshot() if self._heat else {})
