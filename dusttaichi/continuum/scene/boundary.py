"""Boundaries of the continuum: open space, or a box with a condition at each face."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, Tag

from dusttaichi.physics.geometry import AXES, WALLS
from dusttaichi.scene.boundary import Axes, BoundaryBlock, OpenBoundary
from dusttaichi.scene.drive import TOP_SPEED, Speed
from dusttaichi.scene.fields import PLAIN_OR_BLOCK, Block, Faults
from dusttaichi.scene.quantities import Quantity


class LayerFace(Block):
    """Layer of fixed dust (G09 section 4.1): a rough plane, which dust never leaves."""

    layer: Annotated[float, Quantity("length", gt=0, example="0.15 mm")] = Field(
        description="thickness of the fixed dust"
    )


Face = Annotated[
    Annotated[Literal["open", "mirror", "rigid"], Tag("plain")]
    | Annotated[LayerFace, Tag("block")],
    PLAIN_OR_BLOCK,
]


class FacesBoundary(BoundaryBlock):
    """A box around the sample, as large as it is, with a condition at each face."""

    kind: Literal["faces"]
    x_min: Face = Field(
        "open",
        description="boundary condition of this face: open, mirror (a smooth plane), rigid (a "
        "rough rigid plane), or {layer: thickness} of fixed dust",
    )
    x_max: Face = Field("open", description="as x_min")
    y_min: Face = Field("open", description="as x_min; in three dimensions")
    y_max: Face = Field("open", description="as x_min; in three dimensions")
    bottom: Face = Field("open", description="as x_min")
    top: Face = Field("open", description="as x_min")
    periodic: Axes = Field((), description="periodic axes of the sample")
    gap: Annotated[float, Quantity("length", ge=0, example="0.1 mm")] = Field(
        "0 m", description="between the sample and each of mirror and rigid"
    )
    wall_speed: Speed = TOP_SPEED

    refused: ClassVar[dict[str, str]] = {
        "overhang": "rigid faces are planes without an edge; leave it out"
    }
    WITHOUT_LOADS: ClassVar[str] = (
        "it is for grains; the faces of a continuum move at a wall_speed, or are at rest"
    )

    def faults(self) -> Faults:
        for number, wall in enumerate(WALLS):
            if self.face(wall) != "open" and AXES[number // 2] in self.periodic:
                yield wall, f"it is on the axis {AXES[number // 2]}, which is periodic"
        if self.wall_speed and self.top == "open":
            yield "wall_speed", "there is nothing at the top that could move"
        if not self.walls and not self.periodic:
            yield "", "all faces are open; at least one is needed, or kind: open"
        if self.gap and not (set(self.mirrors) | set(self.rigid)):
            yield "gap", "it is for mirror and rigid faces only"

    def face(self, wall: str) -> str | LayerFace:
        """Boundary condition of a face: "open", "mirror", "rigid" or a LayerFace."""
        return getattr(self, wall)

    @property
    def walls(self) -> tuple[str, ...]:
        """Faces that are not open."""
        return tuple(wall for wall in WALLS if self.face(wall) != "open")

    @property
    def mirrors(self) -> tuple[str, ...]:
        """Faces that are mirror planes."""
        return tuple(wall for wall in WALLS if self.face(wall) == "mirror")

    @property
    def rigid(self) -> tuple[str, ...]:
        """Faces with a rigid wall."""
        return tuple(wall for wall in WALLS if self.face(wall) == "rigid")

    @property
    def layers(self) -> dict[str, float]:
        """Face -> thickness [m] of the fixed dust there."""
        faces = {wall: self.face(wall) for wall in WALLS}
        return {wall: f.layer for wall, f in faces.items() if isinstance(f, LayerFace)}

    @property
    def periodic_axes(self) -> tuple[str, ...]:
        return self.periodic

    def conflicts(self, dimension: int) -> Faults:
        """Conflicts with the number of dimensions."""
        if dimension == 3:
            return
        for wall in ("y_min", "y_max"):
            if self.face(wall) != "open":
                yield wall, "the plane is x-z with dimension: 2, there is no such face"
        if "y" in self.periodic:
            yield "periodic", "the plane is x-z with dimension: 2; y cannot be periodic"


ContinuumBoundary = Annotated[OpenBoundary | FacesBoundary, Field(discriminator="kind")]
