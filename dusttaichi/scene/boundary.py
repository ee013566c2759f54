"""Boundaries of the grains, and their motion."""

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from dusttaichi.names import AXES, WALLS
from dusttaichi.scene.drive import (
    MOVES,
    TOP_SPEED,
    CompressionRate,
    Drive,
    Gain,
    Pressed,
    Rate,
    Rates,
    Speed,
    Speeds,
    Stresses,
    together,
)
from dusttaichi.scene.fields import Block, Number, needed, problems
from dusttaichi.scene.push import WallName
from dusttaichi.scene.quantities import Quantity, Vector

AxisName = Literal[AXES]


class Surroundings(Block):
    """Keys of every kind of boundary beside its `walls`, the names of those that are there."""

    @property
    def periodic_axes(self) -> tuple[str, ...]:
        """Axes along which the sample repeats."""
        return ()

    @property
    def drives(self) -> tuple[str, ...]:
        """Keys of a Drive that this boundary has something to move for."""
        there = {
            "top": "top" in self.walls,
            "faces": bool(self.periodic_axes),
            "cell": self.periodic_axes == AXES,
        }
        own = (key for key in MOVES if key in type(self).model_fields)
        return tuple(key for key in own if any(there[what] for what in MOVES[key].what))


class OpenBoundary(Surroundings):
    """Nothing around the grains."""

    kind: Literal["open"]

    @property
    def walls(self) -> tuple[str, ...]:
        return ()


Ends = Annotated[tuple[float, float], Quantity("length", count=2, example="0 um")]


class Planes(Block):
    """Where the two walls across an axis stand, in the coordinates of the sample."""

    x: Ends | None = Field(None, description="x_min and x_max, for example [0 um, 40 um]")
    y: Ends | None = Field(None, description="y_min and y_max")
    z: Ends | None = Field(None, description="bottom and top")

    @model_validator(mode="after")
    def _check(self) -> "Planes":
        found = [
            (axis, "the first must lie below the second, for example [0 um, 40 um]")
            for axis in AXES
            if (ends := getattr(self, axis)) is not None and not ends[0] < ends[1]
        ]
        if found:
            raise problems(found)
        return self


class BoxBoundary(Surroundings):
    """A box of flat walls that stick like grains (S12 section 2.2); the top wall may move."""

    kind: Literal["box"]
    size: Annotated[
        Vector | Literal["fit"],
        Quantity("length", gt=0, count=3, word="fit", mixed=True, example="40 um"),
    ] = Field(
        "fit",
        description="inner size [Lx, Ly, Lz], or fit: as large as the sample, also of some of the "
        "three: [fit, fit, 40 um]",
    )
    at: Planes | None = Field(
        None,
        description="where walls stand, in place of a size along these axes: {z: [0 um, 40 um]}",
    )
    omit: tuple[WallName, ...] = Field((), description="walls that are left out")
    wall_speed: Annotated[float, Quantity("speed", ge=0)] = TOP_SPEED
    side_walls: Annotated[float, Number(ge=0)] = Field(
        1e-3, description="factor on rolling, sliding and twisting at the four side walls"
    )
    pressure: Pressed | None = Drive.model_fields["pressure"]
    gain: Gain | None = Drive.model_fields["gain"]
    shear_speed: Speed | None = Drive.model_fields["shear_speed"]

    @field_validator("omit", mode="after")
    @classmethod
    def _order(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if set(value) == set(WALLS):
            raise needed("at least one wall must remain; without walls write kind: open")
        return tuple(wall for wall in WALLS if wall in value)

    @model_validator(mode="after")
    def _check(self) -> "BoxBoundary":
        found = together(self)
        sizes = ("fit",) * 3 if self.size == "fit" else self.size
        for axis, size in zip(AXES, sizes, strict=True):
            if self.at is not None and getattr(self.at, axis) is not None and size != "fit":
                found.append((f"at.{axis}", f"size gives a length along {axis}; write fit there"))
        if found:
            raise problems(found)
        return self

    @property
    def closed(self) -> bool:
        """All six walls are there."""
        return not self.omit

    @property
    def walls(self) -> tuple[str, ...]:
        return tuple(wall for wall in WALLS if wall not in self.omit)


class PlatesBoundary(Surroundings):
    """Two plates, bottom and top (PD08 section 3.1, S12 section 5.3); grains may leave sideways."""

    kind: Literal["plates"]
    gap: Annotated[float | Literal["fit"], Quantity("length", gt=0, word="fit")] = Field(
        "fit", description="height between the plates, or fit: as high as the sample"
    )
    wall_speed: Speed = TOP_SPEED
    glue: Annotated[float, Number(ge=1)] = Field(
        1.0, description="factor on the normal force between grains and plates"
    )
    inner_radius: Annotated[float | Literal["auto"], Quantity("length", gt=0, word="auto")] = Field(
        "auto",
        description="radius of PD08's inner cylinder, in which a filling factor is measured too; "
        "auto: the sample's less one grain radius",
    )
    shear_speed: Speed | None = Drive.model_fields["shear_speed"]

    @property
    def walls(self) -> tuple[str, ...]:
        return ("bottom", "top")


class PeriodicBoundary(Surroundings):
    """A cell that repeats along some axes; the others are open, or have walls."""

    kind: Literal["periodic"]
    axes: tuple[AxisName, ...] = Field(AXES, description="axes along which the cell repeats")
    size: Annotated[
        Vector | Literal["fit", "cube"],
        Quantity("length", gt=0, count=3, word=("fit", "cube"), mixed=True, example="40 um"),
    ] = Field(
        "fit",
        description="edges [Lx, Ly, Lz]; fit: the sample's, its outermost grains in contact "
        "across the faces, also of some of the three; cube: a cube of the largest of these",
    )
    walls: tuple[WallName, ...] = Field((), description="walls on axes that are not periodic")
    wall_speed: Speed = TOP_SPEED
    compression_rate: CompressionRate | None = Drive.model_fields["compression_rate"]
    strain_rate: Rates | None = Drive.model_fields["strain_rate"]
    face_speed: Speeds | None = Drive.model_fields["face_speed"]
    pressure: Pressed | None = Drive.model_fields["pressure"]
    stress: Stresses | None = Drive.model_fields["stress"]
    gain: Gain | None = Drive.model_fields["gain"]
    shear_speed: Speed | None = Drive.model_fields["shear_speed"]
    shear_rate: Rate | None = Drive.model_fields["shear_rate"]

    @field_validator("axes", mode="after")
    @classmethod
    def _some(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not value:
            raise needed("at least one axis is needed; without any write kind: open or box")
        return tuple(axis for axis in AXES if axis in value)

    @field_validator("walls", mode="after")
    @classmethod
    def _order(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(wall for wall in WALLS if wall in value)

    @model_validator(mode="after")
    def _check(self) -> "PeriodicBoundary":
        found = [
            ("walls", f"{wall} stands on the axis {AXES[WALLS.index(wall) // 2]}, which repeats")
            for wall in self.walls
            if AXES[WALLS.index(wall) // 2] in self.axes
        ]
        found += together(self)
        if found:
            raise problems(found)
        return self

    @property
    def periodic_axes(self) -> tuple[str, ...]:
        return self.axes


def own_drive(boundary: Block) -> Drive:
    """The drive that a boundary gives itself, in a scene without stages."""
    given = {name: getattr(boundary, name, None) for name in Drive.model_fields}
    return Drive.model_construct(**given | {"push": ()})


def bounded_axes(boundary: Block) -> tuple[str, ...]:
    """Axes along which the room for the grains is finite: periodic, or with both walls."""
    return tuple(
        axis
        for n, axis in enumerate(AXES)
        if axis in boundary.periodic_axes or set(WALLS[2 * n : 2 * n + 2]) <= set(boundary.walls)
    )


def strains(boundary: Block, drive: Drive) -> bool:
    """True where some length, the height between bottom and top or an edge, changes in a way that
    is known beforehand, or a shear does."""
    if drive.shears:
        return True
    height = {"bottom", "top"} <= set(boundary.walls) and bool(drive.wall_speed)
    if drive.held:
        rates = drive.strain_rate or (0.0,) * 3
        return bool(drive.held_axes) and any(
            rate for n, rate in enumerate(rates) if n not in drive.held_axes
        )
    return height or drive.moving_faces


def filling_direction(boundary: Block, drive: Drive) -> int:
    """1 where the filling factor of a bounded room only grows, -1 where it only falls, else 0."""
    if bounded_axes(boundary) != AXES or drive.held:
        return 0
    ways = [drive.wall_speed or 0.0] if "top" in boundary.walls else []
    if drive.compression_rate is not None:
        ways.append(1.0)
    for law in (drive.strain_rate, drive.face_speed):
        if law is not None:
            ways += [
                -rate
                for axis, rate in zip(AXES, law, strict=True)
                if axis in boundary.periodic_axes
            ]
    if any(w > 0 for w in ways) and not any(w < 0 for w in ways):
        return 1
    return -1 if any(w < 0 for w in ways) and not any(w > 0 for w in ways) else 0


# One entry a kind: a new kind of boundary is a new class here.
Boundary = Annotated[
    OpenBoundary | BoxBoundary | PlatesBoundary | PeriodicBoundary, Field(discriminator="kind")
]
