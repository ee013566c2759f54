"""A scene and its sample before anything is compiled."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dusttaichi.compute.backend import Loops
from dusttaichi.domain.domain import Domain
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.kernels.store import Layout
from dusttaichi.grains.outside_forces import OutsideForces
from dusttaichi.grains.pushes import Push
from dusttaichi.grains.rigid_sphere import RigidSphere
from dusttaichi.grains.state import GrainProperties
from dusttaichi.grains.time_step import TimeStep


@dataclass(frozen=True)
class Prepared:
    """Input of a GrainEngine beside its kernels and fields.

    scene: `grain_properties.scaled`. pushed_sample: `samples.apply_pushes`; sample: the
    same with its measures in the cell. order (N,): numbers of the
    grains in the sample, in internal order. domain: at rest, internal units. skin: of the search
    [um], None as it suits.
    """

    scene: Any
    sample: Any
    pushed_sample: Any
    properties: GrainProperties
    order: np.ndarray
    step: TimeStep
    domain: Domain
    sphere: RigidSphere | None
    forces: OutsideForces | None
    push: Push
    contact_table: ContactTable
    skin: float | None
    threads: int
    loops: Loops
    layout: Layout

    @property
    def polydisperse(self):
        """GrainProperties of grains that differ, None of equal ones."""
        return None if self.properties.material is None else self.properties

    @property
    def stiffness_ratio(self):
        """Stiffness of the contacts that the sample brings along over that of the scene's."""
        scaling = self.scene.numerics.stiffness_scaling
        return self.sample.info.get("stiffness_scaling", 1.0) / scaling
