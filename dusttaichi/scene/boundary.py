"""Boundaries of the grains, and their motion."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from dusttaichi.physics.geometry import AXES, WALLS, AxisName, WallName
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
    find_conflicts,
)
from dusttaichi.scene.fields import AnyScene, Block, Faults, Field, Number, in_order_of
from dusttaichi.scene.quantities import Quantity, Vector

Axes = Annotated[tuple[AxisName, ...], in_order_of(AXES)]
Walls = Annotated[tuple[WallName, ...], in_order_of(WALLS)]


def _share_key(name: str) -> Any:
    """The Field of a key of the drive, which some boundaries have too."""
    return Drive.model_fields[name]


class BoundaryBlock(Block):
    """Block of a kind of boundary; its `walls` are the names of its walls."""

    if TYPE_CHECKING:
        kind: str

        @property
        def walls(self) -> tuple[str, ...]:
            """Names of its walls; in some kinds a key of the YAML."""

    @property
    def periodic_axes(self) -> tuple[str, ...]:
        """Periodic axes of the sample."""
        return ()

    @property
    def drives(self) -> tuple[str, ...]:
        """Keys of a Drive that move walls or faces of this boundary."""
        has_target = {
            "top": "top" in self.walls,
            "faces": bool(self.periodic_axes),
            "cell": self.periodic_axes == AXES,
        }
        keys = (key for key in MOVES if key in type(self).model_fields)
        return tuple(
            key for key in keys if any(has_target[target] for target in MOVES[key].targets)
        )


class OpenBoundary(BoundaryBlock):
    """No walls."""

    kind: Literal["open"]

    @property
    def walls(self) -> tuple[str, ...]:
        return ()


Ends = Annotated[tuple[float, float], Quantity("length", count=2, example="0 um")]


class Planes(Block):
    """Positions of the two walls across an axis, in the coordinates of the sample."""

    x: Ends | None = Field(None, description="x_min and x_max, for example [0 um, 40 um]")
    y: Ends | None = Field(None, description="y_min and y_max")
    z: Ends | None = Field(None, description="bottom and top")

    def faults(self) -> Faults:
        for axis in AXES:
            if (ends := getattr(self, axis)) is not None and not ends[0] < ends[1]:
                yield axis, "the first must lie below the second, for example [0 um, 40 um]"


class BoxBoundary(BoundaryBlock):
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
        description="positions of walls, in place of a size along these axes: {z: [0 um, 40 um]}",
    )
    omit: Walls = Field((), description="walls that are left out")
    wall_speed: Annotated[float, Quantity("speed", ge=0)] = TOP_SPEED
    side_walls: Annotated[float, Number(ge=0)] = Field(
        1e-3, description="factor on rolling, sliding and twisting at the four side walls"
    )
    pressure: Pressed | None = _share_key("pressure")
    gain: Gain | None = _share_key("gain")
    shear_speed: Speed | None = _share_key("shear_speed")

    def faults(self) -> Faults:
        if self.omit == WALLS:
            yield "omit", "at least one wall must remain; without walls write kind: open"
        yield from find_conflicts(self)
        sizes = ("fit", "fit", "fit") if self.size == "fit" else self.size
        for axis, size in zip(AXES, sizes, strict=True):
            if self.at is not None and getattr(self.at, axis) is not None and size != "fit":
                yield f"at.{axis}", f"size gives a length along {axis}; write fit there"

    @property
    def walls(self) -> tuple[str, ...]:
        return tuple(wall for wall in WALLS if wall not in self.omit)


class PlatesBoundary(BoundaryBlock):
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
    shear_speed: Speed | None = _share_key("shear_speed")

    @property
    def walls(self) -> tuple[str, ...]:
        return ("bottom", "top")


class TubeBoundary(BoundaryBlock):
    """An upright tube with a bottom and a top, in which dust is pressed; the top may move."""

    kind: Literal["tube"]
    radius: Annotated[float | Literal["fit"], Quantity("length", gt=0, word="fit")] = Field(
        "fit", description="inner radius of the tube, or fit: as wide as the sample"
    )
    axis: Annotated[tuple[float, float], Quantity("length", count=2, example="0 um")] | None = (
        Field(None, description="x and y of its axis; default: the middle of the sample")
    )
    gap: Annotated[float | Literal["fit"], Quantity("length", gt=0, word="fit")] = Field(
        "fit", description="height between bottom and top, or fit: as high as the sample"
    )
    wall_speed: Annotated[float, Quantity("speed", ge=0)] = TOP_SPEED
    side_walls: Annotated[float, Number(ge=0)] = Field(
        1.0, description="factor on rolling, sliding and twisting at the tube"
    )
    closing_speed: Speed = Field(
        "0 m/s", description="speed at which the wall of the tube moves inwards"
    )
    axial_speed: Speed = Field("0 m/s", description="speed of the wall of the tube along z")
    rotation: Annotated[float, Quantity("angular velocity")] = Field(
        "0 rad/s", description="angular velocity of the wall of the tube about its axis"
    )
    pressure: Pressed | None = _share_key("pressure")
    gain: Gain | None = _share_key("gain")

    def faults(self) -> Faults:
        yield from find_conflicts(self)

    @property
    def walls(self) -> tuple[str, ...]:
        return ("bottom", "top")

    @property
    def tube_moves(self) -> bool:
        """True where the wall of the tube moves or turns."""
        return any((self.closing_speed, self.axial_speed, self.rotation))

    @property
    def tube_speed(self) -> float:
        """Largest speed of the wall of the tube without its rotation [m/s]."""
        return float(max(abs(self.closing_speed), abs(self.axial_speed)))


class PeriodicBoundary(BoundaryBlock):
    """A cell that is periodic along some axes; the others are open, or have walls."""

    kind: Literal["periodic"]
    axes: Axes = Field(AXES, description="periodic axes of the cell")
    size: Annotated[
        Vector | Literal["fit", "cube"],
        Quantity("length", gt=0, count=3, word=("fit", "cube"), mixed=True, example="40 um"),
    ] = Field(
        "fit",
        description="edges [Lx, Ly, Lz]; fit: the sample's, its outermost grains in contact "
        "across the faces, also of some of the three; cube: a cube of the largest of these",
    )
    walls: Walls = Field((), description="walls on axes that are not periodic")
    wall_speed: Speed = TOP_SPEED
    compression_rate: CompressionRate | None = _share_key("compression_rate")
    strain_rate: Rates | None = _share_key("strain_rate")
    face_speed: Speeds | None = _share_key("face_speed")
    pressure: Pressed | None = _share_key("pressure")
    stress: Stresses | None = _share_key("stress")
    gain: Gain | None = _share_key("gain")
    shear_speed: Speed | None = _share_key("shear_speed")
    shear_rate: Rate | None = _share_key("shear_rate")

    def faults(self) -> Faults:
        if not self.axes:
            yield "axes", "at least one axis is needed; without any write kind: open or box"
        for wall in self.walls:
            if (axis := AXES[WALLS.index(wall) // 2]) in self.axes:
                yield "walls", f"{wall} is on the axis {axis}, which is periodic"
        yield from find_conflicts(self)

    @property
    def periodic_axes(self) -> tuple[str, ...]:
        return self.axes


def get_drive(boundary: BoundaryBlock) -> Drive:
    """The Drive with the keys of a boundary, for a scene without stages."""
    values = {name: getattr(boundary, name, None) for name in Drive.model_fields}
    return Drive.model_construct(**values | {"push": (), "surfaces": {}})


def bounded_axes(boundary: BoundaryBlock) -> tuple[str, ...]:
    """Axes along which the box is finite: periodic, or with both walls or a tube."""
    if boundary.kind == "tube":
        return AXES
    return tuple(
        axis
        for n, axis in enumerate(AXES)
        if axis in boundary.periodic_axes or set(WALLS[2 * n : 2 * n + 2]) <= set(boundary.walls)
    )


def moves_faces(scene: AnyScene) -> bool:
    """True where a stage of a scene moves the faces of a cell, or may."""
    if not isinstance(scene.boundary, PeriodicBoundary):
        return False
    drives = [plan.drive for plan in scene.stage_plans]
    top = "top" in scene.boundary.walls
    return any(d.moving_faces or d.shear_rate or (d.controls_load and not top) for d in drives)


def has_strain(boundary: BoundaryBlock, drive: Drive) -> bool:
    """True where the height, an edge or a shear changes at a prescribed rate.

    Parameters
    ----------
    boundary
    drive
    """
    if drive.shears:
        return True
    height = {"bottom", "top"} <= set(boundary.walls) and bool(drive.wall_speed)
    if drive.controls_load:
        rates = drive.strain_rate or (0.0,) * 3
        return bool(drive.controlled_axes) and any(
            rate for n, rate in enumerate(rates) if n not in drive.controlled_axes
        )
    return height or drive.moving_faces


def filling_direction(boundary: BoundaryBlock, drive: Drive) -> int:
    """Sign of the change of the filling factor of a bounded box.

    Parameters
    ----------
    boundary
    drive

    Returns
    -------
    int
        1 where it only grows, -1 where it only falls, else 0.
    """
    if bounded_axes(boundary) != AXES or drive.controls_load:
        return 0
    rates = [drive.wall_speed or 0.0] if "top" in boundary.walls else []
    if drive.compression_rate is not None:
        rates.append(1.0)
    for law in (drive.strain_rate, drive.face_speed):
        if law is not None:
            pairs = zip(AXES, law, strict=True)
            rates += [-rate for axis, rate in pairs if axis in boundary.periodic_axes]
    signs = {rate > 0.0 for rate in rates if rate}
    if len(signs) != 1:
        return 0
    return 1 if signs == {True} else -1


Boundary = Annotated[
    OpenBoundary | BoxBoundary | PlatesBoundary | TubeBoundary | PeriodicBoundary,
    Field(discriminator="kind"),
]
