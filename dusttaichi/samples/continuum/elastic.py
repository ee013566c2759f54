"""An elastic body without strengths: a bead that gives way (G09 section 4.1), a ring of rubber."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from dusttaichi.samples.continuum import lattice
from dusttaichi.samples.continuum.dust import whole
from dusttaichi.samples.continuum.particles import ELASTIC, Particles
from dusttaichi.samples.continuum.registry import Edges, FreeBody, Matter, lifted, register
from dusttaichi.samples.continuum.sphere import volume_of
from dusttaichi.scene import moduli
from dusttaichi.scene.fields import Number, problems
from dusttaichi.scene.quantities import Density, Quantity


class ElasticSample(FreeBody):
    """An elastic sphere, ring, shell or block about the origin, on a lattice of its own: p = K
    (rho/rho_0 - 1), and no limit on any stress."""

    extra_keys: ClassVar[tuple[str, ...]] = moduli.KEYS

    kind: Literal["elastic"]
    diameter: Annotated[float, Quantity("length", gt=0, example="1.1 mm")] | None = Field(
        None, description="diameter of the sphere, in two dimensions of the disc"
    )
    size: Edges | None = Field(
        None, description="in place of it: [width, height] of a block, or [Lx, Ly, Lz]"
    )
    hole: Annotated[float, Quantity("length", ge=0, example="0.9 mm")] = Field(
        "0 m", description="diameter of a hole in its middle: a ring, in three dimensions a shell"
    )
    density: Density = Field(description="density at zero pressure")
    bulk_modulus: Annotated[float, Quantity("pressure", gt=0, le=1e12, example="5 GPa")] = Field(
        description="bulk modulus K"
    )
    shear_ratio: Annotated[float, Number(gt=0, le=1.5)] = Field(
        description="shear modulus over bulk modulus, 3 (1 - 2 nu)/(2 (1 + nu)) of a Poisson ratio"
    )

    @model_validator(mode="before")
    @classmethod
    def _moduli(cls, data: Any) -> Any:
        return moduli.with_moduli(data) if isinstance(data, dict) else data

    @classmethod
    def __get_pydantic_json_schema__(cls, schema, handler):
        block = handler.resolve_ref_schema(handler(schema))
        either = [key for key in block["required"] if key not in ("bulk_modulus", "shear_ratio")]
        return {**block, "properties": {**block["properties"], **moduli.SCHEMA}, "required": either}

    @model_validator(mode="after")
    def _check(self) -> ElasticSample:
        if (self.diameter is None) == (self.size is None):
            raise problems([("diameter", "exactly one of diameter and size is needed")])
        if self.size is not None and self.hole:
            raise problems([("hole", "it is for spheres; leave it out of a block")])
        if self.size is None and not self.hole < self.diameter:
            raise problems([("hole", "a hole smaller than the diameter is needed")])
        return self


@register(ElasticSample)
def make(spec: ElasticSample, matter: Matter) -> Particles:
    """The elastic body that spec asks for; its mass is exact, its moments are those of points.

    Raises DustError for more particles than the memory should hold, or a body smaller than one.
    """
    dimension = matter.dimension
    points, volume = _block(spec, matter) if spec.size else _sphere(spec, matter)
    position, count = lifted(points - points.mean(axis=0)), len(points)
    mass = np.full(count, spec.density * volume / count)
    name = "block" if spec.size else "ring" if spec.hole else "bead"
    shape = "block" if spec.size else "sphere"
    body = replace(whole(name, position, mass, rigid=False, shape=shape), elastic=True)
    particles = Particles(
        position=position,
        mass=mass,
        density=np.full(count, float(spec.density)),
        modulus=np.full(count, float(spec.bulk_modulus)),
        shear_ratio=np.full(count, float(spec.shear_ratio)),
        role=np.full(count, ELASTIC, np.int8),
        spacing=matter.spacing,
        dimension=dimension,
        bodies=(body,),
        info={
            "name": name,
            "shape": shape,
            "diameter": spec.size[0] if spec.size else spec.diameter,
            "hole": spec.hole,
            "density": spec.density,
            "mass": float(mass.sum()),
        }
        | ({"height": spec.size[-1]} if spec.size else {}),
    )
    for n, axis in enumerate(particles.axes):
        reach = (spec.size[n] if spec.size else spec.diameter) / 2
        particles.room[axis] = (-reach, reach)
    return spec.placed(particles)


def _sphere(spec: ElasticSample, matter: Matter):
    """Points of a sphere with its hole, (N, 2 or 3), and its volume [m^2, or m^3]."""
    dimension = matter.dimension
    volume = float(volume_of(spec.diameter, dimension) - volume_of(spec.hole, dimension))
    lattice.check_count(volume, matter.spacing, dimension, "elastic body: diameter, hole")
    own = "triangular" if dimension == 2 else "hexagonal"
    points = lattice.ball(spec.diameter, matter.spacing, own, dimension)
    return points[np.linalg.norm(points, axis=1) >= spec.hole / 2], volume


def _block(spec: ElasticSample, matter: Matter):
    """Points of a block, (N, 2 or 3), and its volume [m^2, or m^3]."""
    volume = float(np.prod(spec.size))
    lattice.check_count(volume, matter.spacing, matter.dimension, "elastic body: size")
    own = "triangular" if matter.dimension == 2 else "hexagonal"
    return lattice.fill(np.array(spec.size), matter.spacing, own), volume
