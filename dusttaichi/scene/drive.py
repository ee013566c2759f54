"""How walls and faces move: at speeds that are given, or as a pressure or stress asks for."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, model_validator

from dusttaichi.scene.fields import Block, Number, problems
from dusttaichi.scene.push import Push
from dusttaichi.scene.quantities import Quantity, Vector

Speed, Rate = Annotated[float, Quantity("speed")], Annotated[float, Quantity("rate")]
Pressed = Annotated[float, Quantity("pressure", gt=0, example="5 kPa")]
Gain = Annotated[float, Number(gt=0, le=0.5)]
CompressionRate = Annotated[float, Number(gt=0)]
Rates = Annotated[Vector, Quantity("rate", count=3, spread=True)]
Speeds = Annotated[Vector, Quantity("speed", count=3, spread=True)]
Stresses = Annotated[
    tuple, Quantity("pressure", count=3, spread=True, word="free", mixed=True, example="-5 kPa")
]
GAIN = 0.15
"""Of the servo, where none is given: share of a missing load that its next change makes up for."""
WALL_SPEED, STRAIN_RATE = 0.05, 1000.0
"""Largest speed [m/s] and rate [1/s] of the servo, where none is given."""


@dataclass(frozen=True)
class Moves:
    """Marks a key of a Drive: what it moves, or belongs to, and how.

    how: "speed", "load" (which moves it as needed), "shear" (along itself), "gain" (of a load).
    what: "top" wall, "faces" of periodic axes, whole "cell" that is periodic along all axes.
    """

    how: str
    what: tuple[str, ...]


# of every boundary with a top
TOP_SPEED = Field(
    "0 m/s",
    description="speed of the top wall, plate or face downwards, where there is one; negative, "
    "where that is allowed, pulls it up",
)


class Drive(Block):
    """How walls and faces move; what is not given rests. Each boundary knows some of these."""

    wall_speed: Annotated[Speed | None, Moves("speed", ("top",))] = Field(
        None,
        description="speed of the top wall downwards; negative pulls it up; with pressure the "
        "largest one, 5 cm/s if not given",
    )
    compression_rate: Annotated[CompressionRate | None, Moves("speed", ("faces",))] = Field(
        None,
        description="C_v of Kataoka et al. 2013: every periodic edge shrinks as exp(-2 C_v t/t_c)",
    )
    strain_rate: Annotated[Rates | None, Moves("speed", ("faces",))] = Field(
        None,
        description="every periodic edge grows as exp(rate t): one rate, or one for each axis; "
        "along an axis whose stress is held the largest one; 1e3 s^-1 or twice the shear_rate, "
        "whichever is more, if not given",
    )
    face_speed: Annotated[Speeds | None, Moves("speed", ("faces",))] = Field(
        None,
        description="outward speed v_b of both faces of a periodic axis (T19): L = L_0 + 2 v_b t; "
        "one speed, or one for each axis",
    )
    pressure: Annotated[Pressed | None, Moves("load", ("top", "cell"))] = Field(
        None,
        description="pressure that is held: on the top wall, which moves as it takes, or of a cell "
        "that is periodic along all axes, whose edges shrink or grow alike",
    )
    stress: Annotated[Stresses | None, Moves("load", ("cell",))] = Field(
        None,
        description="normal stress that is held along each periodic axis, negative in compression, "
        "as in the result; `free` along an axis that moves as strain_rate says: "
        "[-5 kPa, -5 kPa, free]",
    )
    gain: Annotated[Gain | None, Moves("gain", ("top", "cell"))] = Field(
        None,
        description="of what holds a pressure or stress: share of a missing load that its next "
        "change of speed makes up for, by the stiffness that it measures; 0.15 if not given",
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
        None, description="velocity of a sphere that is driven, default its own `speed`"
    )
    stiffness_scaling: Annotated[float, Number(ge=1e-4, le=1)] | None = Field(
        None,
        description="of a stage: stiffness of the contacts from its start on, as "
        "numerics.stiffness_scaling, which it is if not given; contacts relax, and the energy of "
        "the change is in the ledger",
    )
    push: tuple[Push, ...] = Field(
        (),
        description="pushes on grains that last as long as the stage, each as in `push` of the "
        "scene; a duration counts from its start",
    )

    @model_validator(mode="after")
    def _one_law(self) -> "Drive":
        found = together(self)
        if found:
            raise problems(found)
        return self

    @property
    def moving_faces(self) -> bool:
        """True where some periodic edge changes, or may."""
        laws = (getattr(self, name) for name in FACE_LAWS)
        return self.stress is not None or any(
            law is not None and bool(any(law) if isinstance(law, tuple) else law) for law in laws
        )

    @property
    def held(self) -> bool:
        """True where a pressure or stress is held: how anything moves is not known beforehand."""
        return self.pressure is not None or self.stress is not None

    @property
    def shears(self) -> bool:
        """True where a wall or the image of a cell moves along itself."""
        return bool(self.shear_speed) or bool(self.shear_rate)

    @property
    def moves(self) -> bool:
        """True where anything moves, or may."""
        return bool(self.wall_speed) or self.moving_faces or self.held or self.shears

    @property
    def held_axes(self) -> tuple[int, ...]:
        """Numbers of the axes along which a stress is held."""
        if self.stress is None:
            return ()
        return tuple(n for n, level in enumerate(self.stress) if level != "free")


# key -> Moves, of those that move walls and faces
MOVES = {
    key: mark
    for key, item in Drive.model_fields.items()
    for mark in item.metadata
    if isinstance(mark, Moves)
}
SPEEDS, LOADS, SHEARS = (
    tuple(key for key, moves in MOVES.items() if moves.how == how)
    for how in ("speed", "load", "shear")
)
FACE_LAWS = tuple(key for key in SPEEDS if "faces" in MOVES[key].what)


def together(block: Block) -> list[tuple[str, str]]:
    """Conflicts between the keys of a drive, as (key, text); block: a Drive, or a boundary."""
    given = [n for n in Drive.model_fields if getattr(block, n, None) is not None]
    laws, found = [n for n in FACE_LAWS if n in given], []
    if len(laws) > 1:
        found.append((laws[1], f"it is not allowed together with {laws[0]}"))
    if "stress" in given:
        found += _stress(block, given)
    pressed = "pressure" in given
    if pressed and (block.wall_speed or 0.0) < 0.0:
        found.append(("wall_speed", "with pressure it is the largest speed; a positive one"))
    if "gain" in given and not pressed and "stress" not in given:
        found.append(("gain", "it belongs to pressure or stress, and neither is held"))
    for other in ("compression_rate", "face_speed"):
        if "shear_rate" in given and other in given:
            text = f"it is not allowed together with {other}; use strain_rate or stress"
            found.append(("shear_rate", text))
    return found


def _stress(block, given):
    levels = block.stress
    held = [n for n in range(3) if levels[n] != "free"]
    found = [
        (other, "it is not allowed together with stress")
        for other in ("pressure", "compression_rate", "face_speed")
        if other in given
    ]
    if not any(levels[n] for n in held):
        text = "at least one axis with a stress other than 0 is needed: it sets the scale"
        found.append(("stress", text))
    rates = getattr(block, "strain_rate", None)
    if rates is not None and any(rates[n] == 0.0 for n in held):
        text = "along an axis whose stress is held it is the largest rate; another one than 0"
        found.append(("strain_rate", text))
    return found
