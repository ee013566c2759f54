"""The rigid sphere among the grains: a free projectile, or a driven indenter."""

import math
from typing import Annotated

from dusttaichi.scene.boundary import moves_faces
from dusttaichi.scene.fields import AnyScene, Block, Faults, Field, Number
from dusttaichi.scene.material import DEFAULT, Material
from dusttaichi.scene.quantities import Quantity, Vector

SMOOTH = 1e-6  # factor on the surface energy in place of 0, by which JKR would be scaled
Place = Annotated[Vector, Quantity("length", count=3)]
Lengths2 = Annotated[tuple[float, float], Quantity("length", count=2)]


class Sphere(Block):
    """A rigid sphere that touches grains by the same laws as grains touch each other."""

    radius: Annotated[float, Quantity("length", gt=0, le=1, example="6 um")] = Field(
        description="radius of the sphere, of a grain or more"
    )
    density: Annotated[float, Quantity("density", gt=0, le=3e4)] | None = Field(
        None, description="density of the sphere, default that of its material"
    )
    mass: Annotated[float, Quantity("mass", gt=0)] | None = Field(
        None, description="mass of the sphere, in place of a density"
    )
    material: str = Field(
        DEFAULT,
        description="material of its surface, one of `materials`; default that of the grains",
    )
    adhesion: Annotated[float, Number(ge=0, le=10)] = Field(
        1.0, description="factor on the surface energy of its contacts; 0: no adhesion"
    )
    position: Place | None = Field(None, description="its centre at the start; either this or gap")
    gap: Annotated[float, Quantity("length", ge=0, example="0.1 um")] | None = Field(
        None,
        description="distance from its surface to the nearest grain below it, over the middle of "
        "the sample",
    )
    offset: Lengths2 | None = Field(
        None, description="with gap: displacement along x and y from over the middle"
    )
    velocity: Annotated[Vector, Quantity("speed", count=3)] = Field(
        ("0 m/s", "0 m/s", "0 m/s"),
        description="velocity at the start of a sphere that moves by forces",
    )
    spin: Annotated[Vector, Quantity("angular velocity", count=3)] = Field(
        ("0 rad/s", "0 rad/s", "0 rad/s"),
        description="angular velocity at the start of such a sphere",
    )
    speed: Annotated[Vector, Quantity("speed", count=3)] | None = Field(
        None,
        description="velocity at which the sphere is driven, without rotation, whatever forces "
        "act on it; a stage may change it by drive.sphere_speed",
    )

    def faults(self) -> Faults:
        if (self.position is None) == (self.gap is None):
            yield "", "exactly one of position and gap is needed"
        if self.density is not None and self.mass is not None:
            yield "mass", "density is given already; one of both is enough"
        if self.offset is not None and self.gap is None:
            yield "offset", "it belongs to gap"
        if self.driven and any((*self.velocity, *self.spin)):
            text = "it is for a sphere that moves by forces; this one is driven (speed)"
            yield "velocity" if any(self.velocity) else "spin", text

    @property
    def driven(self) -> bool:
        """True for an indenter, False for a projectile."""
        return self.speed is not None

    def surface(self, materials: tuple[Material, ...], names: tuple[str, ...]) -> Material:
        """Its Material, with its density; materials and their names: of the scene, in one order."""
        material = materials[names.index(self.material)]
        volume = 4.0 / 3.0 * math.pi * self.radius**3
        density = self.mass / volume if self.mass is not None else self.density or material.density
        return material.model_copy(update={"density": density})


def check(scene: AnyScene) -> Faults:
    """Faults of the sphere of a scene with its other blocks."""
    sphere = scene.sphere
    if sphere is None or not sphere.driven:
        text = "the sphere moves by forces; give sphere.speed to drive it"
        if sphere is None:
            text = "there is no sphere; give the scene one with a speed"
        for n, stage in enumerate(scene.stages):
            if stage.drive.sphere_speed is not None:
                yield f"stages.{n}.drive.sphere_speed", text
    if sphere is None:
        return
    if sphere.material not in scene.material_names:
        yield "sphere.material", f"one of {', '.join(scene.material_names)} is needed"
    if sphere.radius < scene.material.radius:
        yield "sphere.radius", "it is smaller than a grain; make it one of the sample"
    if scene.numerics.precision == "f32":
        text = "single precision does not resolve contacts with a sphere; allowed: f64, mixed"
        yield "numerics.precision", text
    if scene.boundary.kind == "tube":
        yield "sphere", "its contacts with a tube are not computed; use another boundary"
    if moves_faces(scene):
        yield "sphere", "the faces of its cell must rest; wall_speed may be used"
