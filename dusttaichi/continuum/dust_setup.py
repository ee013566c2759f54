"""A continuum as it is known before anything is compiled."""

from dataclasses import dataclass
from typing import Any

from dusttaichi.continuum.dust_placement import Surfaces
from dusttaichi.continuum.kernels.store import Layout
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.samples.particle_arrays import Particles
from dusttaichi.domain.domain import Domain


@dataclass(frozen=True)
class Prepared:
    """All that a DustEngine is made from beside its kernels and fields.

    numbers: of a step by name, see KernelNumbers. domain: at rest; its step is found at the start.
    bodies: number of rigid bodies. execution: of the loops (backend.Loops).
    """

    scene: Any
    sample: Particles
    bodies: int
    numbers: dict
    materials: MaterialNumbers
    domain: Domain
    surfaces: Surfaces
    threads: int
    execution: str
    layout: Layout
