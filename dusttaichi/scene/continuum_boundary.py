"""Boundaries of the continuum: none, or a box with something at each face."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from dusttaichi.names import AXES, WALLS
from dusttaichi.scene.boundary import AxisName, OpenBoundary, Surroundings
from dusttaichi.scene.drive import TOP_SPEED, Speed
from dusttaichi.scene.fields import Block, problems
from dusttaichi.scene.quantities import Quantity


class LayerFace(Block):
    """Dust that is held where it is (G09 section 4.1): a rough plane, which dust never leaves."""

    layer: Annotated[float, Quantity("length", gt=0, example="0.15 mm")] = Field(
        description="thickness of the dust that is held"
    )


def _form(value: Any) -> str:
    return "layer" if isinstance(value, (dict, LayerFace)) else "word"


Face = Annotated[
    Annotated[Literal["open", "mirror", "rigid"], Tag("word")] | Annotated[LayerFace, Tag("layer")],
    Discriminator(_form),
]


class FacesBoundary(Surroundings):
    """A box around the sample, as large as it is; each face is open, or has something."""

    kind: Literal["faces"]
    x_min: Face = Field(
        "open",
        description="what is at this face: open, mirror (a smooth plane), rigid (a rough rigid "
        "plane), or {layer: thickness} of dust that is held",
    )
    x_max: Face = Field("open", description="as x_min")
    y_min: Face = Field("open", description="as x_min; in three dimensions")
    y_max: Face = Field("open", description="as x_min; in three dimensions")
    bottom: Face = Field("open", description="as x_min")
    top: Face = Field("open", description="as x_min")
    periodic: tuple[AxisName, ...] = Field((), description="axes along which the sample repeats")
    gap: Annotated[float, Quantity("length", ge=0, example="0.1 mm")] = Field(
        "0 m", description="between the sample and each of mirror and rigid"
    )
    wall_speed: Speed = TOP_SPEED

    WITHOUT_LOADS: ClassVar[str] = (
        "it is for grains; the faces of a continuum move at a wall_speed, or rest"
    )

    @model_validator(mode="before")
    @classmethod
    def _endless(cls, data: Any) -> Any:
        if isinstance(data, dict) and "overhang" in data:
            raise problems([("overhang", "rigid faces are planes without an edge; leave it out")])
        return data

    @field_validator("periodic", mode="after")
    @classmethod
    def _order(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(axis for axis in AXES if axis in value)

    @model_validator(mode="after")
    def _check(self) -> FacesBoundary:
        found = [
            (wall, f"it stands on the axis {AXES[number // 2]}, which repeats")
            for number, wall in enumerate(WALLS)
            if self.face(wall) != "open" and AXES[number // 2] in self.periodic
        ]
        if self.wall_speed and self.top == "open":
            found.append(("wall_speed", "there is nothing at the top that could move"))
        if not self.walls and not self.periodic:
            found.append(("", "all faces are open; at least one is needed, or kind: open"))
        if self.gap and not (set(self.mirrors) | set(self.rigid)):
            found.append(("gap", "it is for mirror and rigid faces only"))
        if found:
            raise problems(found)
        return self

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
        """Face -> thickness [m] of the dust that is held there."""
        faces = {wall: self.face(wall) for wall in WALLS}
        return {wall: f.layer for wall, f in faces.items() if isinstance(f, LayerFace)}

    @property
    def periodic_axes(self) -> tuple[str, ...]:
        return self.periodic

    def conflicts(self, dimension: int) -> list[tuple[str, str]]:
        """Conflicts with the number of dimensions, as (dotted path below this, text)."""
        if dimension == 3:
            return []
        found = [
            (wall, "the plane is x-z with dimension: 2, there is no such face")
            for wall in ("y_min", "y_max")
            if self.face(wall) != "open"
        ]
        if "y" in self.periodic:
            found.append(("periodic", "the plane is x-z with dimension: 2; y cannot repeat"))
        return found


ContinuumBoundary = Annotated[OpenBoundary | FacesBoundary, Field(discriminator="kind")]
