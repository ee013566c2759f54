"""A ball of dust: a disc in two dimensions."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dusttaichi.samples.continuum import lattice
from dusttaichi.samples.continuum.block import lattice_of
from dusttaichi.samples.continuum.dust import dust
from dusttaichi.samples.continuum.particles import Particles
from dusttaichi.samples.continuum.registry import Filling, FreeBody, Lattice, Matter, register
from dusttaichi.samples.values import Seed
from dusttaichi.scene.quantities import Quantity


class SphereSample(FreeBody):
    """A sphere of dust about the origin, in two dimensions a disc."""

    kind: Literal["sphere"]
    diameter: Annotated[float, Quantity("length", gt=0, example="1 mm")] = Field(
        description="diameter of the sphere"
    )
    lattice: Lattice = Field("auto", description="where particles stand, as in a block")
    seed: Seed = Field(1, description="seed of the glass")
    filling_factor: Filling | None = Field(
        None, description="filling factor, or a block with layers and scatter; default: material's"
    )


def volume_of(diameter: float, dimension: int) -> float:
    """Area of a disc [m^2], or volume of a sphere [m^3]."""
    return np.pi / 4 * diameter**2 if dimension == 2 else np.pi / 6 * diameter**3


@register(SphereSample)
def make(spec: SphereSample, matter: Matter) -> Particles:
    """The sphere that spec asks for: lattice points inside, whose volumes are scaled to be exact.

    Raises DustError for more particles than the memory should hold, or a sphere smaller than one.
    """
    volume = volume_of(spec.diameter, matter.dimension)
    lattice.check_count(volume, matter.spacing, matter.dimension, "sample.diameter")
    points = lattice.ball(
        spec.diameter, matter.spacing, lattice_of(spec, matter), matter.dimension, spec.seed
    )
    particles = dust(points, volume, matter, spec.filling_factor, "sphere")
    reach = spec.diameter / 2
    for axis in particles.axes:
        particles.room[axis] = (-reach, reach)
    particles.info["diameter"] = spec.diameter
    return spec.placed(particles)
