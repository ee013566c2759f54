"""Heat and temperature of the dust of a continuum. SI inside."""

import numpy as np

from dusttaichi.continuum.dust_measure import elastic_of_particles
from dusttaichi.continuum.physics.heat import heat, temperature
from dusttaichi.results.roles import DUST


class DustHeat:
    """Heat of the particles of a DustState, counted from its step 0.

    state: DustState. materials: those of the scene. sample: its Particles.
    """

    def __init__(self, state, materials, sample):
        self._state = state
        self._stored = state.in_order(elastic_of_particles(state).sum(axis=1))
        capacity, start = (
            np.array([getattr(material, name) for material in materials])
            for name in ("heat_capacity", "temperature")
        )
        self._dust = sample.role == DUST
        self._capacity = sample.mass * capacity[sample.material]
        self._start = start[sample.material]

    def measure(self):
        """Heat of each particle [J], (N,), in the order of the sample.

        Work of its stresses that is not stored, and energy dissipated by both viscosities, with the
        half step up to the present.
        """
        state = self._state
        heat_of_particles = heat(
            state.of_particles("work").sum(axis=1),
            elastic_of_particles(state).sum(axis=1),
            self._stored[state.of_particles("number")],
            state.of_particles("warmed"),
            state.half_step * state.of_particles("heating"),
        )
        return state.in_order(heat_of_particles)

    def make_snapshot(self):
        """Temperatures [K] in the order of the sample; not a number of what is not dust."""
        temperatures = temperature(self._start, self.measure(), self._capacity)
        return {"temperature": np.where(self._dust, temperatures, np.nan)}

    def make_series(self, _sums):
        """Heat of the dust [J], its temperature [K]: mean over the heat capacity, largest."""
        dust, capacity = self._dust, self._capacity[self._dust]
        energy = self.measure()[dust]
        temperatures = temperature(self._start[dust], energy, capacity)
        return {
            "heat": float(energy.sum()),
            "temperature_mean": float(np.average(temperatures, weights=capacity)),
            "largest_temperature": float(temperatures.max()),
        }


class DeviceDustHeat(DustHeat):
    """DustHeat whose series are of DeviceParticleSums.

    scratch: memory.Table of the lists, by name; others as of DustHeat.
    """

    def __init__(self, state, materials, sample, scratch):
        super().__init__(state, materials, sample)
        columns = self._stored, self._capacity, self._start
        scratch["heat_constants"].from_numpy(np.stack(columns, axis=1))

    def make_series(self, sums):
        dust, (energy, largest) = self._dust, sums.heat()
        capacity = self._capacity[dust]
        return {
            "heat": energy,
            "temperature_mean": float((capacity @ self._start[dust] + energy) / capacity.sum()),
            "largest_temperature": largest,
        }
