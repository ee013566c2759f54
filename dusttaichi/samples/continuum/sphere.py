"""A ball of dust: a disc in two dimensions."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from dusttaichi.errors import DustError
from dusttaichi.samples.continuum import lattice
from dusttaichi.samples.continuum.block import lattice_of
from dusttaichi.samples.continuum.dust import dust, whole
from dusttaichi.samples.continuum.particles import Particles, joined
from dusttaichi.samples.continuum.registry import (
    MATERIAL,
    DustBody,
    Filling,
    Found,
    Lattice,
    Matter,
    register,
)
from dusttaichi.samples.values import Seed
from dusttaichi.scene.fields import Block, problems
from dusttaichi.scene.quantities import Quantity


class Core(Block):
    """The inner part of a sphere, of another dust."""

    diameter: Annotated[float, Quantity("length", gt=0, example="0.5 mm")] = Field(
        description="diameter of the core"
    )
    material: str | None = Field(None, description=MATERIAL)
    filling_factor: Filling | None = Field(
        None, description="filling factor, as in a block; default: material's"
    )


class SphereSample(DustBody):
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
    hole: Annotated[float, Quantity("length", ge=0, example="0.8 mm")] = Field(
        "0 m", description="diameter of a hole in its middle: a ring, in three dimensions a shell"
    )
    core: Core | None = Field(
        None, description="a core of another dust, about the same middle and on the same lattice"
    )
    radial_velocity: Annotated[float, Quantity("speed", example="-5 m/s")] = Field(
        "0 m/s",
        description="velocity of the surface of its hole outwards, negative inwards, and "
        "elsewhere so that no volume changes: a ring or shell that expands or implodes",
    )

    @model_validator(mode="after")
    def _check(self) -> SphereSample:
        if not self.hole < self.diameter:
            raise problems([("hole", "a hole smaller than the diameter is needed")])
        if self.radial_velocity and not self.hole:
            raise problems([("radial_velocity", "it is for rings and shells; give a hole as well")])
        if self.core and self.hole:
            raise problems([("hole", "a sphere has a core or a hole; leave one of them out")])
        if self.core and not self.core.diameter < self.diameter:
            raise problems([("core.diameter", "a core smaller than the sphere is needed")])
        return self

    @property
    def named_materials(self) -> Found:
        named = self.core and self.core.material is not None
        return super().named_materials + ([("core.material", self.core.material)] if named else [])


def volume_of(diameter: float, dimension: int) -> float:
    """Area of a disc [m^2], or volume of a sphere [m^3]."""
    return np.pi / 4 * diameter**2 if dimension == 2 else np.pi / 6 * diameter**3


@register(SphereSample)
def make(spec: SphereSample, matter: Matter) -> Particles:
    """The sphere that spec asks for: lattice points inside, whose volumes are scaled to be exact.

    Raises DustError for more particles than the memory should hold, or a sphere smaller than one.
    """
    volume = volume_of(spec.diameter, matter.dimension) - volume_of(spec.hole, matter.dimension)
    lattice.check_count(volume, matter.spacing, matter.dimension, "sample.diameter")
    points = lattice.ball(
        spec.diameter, matter.spacing, lattice_of(spec, matter), matter.dimension, spec.seed
    )
    points = points[np.linalg.norm(points, axis=1) >= spec.hole / 2]
    particles = _dust(spec, points, volume, matter)
    if spec.radial_velocity:
        away = np.linalg.norm(particles.position, axis=1, keepdims=True)
        share = (spec.hole / 2 / away) ** (matter.dimension - 1)
        particles.velocity += spec.radial_velocity * share * particles.position / away
    reach = spec.diameter / 2
    for axis in particles.axes:
        particles.room[axis] = (-reach, reach)
    particles.info["diameter"] = spec.diameter
    return spec.placed(particles)


def _dust(spec: SphereSample, points, volume: float, matter: Matter) -> Particles:
    """Dust on the points of a sphere of that volume, its core of another one; masses of both are
    exact. Raises DustError for a core without a particle."""
    own = matter.of(spec.material)
    if spec.core is None:
        return dust(points, volume, own, spec.filling_factor, "sphere")
    inside = np.linalg.norm(points, axis=1) < spec.core.diameter / 2
    if not inside.any() or inside.all():
        raise DustError(
            f"sample.core.diameter = {spec.core.diameter * 1e3:.4g} mm: {inside.sum()} of the "
            f"{len(points)} particles of the sphere are in its core; take a smaller "
            "numerics.spacing, or another diameter."
        )
    of_core = float(volume_of(spec.core.diameter, matter.dimension))
    core = dust(
        points[inside], of_core, matter.of(spec.core.material), spec.core.filling_factor, "core"
    )
    mantle = dust(points[~inside], volume - of_core, own, spec.filling_factor, "mantle")
    both = joined([mantle, core])
    both.body[:] = 0
    body = whole("sphere", both.position, both.mass, rigid=False)
    info = {
        "name": "sphere",
        "mass": float(both.mass.sum()),
        "volume": float(volume),
        "core": core.info | {"diameter": spec.core.diameter},
        "mantle": mantle.info,
    }
    return replace(both, bodies=(body,), info=info)
