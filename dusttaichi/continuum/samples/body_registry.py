"""Kinds of bodies for `sample.kind` of the continuum.

A kind is a YAML block and a function that makes Particles of it, as for samples of grains. Built-in
kinds register themselves; a package may add its own:

    class Ring(BodyBlock):
        kind: Literal["ring"]
        ...

    @register(Ring)
    def make(spec, matter):
        return Particles(...)
"""

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag

from dusttaichi.continuum.samples.particle_arrays import Particles, displace
from dusttaichi.samples.values import Position, Seed, Spin, Velocity
from dusttaichi.scene.fields import PLAIN_OR_BLOCK, Block, Faults, Number
from dusttaichi.scene.kinds import AnyOf, KindBlock, Kinds
from dusttaichi.scene.quantities import Quantity

CONTINUUM = Kinds(__package__, "kind of sample of the continuum")
reads_particles = CONTINUUM.add_reader
register = CONTINUUM.register


def _entries(value: Any) -> str:
    return "flat" if isinstance(value, (list, tuple)) and len(value) == 2 else "solid"


def in_plane_or_space(flat, solid):
    """Type of vectors with two numbers (x, z) in two dimensions and three otherwise."""
    return Annotated[
        Annotated[flat, Tag("flat")] | Annotated[solid, Tag("solid")], Discriminator(_entries)
    ]


Pair = tuple[float, float]
Place = in_plane_or_space(Annotated[Pair, Quantity("length", count=2)], Position)
Motion = in_plane_or_space(Annotated[Pair, Quantity("speed", count=2)], Velocity)
Edges = in_plane_or_space(
    Annotated[Pair, Quantity("length", gt=0, count=2, example="5 mm")],
    Annotated[tuple[float, float, float], Quantity("length", gt=0, count=3, example="5 mm")],
)
Turning = Annotated[
    Annotated[float, Quantity("angular velocity"), Tag("one")] | Annotated[Spin, Tag("three")],
    Discriminator(lambda v: "three" if isinstance(v, (list, tuple)) else "one"),
]
Lattice = Literal["auto", "triangular", "hexagonal", "glass"]


def in_space(vector) -> np.ndarray:
    """A vector (3,) from two numbers (x, z) or three; zeros for None."""
    if vector is None:
        return np.zeros(3)
    return np.array([vector[0], 0.0, vector[1]] if len(vector) == 2 else vector, dtype=np.float64)


def lift_to_space(points: np.ndarray) -> np.ndarray:
    """Points (N, 2) of the plane x-z, or (N, 3), as (N, 3)."""
    if points.shape[1] == 3:
        return points
    return np.stack([points[:, 0], np.zeros(len(points)), points[:, 1]], axis=1)


@dataclass(frozen=True)
class Matter:
    """Material and spacing of bodies [SI].

    dimension: 2 or 3. spacing [m] of nearest particles. solid [kg/m^3]: density of the solid;
    filling_factor: initial one of the dust. least, most: allowed filling factors of the material.
    support [m]: reach of the kernel.
    number: of the material in the scene; named_matter: the Matter of its `materials`, by name.
    """

    dimension: int
    spacing: float
    solid: float
    filling_factor: float
    least: float = 0.0
    most: float = 1.0
    support: float = np.inf
    number: int = 0
    named_matter: dict[str, "Matter"] = field(default_factory=dict)

    def select(self, name: str | None) -> "Matter":
        """The Matter of the material of that name, or this one for None."""
        return self if name is None else self.named_matter[name]


class BodyBlock(KindBlock):
    """The YAML block of a kind; its field `kind` is a Literal with the kind's name."""

    @property
    def has_rigid(self) -> bool:
        """True where one of its bodies is rigid."""
        return any(body.has_rigid for body in self.body_blocks.values())

    @property
    def has_elastic(self) -> bool:
        """True where one of its bodies is elastic."""
        return any(body.has_elastic for body in self.body_blocks.values())

    @property
    def named_materials(self) -> list[tuple[str, str]]:
        """Materials that it names, as (dotted path, name); the paths are relative to this block."""
        return []

    def conflicts(self, scene) -> Faults:
        yield from super().conflicts(scene)
        for name in ("size", "position", "velocity", "offset"):
            value = getattr(self, name, None)
            if isinstance(value, tuple) and len(value) != scene.dimension:
                axes = "[x, z]" if scene.dimension == 2 else "[x, y, z]"
                text = f"{scene.dimension} entries {axes} are needed with dimension: "
                yield name, f"{text}{scene.dimension}"
        spin = getattr(self, "spin", None)
        if spin is not None and isinstance(spin, tuple) != (scene.dimension == 3):
            required = "one angular velocity, about the axis out of the plane,"
            if scene.dimension == 3:
                required = "a list of 3 angular velocities"
            yield "spin", f"{required} is needed with dimension: {scene.dimension}"
        for path, name in self.named_materials:
            if name not in scene.materials:
                present = ", ".join(scene.materials) or "none so far"
                yield path, f"a name of the block `materials` is needed: {present}"
        wrong = {2: "hexagonal", 3: "triangular"}[scene.dimension]
        if getattr(self, "lattice", "auto") == wrong:
            yield "lattice", f"{wrong} is not for dimension: {scene.dimension}"


class FreeBody(BodyBlock):
    """Keys of every single body: its position and its motion."""

    position: Place | None = Field(
        None, description="[x, z], in three dimensions [x, y, z]: position of its own origin"
    )
    velocity: Motion | None = Field(None, description="velocity, default at rest")
    spin: Turning | None = Field(
        None,
        description="angular velocity about its centre of mass, in two dimensions one number, "
        "positive from x to z",
    )

    def place_particles(self, particles: Particles) -> Particles:
        """The body at the position of this block, with its motion."""
        spin = self.spin
        if spin is None or isinstance(spin, tuple):
            spin = in_space(spin)
        else:
            spin = np.array([0.0, -spin, 0.0])  # right-handed about -y: x turns towards z
        return displace(particles, in_space(self.position), in_space(self.velocity), spin)


MATERIAL = "its material, the name of one of the scene's `materials`; default: its `material`"


class DustBody(FreeBody):
    """Keys of every single body of dust: its material."""

    material: str | None = Field(None, description=MATERIAL)

    @property
    def named_materials(self) -> list[tuple[str, str]]:
        return [] if self.material is None else [("material", self.material)]


class Layer(Block):
    """A layer of another filling factor."""

    thickness: Annotated[float, Quantity("length", gt=0, example="1 mm")] = Field(
        description="thickness of the layer"
    )
    filling_factor: Annotated[float, Number(gt=0, lt=1)] = Field(
        description="filling factor in the layer"
    )


class Variation(Block):
    """A filling factor with layers and scatter."""

    mean: Annotated[float, Number(gt=0, lt=1)] | None = Field(
        None, description="filling factor, default that of the material"
    )
    layers: tuple[Layer, ...] = Field(
        (), description="layers from the top down; below the last one it is `mean`"
    )
    sigma: Annotated[float, Number(ge=0, lt=0.5)] = Field(
        0.0, description="standard deviation of an additional Gaussian scatter (G09 Fig 10)"
    )
    length: Annotated[float, Quantity("length", ge=0, example="0.2 mm")] = Field(
        "0 m", description="correlation length of the scatter; 0 m: independent particles"
    )
    seed: Seed = Field(1, description="seed of the scatter")


Filling = Annotated[
    Annotated[float, Number(gt=0, lt=1), Tag("plain")] | Annotated[Variation, Tag("block")],
    PLAIN_OR_BLOCK,
]
AnyParticles = Annotated[BodyBlock, AnyOf(CONTINUUM)]
AnySingleBody = Annotated[BodyBlock, AnyOf(CONTINUUM, bodies=True)]


def make_particles(spec: BodyBlock, matter: Matter) -> Particles:
    """The particles of a block, with kind and number as info."""
    particles = CONTINUUM[spec.kind].make(spec, matter)
    particles.info.setdefault("kind", spec.kind)
    particles.info["particles"] = len(particles)
    return particles
