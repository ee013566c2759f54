"""A sphere of dust: a disc in two dimensions."""

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples import body_registry, lattice
from dusttaichi.continuum.samples.dust import cost_of_scatter, dust, whole
from dusttaichi.continuum.samples.particle_arrays import Particles, join_bodies
from dusttaichi.errors import DustError
from dusttaichi.samples.values import Seed
from dusttaichi.scene.fields import Block, Faults
from dusttaichi.scene.making import Cost
from dusttaichi.scene.quantities import Quantity


class Core(Block):
    """The inner part of a sphere, of another dust."""

    diameter: Annotated[float, Quantity("length", gt=0, example="0.5 mm")] = Field(
        description="diameter of the core"
    )
    material: str | None = Field(None, description=body_registry.MATERIAL)
    filling_factor: body_registry.Filling | None = Field(
        None, description="filling factor, as in a block; default: material's"
    )


class SphereSample(body_registry.DustBody):
    """A sphere of dust about the origin, in two dimensions a disc."""

    kind: Literal["sphere"]
    diameter: Annotated[float, Quantity("length", gt=0, example="1 mm")] = Field(
        description="diameter of the sphere"
    )
    lattice: body_registry.Lattice = Field(
        "auto", description="positions of the particles, as in a block"
    )
    seed: Seed = Field(1, description="seed of the glass")
    filling_factor: body_registry.Filling | None = Field(
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
        description="outward velocity of the surface of its hole, negative inwards, with a "
        "divergence-free field elsewhere: an expanding or imploding ring or shell",
    )

    def cost(self, scene) -> Cost | None:
        volume = lattice.sphere_volume(self.diameter, scene.dimension)
        return cost_of_scatter(self.filling_factor, volume, scene)

    def faults(self) -> Faults:
        if not self.hole < self.diameter:
            yield "hole", "a hole smaller than the diameter is needed"
        elif self.radial_velocity and not self.hole:
            yield "radial_velocity", "it is for rings and shells; give a hole as well"
        elif self.core and self.hole:
            yield "hole", "a sphere has a core or a hole; leave one of them out"
        elif self.core and not self.core.diameter < self.diameter:
            yield "core.diameter", "a core smaller than the sphere is needed"

    @property
    def named_materials(self) -> list[tuple[str, str]]:
        named = self.core and self.core.material is not None
        return super().named_materials + ([("core.material", self.core.material)] if named else [])


@body_registry.register(SphereSample)
def make(spec: SphereSample, matter: body_registry.Matter) -> Particles:
    """The sphere of spec: lattice points inside, whose volumes are scaled to be exact.

    Raises DustError for too many particles for the memory, or a sphere smaller than one.
    """
    points, volume = lattice.hollow_sphere(spec, matter, "sample.diameter", spec.lattice, spec.seed)
    particles = _dust(spec, points, volume, matter)
    if spec.radial_velocity:
        away = np.linalg.norm(particles.position, axis=1, keepdims=True)
        hole_fraction = (spec.hole / 2 / away) ** (matter.dimension - 1)
        particles.velocity += spec.radial_velocity * hole_fraction * particles.position / away
    particles.fill_room([spec.diameter] * matter.dimension)
    particles.info["diameter"] = spec.diameter
    return spec.place_particles(particles)


def _dust(spec: SphereSample, points, volume: float, matter: body_registry.Matter) -> Particles:
    """Dust on the points of a sphere of that volume with its core; masses of both are exact.

    Raises DustError for a core without a particle.
    """
    dust_matter = matter.select(spec.material)
    if spec.core is None:
        return dust(points, volume, dust_matter, spec.filling_factor, "sphere")
    inside = np.linalg.norm(points, axis=1) < spec.core.diameter / 2
    if not inside.any() or inside.all():
        raise DustError(
            f"sample.core.diameter = {spec.core.diameter * 1e3:.4g} mm: {inside.sum()} of the "
            f"{len(points)} particles of the sphere are in its core; use a smaller "
            "numerics.spacing, or another diameter."
        )
    of_core = float(lattice.sphere_volume(spec.core.diameter, matter.dimension))
    core = dust(
        points[inside], of_core, matter.select(spec.core.material), spec.core.filling_factor, "core"
    )
    mantle = dust(points[~inside], volume - of_core, dust_matter, spec.filling_factor, "mantle")
    both = join_bodies([mantle, core])
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
