"""A scene of the method `grains`: grains, their interaction and the sample."""

from typing import ClassVar, Literal

from pydantic import Field

from dusttaichi.grains import collision_parameters
from dusttaichi.grains.checks import check
from dusttaichi.grains.collision_parameters import Collisions
from dusttaichi.samples import AnySample, reads_samples
from dusttaichi.scene.charge import Charge
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.forces import AnyForce, reads_forces
from dusttaichi.scene.gravity import Gravity
from dusttaichi.scene.interaction import Interaction
from dusttaichi.scene.material import Material
from dusttaichi.scene.numerics import Numerics
from dusttaichi.scene.push import Push
from dusttaichi.scene.scene import MaterialsScene
from dusttaichi.scene.sphere import Sphere
from dusttaichi.scene.surfaces import AnySurface, reads_surfaces


@reads_forces
@reads_surfaces
@reads_samples
class GrainsScene(MaterialsScene):
    """A run of grains with adhesive contacts; all quantities are SI floats."""

    order: ClassVar[str] = (
        "name extensions method material materials interaction sample push sphere charge gravity "
        "forces boundary surfaces stop stages numerics output replicas collisions"
    )

    method: Literal["grains"] = Field("grains", description="method of simulation")
    material: Material = Field(
        description="material of the grains and the walls: a name, a block with `base` "
        "and the numbers that differ, or a block with all six numbers"
    )
    materials: dict[str, Material] = Field(
        {},
        description="further materials that a sample may give to some of its grains, by name, "
        "each written like `material`",
    )
    interaction: Interaction = Field(
        default_factory=Interaction, description="interaction of the grains"
    )
    sample: AnySample = Field(description="initial positions of the grains")
    push: tuple[Push, ...] = Field(
        (), description="pushes on grains or on faces of the sample, from the start of the run"
    )
    sphere: Sphere | None = Field(
        None, description="a rigid sphere among the grains: a projectile or an indenter"
    )
    charge: Charge | None = Field(
        None, description="charges of the grains: of each, or a block; the sphere has none"
    )
    gravity: Gravity | None = Field(
        None, description="acceleration of grains and sphere, uniform or towards a point"
    )
    forces: tuple[AnyForce, ...] = Field(
        (), description="further forces from outside on grains and sphere: gas, fields, frames"
    )
    surfaces: tuple[AnySurface, ...] = Field(
        (), description="further walls, which may be curved and move: tubes, rods, shells"
    )
    numerics: Numerics = Field(
        default_factory=Numerics, description="time step, precision, threads"
    )
    collisions: Collisions | None = Field(
        None, description="parameters of `dust collide`; not used by `dust run`"
    )

    @property
    def has_walls(self) -> bool:
        """True where grains may touch a wall or a surface."""
        return bool(self.boundary.walls or self.surfaces)

    @property
    def softened(self) -> bool:
        """True where contacts are softer than the material."""
        return self.numerics.stiffness_scaling != 1.0

    def faults(self) -> Faults:
        return [*super().faults(), *check(self), *collision_parameters.check(self)]
