"""Sizes and masses of the grains in internal units."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dusttaichi import units
from dusttaichi.grains.state import GrainProperties


@dataclass(frozen=True, eq=False)
class GrainBodies:
    """Radii, masses and moments of inertia of the grains [um, pg, pg um^2].

    count: N. radii: of all grains, one number, or (N,) in the sample's order; radius, smallest: the
    largest and the smallest of them. mass, inertia: one number, or (N, 1) in internal order;
    unit_mass, unit_inertia: arguments of kernels, 1 where grains differ. volume: of all grains.
    properties: of grains that differ, None of equal ones.
    """

    count: int
    radii: np.ndarray | float
    mass: np.ndarray | float
    inertia: np.ndarray | float
    volume: float
    properties: GrainProperties | None

    @property
    def are_equal(self):
        return self.properties is None

    @cached_property
    def radius(self):
        return float(np.max(self.radii))

    @cached_property
    def smallest(self):
        return float(np.min(self.radii))

    @property
    def unit_mass(self):
        return self.mass if self.are_equal else 1.0

    @property
    def unit_inertia(self):
        return self.inertia if self.are_equal else 1.0

    @property
    def grain_radii(self):
        """Radii of the grains by the sample's numbers [um], (N,)."""
        return np.broadcast_to(self.radii, self.count)


def make_bodies(properties, order, volume):
    """GrainBodies of GrainProperties [SI]; order: the sample's number of each grain.

    volume [um^3]: of all grains.
    """
    mass, inertia = properties.mass / units.MASS, properties.inertia / units.INERTIA
    differ = properties.material is not None
    if differ:
        mass, inertia = (values[order][:, None] for values in (mass, inertia))
    radii = properties.radius / units.LENGTH
    return GrainBodies(len(order), radii, mass, inertia, volume, properties if differ else None)
