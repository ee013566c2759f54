"""Motion of walls and faces: at prescribed speeds, or under a controlled pressure or stress."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from dusttaichi.scene.fields import Block, Faults, Field, Number
from dusttaichi.scene.push import Push
from dusttaichi.scene.quantities import Quantity, Vector
from dusttaichi.scene.surface_drive import SurfaceDrive

Speed = Annotated[float, Quantity("speed")]
Rate = Annotated[float, Quantity("rate")]
Pressed = Annotated[float, Quantity("pressure", gt=0, example="5 kPa")]
Gain = Annotated[float, Number(gt=0, le=0.5)]
CompressionRate = Annotated[float, Number(gt=0)]
Rates = Annotated[Vector, Quantity("rate", count=3, spread=True)]
Speeds = Annotated[Vector, Quantity("speed", count=3, spread=True)]
Level = float | Literal["free"]
Stresses = Annotated[
    tuple[Level, Level, Level],
    Quantity("pressure", count=3, spread=True, word="free", mixed=True, example="-5 kPa"),
]
WALL_SPEED, STRAIN_RATE = 0.05, 1000.0
"""Default limits of the speed [m/s] and of the rate [1/s] of the servo."""


@dataclass(frozen=True)
class Moves:
    """Marks a key of a Drive.

    motion: "speed", "load" (controlled), "shear" (motion along itself) or "gain" (of a load).
    targets: what it moves: "top" wall, "faces" of periodic axes, "cell" periodic along all axes.
    """

    motion: str
    targets: tuple[str, ...]


# for every boundary with a top
TOP_SPEED = Field(
    "0 m/s",
    description="speed of the top wall, plate or face downwards, where there is one; negative, "
    "where that is allowed, pulls it up",
)


class Drive(Block):
    """Motion of walls and faces, which are otherwise at rest; each boundary allows some of it."""

    wall_speed: Annotated[Speed | None, Moves("speed", ("top",))] = Field(
        None,
        description="speed of the top wall downwards; negative pulls it up; with pressure the "
        "largest one, if not given 5 cm/s, or the speed of the stage before if that is more",
    )
    compression_rate: Annotated[CompressionRate | None, Moves("speed", ("faces",))] = Field(
        None,
        description="C_v of Kataoka et al. 2013: every periodic edge shrinks as exp(-2 C_v t/t_c)",
    )
    strain_rate: Annotated[Rates | None, Moves("speed", ("faces",))] = Field(
        None,
        description="every periodic edge grows as exp(rate t): one rate, or one for each axis; "
        "along an axis with a controlled stress the largest one; if not given, 1e3 s^-1, twice the "
        "shear_rate or the rate of the stage before, whichever is most",
    )
    face_speed: Annotated[Speeds | None, Moves("speed", ("faces",))] = Field(
        None,
        description="outward speed v_b of both faces of a periodic axis (T19): L = L_0 + 2 v_b t; "
        "one speed, or one for each axis",
    )
    pressure: Annotated[Pressed | None, Moves("load", ("top", "cell"))] = Field(
        None,
        description="controlled pressure: on the top wall, which moves as needed, or of a cell "
        "that is periodic along all axes, whose edges shrink or grow by the same factor",
    )
    stress: Annotated[Stresses | None, Moves("load", ("cell",))] = Field(
        None,
        description="controlled normal stress along each periodic axis, negative in compression, "
        "as in the result; `free` along an axis that moves at the strain_rate: "
        "[-5 kPa, -5 kPa, free]",
    )
    gain: Annotated[Gain | None, Moves("gain", ("top", "cell"))] = Field(
        None,
        description="gain of the load control: share of the error of the load that its next "
        "change of speed corrects, by the stiffness that it measures; if not given 0.15, at first "
        "0.4 where the stage before moves the same walls or faces",
    )
    shear_speed: Annotated[Speed | None, Moves("shear", ("top",))] = Field(
        None, description="speed of the top wall along x"
    )
    shear_rate: Annotated[Rate | None, Moves("shear", ("cell",))] = Field(
        None,
        description="rate at which a cell that is periodic along all axes is sheared: its upper "
        "image moves along x by this times the height of the cell",
    )

    sphere_speed: Annotated[Vector, Quantity("speed", count=3)] | None = Field(
        None, description="velocity of a driven sphere, default its own `speed`"
    )
    surfaces: dict[str, SurfaceDrive] = Field(
        {},
        description="motion of surfaces by their names, each at a velocity or under a load, for "
        "example {piston: {pressure: 10 kPa}}; others move as their own blocks say",
    )
    push: tuple[Push, ...] = Field(
        (),
        description="pushes on grains that last as long as the stage, each as in `push` of the "
        "scene; a duration counts from its start",
    )

    def faults(self) -> Faults:
        return find_conflicts(self)

    @property
    def moving_faces(self) -> bool:
        """True where some periodic edge changes, or may."""
        laws = (getattr(self, name) for name in FACE_LAWS)
        return self.stress is not None or any(
            law is not None and bool(any(law) if isinstance(law, tuple) else law) for law in laws
        )

    @property
    def controls_load(self) -> bool:
        """True where a pressure or stress is controlled: the motion is not known beforehand."""
        return self.pressure is not None or self.stress is not None

    @property
    def largest_wall_speed(self) -> float:
        """Largest speed of the top wall under a controlled load [m/s]."""
        return self.wall_speed or WALL_SPEED

    @property
    def largest_rates(self) -> tuple[float, ...]:
        """Largest rates of the edges under a controlled load [1/s], (3,)."""
        least = max(STRAIN_RATE, 2.0 * abs(self.shear_rate or 0.0))
        return self.strain_rate or (least,) * 3

    @property
    def shears(self) -> bool:
        """True where a wall or the image of a cell moves along itself."""
        return bool(self.shear_speed) or bool(self.shear_rate)

    @property
    def moves(self) -> bool:
        """True where anything moves, or may."""
        return bool(self.wall_speed) or self.moving_faces or self.controls_load or self.shears

    @property
    def controlled_axes(self) -> tuple[int, ...]:
        """Numbers of the axes along which a stress is controlled."""
        if self.stress is None:
            return ()
        return tuple(n for n, level in enumerate(self.stress) if level != "free")


# key -> Moves, for the keys that move walls and faces
MOVES = {
    key: mark
    for key, item in Drive.model_fields.items()
    for mark in item.metadata
    if isinstance(mark, Moves)
}
SPEEDS, LOADS, SHEARS = (
    tuple(key for key, moves in MOVES.items() if moves.motion == motion)
    for motion in ("speed", "load", "shear")
)
FACE_LAWS = tuple(key for key in SPEEDS if "faces" in MOVES[key].targets)


def find_conflicts(block: Any) -> Faults:
    """Conflicts between the keys of a drive; block: a Drive, or a boundary with some of these."""
    present_keys = [name for name in Drive.model_fields if getattr(block, name, None) is not None]
    laws = [name for name in FACE_LAWS if name in present_keys]
    if len(laws) > 1:
        yield laws[1], f"it is not allowed together with {laws[0]}"
    if "stress" in present_keys:
        yield from _find_stress_conflicts(block, present_keys)
    pressed = "pressure" in present_keys
    if pressed and (block.wall_speed or 0.0) < 0.0:
        yield "wall_speed", "with pressure it is the largest speed; a positive one"
    if "gain" in present_keys and not pressed and "stress" not in present_keys:
        yield "gain", "it belongs to pressure or stress, and neither is given"
    for conflicting in ("compression_rate", "face_speed"):
        if "shear_rate" in present_keys and conflicting in present_keys:
            text = f"it is not allowed together with {conflicting}; use strain_rate or stress"
            yield "shear_rate", text


def _find_stress_conflicts(block: Any, present_keys: list[str]) -> Faults:
    levels = block.stress
    controlled = [n for n in range(3) if levels[n] != "free"]
    for conflicting in ("pressure", "compression_rate", "face_speed"):
        if conflicting in present_keys:
            yield conflicting, "it is not allowed together with stress"
    if not any(levels[n] for n in controlled):
        text = "at least one axis with a stress other than 0 is needed: it sets the scale"
        yield "stress", text
    rates = getattr(block, "strain_rate", None)
    if rates is not None and any(rates[n] == 0.0 for n in controlled):
        text = "along an axis with a controlled stress it is the largest rate, which must not be 0"
        yield "strain_rate", text
