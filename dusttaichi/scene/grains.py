"""A scene of the method `grains`: what the grains are, how they act on each other, and where."""

from typing import ClassVar, Literal

from pydantic import Field, field_validator

from dusttaichi.samples import AnySample, reads_samples
from dusttaichi.scene import collisions as study
from dusttaichi.scene.checks.grains import check
from dusttaichi.scene.collisions import Collisions
from dusttaichi.scene.gravity import Gravity
from dusttaichi.scene.interaction import Interaction
from dusttaichi.scene.material import DEFAULT, Material
from dusttaichi.scene.numerics import Numerics
from dusttaichi.scene.push import Push
from dusttaichi.scene.scene import Scene, check_names
from dusttaichi.scene.sphere import Sphere


@reads_samples
class GrainsScene(Scene):
    """A run of grains with adhesive contacts; all quantities are SI floats."""

    order: ClassVar[tuple[str, ...]] = (
        "name",
        "extensions",
        "method",
        "material",
        "materials",
        "interaction",
        "sample",
        "push",
        "sphere",
        "gravity",
        "boundary",
        "stop",
        "stages",
        "numerics",
        "output",
        "replicas",
        "collisions",
    )

    method: Literal["grains"] = Field("grains", description="what computes the run")
    material: Material = Field(
        description="what the grains are made of, and the walls: a name, a block with `base` "
        "and the numbers that differ, or a block with all six numbers"
    )
    materials: dict[str, Material] = Field(
        {},
        description="further materials that a sample may give to some of its grains, by name, "
        "each written like `material`",
    )
    interaction: Interaction = Field(
        default_factory=Interaction, description="how grains act on each other"
    )
    sample: AnySample = Field(description="where the grains are at the start")
    push: tuple[Push, ...] = Field(
        (), description="pushes on grains or on faces of the sample, from the start of the run"
    )
    sphere: Sphere | None = Field(
        None, description="a rigid sphere among the grains: a projectile or an indenter"
    )
    gravity: Gravity | None = Field(
        None, description="acceleration of grains and sphere, everywhere alike or towards a point"
    )
    numerics: Numerics = Field(
        default_factory=Numerics, description="time step, precision, threads"
    )
    collisions: Collisions | None = Field(
        None, description="what `dust collide` varies; a run takes no notice of it"
    )

    @field_validator("materials", mode="after")
    @classmethod
    def _names(cls, value: dict[str, Material]) -> dict[str, Material]:
        return check_names(value)

    @property
    def all_materials(self) -> tuple[Material, ...]:
        """Materials of the grains, by number: the material, which walls have too, and others."""
        return (self.material, *self.materials.values())

    @property
    def material_names(self) -> tuple[str, ...]:
        """Their names, in the same order."""
        return (DEFAULT, *self.materials)

    @property
    def softened(self) -> bool:
        """Whether contacts are softer than the material is."""
        return any(scale != 1.0 for scale in self.stiffnesses)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """stiffness_scaling of every stage."""
        own = self.numerics.stiffness_scaling
        return tuple(plan.drive.stiffness_scaling or own for plan in self.stage_plans)

    @property
    def restiffens(self) -> bool:
        """Whether it differs from stage to stage."""
        return len(set(self.stiffnesses)) > 1

    def conflicts(self) -> list[tuple[str, str]]:
        return [*super().conflicts(), *check(self), *study.check(self)]
