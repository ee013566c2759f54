"""A scene of the method `continuum`: what the dust is made of, which bodies, and where."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from dusttaichi.samples.continuum import AnyParticles, reads_particles
from dusttaichi.scene.continuum_boundary import ContinuumBoundary, FacesBoundary, OpenBoundary
from dusttaichi.scene.continuum_material import ContinuumMaterial
from dusttaichi.scene.continuum_numerics import ContinuumNumerics
from dusttaichi.scene.quantities import Quantity
from dusttaichi.scene.scene import Scene


@reads_particles
class ContinuumScene(Scene):
    """A run of dust as a continuum (Güttler et al. 2009); all quantities are SI floats."""

    SERIES_STEPS: ClassVar[int] = 5  # which the method divides into eight and more

    order: ClassVar[tuple[str, ...]] = (
        "name",
        "extensions",
        "method",
        "dimension",
        "material",
        "sample",
        "gravity",
        "boundary",
        "stop",
        "stages",
        "numerics",
        "output",
        "replicas",
    )

    method: Literal["continuum"] = Field(description="what computes the run")
    dimension: Literal[2, 3] = Field(
        2, description="2: plane strain in x and z, masses and energies per metre of depth; or 3"
    )
    material: ContinuumMaterial = Field(
        description="what the dust is made of: a name, a block with `base` and the numbers that "
        "differ, or a block with all numbers"
    )
    sample: AnyParticles = Field(description="what bodies there are at the start")
    gravity: Annotated[float, Quantity("acceleration", ge=0, example="9.81 m/s^2")] = Field(
        "0 m/s^2", description="gravity, downwards"
    )
    boundary: ContinuumBoundary = Field(
        OpenBoundary(kind="open"), description="what surrounds the dust"
    )
    numerics: ContinuumNumerics = Field(description="particles, kernel, viscosity, time step")

    def conflicts(self) -> list[tuple[str, str]]:
        blocks = {"sample": self.sample.conflicts(self)}
        if isinstance(self.boundary, FacesBoundary):
            blocks["boundary"] = [*self.boundary.conflicts(self.dimension), *self._mirrors()]
        found = [
            (f"{block}.{key}".rstrip("."), text)
            for block, problems in blocks.items()
            for key, text in problems
        ]
        return [*super().conflicts(), *found]

    def _mirrors(self) -> list[tuple[str, str]]:
        """Images beyond a mirror stay where they are."""
        if "top" not in self.boundary.mirrors:
            return []
        if not any(plan.drive.wall_speed for plan in self.stage_plans):
            return []
        return [("top", "a mirror does not move; allowed with wall_speed: rigid, or a layer")]
