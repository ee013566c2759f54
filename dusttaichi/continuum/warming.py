"""Heat and temperature of dust, from what its stresses and viscosities have dissipated."""

import numpy as np

from dusttaichi.continuum import measure
from dusttaichi.samples.continuum.particles import DUST


class Warming:
    """Heat of the dust of a Simulation `sim`, counted from its step 0."""

    def __init__(self, scene, sample, sim):
        self.sim = sim
        everything = np.ones(sim.n, bool)
        self._stored = sim.in_order(measure.elastic_of_particles(sim, everything).sum(axis=1))
        capacity, start = (
            np.array([getattr(material, name) for material in scene.all_materials])
            for name in ("heat_capacity", "temperature")
        )
        self._dust = sample.role == DUST
        self._capacity = sample.mass * capacity[sample.material]
        self._start = start[sample.material]

    def snapshot(self):
        """Temperatures [K] in the order of the sample; not a number of what is not dust."""
        rise = self.sim.in_order(measure.heat(self.sim, self._stored)) / self._capacity
        return {"temperature": np.where(self._dust, self._start + rise, np.nan)}

    def series(self):
        """Heat of the dust [J], its temperature [K]: mean over the heat capacity, largest."""
        dust, capacity = self._dust, self._capacity[self._dust]
        heat = self.sim.in_order(measure.heat(self.sim, self._stored))[dust]
        temperature = self._start[dust] + heat / capacity
        return {
            "heat": float(heat.sum()),
            "temperature_mean": float(np.average(temperature, weights=capacity)),
            "largest_temperature": float(temperature.max()),
        }
