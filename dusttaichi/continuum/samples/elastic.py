"""An elastic body without strengths, such as a soft bead (G09 section 4.1) or a ring of rubber."""

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from dusttaichi.continuum.samples import lattice
from dusttaichi.continuum.samples.body_registry import (
    Edges,
    FreeBody,
    Matter,
    lift_to_space,
    register,
)
from dusttaichi.continuum.samples.dust import whole
from dusttaichi.continuum.samples.particle_arrays import Particles
from dusttaichi.results.roles import ELASTIC
from dusttaichi.scene import moduli
from dusttaichi.scene.fields import Faults, Number
from dusttaichi.scene.quantities import Density, Quantity


class ElasticSample(FreeBody):
    """An elastic sphere, ring, shell or block about the origin, without strengths.

    p = K (rho/rho_0 - 1).
    """

    extra_keys: ClassVar[tuple[str, ...]] = moduli.KEYS

    @property
    def has_elastic(self) -> bool:
        return True

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
    lattice: Literal["auto", "circles"] = Field(
        "auto",
        description="positions of the particles: rows, or layers in three dimensions, whose ends "
        "are flat parts of the rim; or, in two dimensions, concentric circles with a round rim",
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

    def faults(self) -> Faults:
        if (self.diameter is None) == (self.size is None):
            yield "diameter", "exactly one of diameter and size is needed"
        elif self.size is not None and self.hole:
            yield "hole", "it is for spheres; leave it out of a block"
        elif self.size is not None and self.lattice == "circles":
            yield "lattice", "circles are for discs and rings; leave it out of a block"
        elif self.size is None and not self.hole < self.diameter:
            yield "hole", "a hole smaller than the diameter is needed"

    def conflicts(self, scene) -> Faults:
        yield from super().conflicts(scene)
        if self.lattice == "circles" and scene.dimension == 3:
            yield "lattice", "circles are for dimension: 2"


@register(ElasticSample)
def make(spec: ElasticSample, matter: Matter) -> Particles:
    """The elastic body of spec; its mass is exact, its moments are those of points.

    Raises DustError for too many particles for the memory, or a body smaller than one.
    """
    if spec.size:
        volume = float(np.prod(spec.size))
        lattice.check_count(volume, matter.spacing, matter.dimension, "elastic body: size")
        points = lattice.fill(np.array(spec.size), matter.spacing)
    else:
        points, volume = lattice.hollow_sphere(
            spec, matter, "elastic body: diameter, hole", spec.lattice
        )
    position, count = lift_to_space(points - points.mean(axis=0)), len(points)
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
        dimension=matter.dimension,
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
    particles.fill_room(spec.size or [spec.diameter] * matter.dimension)
    return spec.place_particles(particles)
