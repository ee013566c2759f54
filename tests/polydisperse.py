"""Grains of their own radius and material, for tests: silicate S12 and ice T19."""

import numpy as np
import reference as ref
from conftest import Probe, make_scene

from dusttaichi import units
from dusttaichi.samples import Sample

ICE = dict(r=0.1e-6, rho=1000.0, gamma=0.1, E=7e9, nu=0.25, xi_crit=0.8e-9)  # T19 Table 1
KINDS = (ref.SILICATE, ICE)
ALL = ("rolling", "sliding", "twisting")


def scene_of(**keys):
    return make_scene(materials={"ice": "ice_t19"}, **keys)


def grain(radius, kind):
    return {**KINDS[kind], "r": radius}


def masses_of(radii, kinds):
    return 4 / 3 * np.pi * np.array(radii) ** 3 * np.array([KINDS[k]["rho"] for k in kinds])


def polydisperse(x, radii, kinds=None, v=0.0, w=0.0):
    x = np.array(x, float)
    kinds = np.zeros(len(x), np.int32) if kinds is None else np.array(kinds, np.int32)
    v, w = (np.array(a, float) + np.zeros_like(x) for a in (v, w))
    return Sample(x, v, w, radii=np.array(radii, float), materials=kinds)


class Grains(Probe):
    """A Probe of grains that are not alike."""

    def __init__(self, scene, sample):
        super().__init__(scene, sample)
        self.radii, self.kinds = sample.radii, sample.materials
        self.masses = masses_of(self.radii, self.kinds)
        self.inertias = 0.4 * self.masses * self.radii**2

    @property
    def v(self):
        return self._grains("v") + 0.5 * self.dt * self.loads()[0] / self.masses[:, None]

    @property
    def w(self):
        spins = self._grains("w") * units.SPIN
        return spins + 0.5 * self.dt * self.loads()[1] / self.inertias[:, None]

    def momenta(self):
        """Momentum, angular momentum about the origin, and the scale of each."""
        x, m = self.x, self.masses[:, None]
        linear, turning = m * self.v, np.cross(x, m * self.v) + self.inertias[:, None] * self.w
        return linear.sum(0), turning.sum(0), np.abs(linear).sum(), np.abs(turning).sum()

    def pair(self, i, j, **keys):
        return ref.mixed(*(grain(self.radii[n], self.kinds[n]) for n in (i, j)), **keys)

    def wall(self, i, **keys):
        return ref.mixed(grain(self.radii[i], self.kinds[i]), KINDS[0], wall=True, **keys)
