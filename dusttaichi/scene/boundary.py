"""What surrounds the grains."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from dusttaichi.scene.fields import Block, Number, needed
from dusttaichi.units import Quantity, Vector

WALLS = ("x_min", "x_max", "y_min", "y_max", "bottom", "top")
WallName = Literal["x_min", "x_max", "y_min", "y_max", "bottom", "top"]


class OpenBoundary(Block):
    """Nothing around the grains."""

    kind: Literal["open"]


class BoxBoundary(Block):
    """A box of flat walls that stick like grains (S12 section 2.2); the top wall may move down."""

    kind: Literal["box"]
    size: Annotated[
        Vector | Literal["fit"], Quantity("length", gt=0, count=3, word="fit", example="40 um")
    ] = Field("fit", description="inner size [Lx, Ly, Lz], or fit: as large as the sample")
    omit: tuple[WallName, ...] = Field((), description="walls that are left out")
    wall_speed: Annotated[float, Quantity("speed", ge=0)] = Field(
        "0 m/s", description="speed of the top wall downwards"
    )
    side_walls: Annotated[float, Number(ge=0)] = Field(
        1e-3, description="factor on rolling, sliding and twisting at the four side walls"
    )

    @field_validator("omit", mode="after")
    @classmethod
    def _order(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if set(value) == set(WALLS):
            raise needed("at least one wall must remain; without walls write kind: open")
        return tuple(wall for wall in WALLS if wall in value)

    @property
    def closed(self) -> bool:
        """All six walls are there."""
        return not self.omit


def compresses(boundary: Block) -> bool:
    """A box with all six walls whose top wall moves: its filling factor grows."""
    return isinstance(boundary, BoxBoundary) and boundary.closed and boundary.wall_speed > 0


# One entry a kind: a new kind of boundary is a new class here.
Boundary = Annotated[OpenBoundary | BoxBoundary, Field(discriminator="kind")]
