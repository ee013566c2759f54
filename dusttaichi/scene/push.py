"""Pushes on some grains from the start of the run: on a face of the sample, or on single grains."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from dusttaichi.names import WALLS
from dusttaichi.scene.fields import Block, Number, needed, problems
from dusttaichi.scene.quantities import Quantity, Vector

WallName = Literal[WALLS]
Grain = Annotated[int, Number(whole=True, ge=0)]
Plain = Annotated[float, Number()]


def _form(value: Any) -> str:
    """Which of the two a value of `grains` is."""
    return "word" if value == "all" else "list"


def _grains(value: Any) -> Any:
    if value == "all" or isinstance(value, (list, tuple)):
        return value
    raise needed("a list of numbers such as [0, 1], or all, is needed")


Grains = Annotated[
    Annotated[tuple[Grain, ...], Tag("list")] | Annotated[Literal["all"], Tag("word")],
    Discriminator(_form),
    BeforeValidator(_grains),
]
OF_A_STAGE = ("velocity", "spin", "force", "speed")
KINDS = ("displacement", "displacement_delta0", "velocity", "spin", "force", "speed")


class Push(Block):
    """One of displacement, displacement_delta0, velocity, spin, force and speed, on grains or a
    face."""

    grains: Grains | None = Field(
        None, description="numbers of the grains, from 0, or all; either this or face"
    )
    face: WallName | None = Field(None, description="face of the sample; either this or grains")
    depth: Annotated[float, Quantity("length", ge=0)] | None = Field(
        None,
        description="with face: how far behind its outermost centre the centres of grains may lie; "
        "default one radius",
    )
    displacement: Annotated[Vector, Quantity("length", count=3, example="0.1 nm")] | None = Field(
        None, description="displacement of every grain before the start"
    )
    displacement_delta0: tuple[Plain, Plain, Plain] | None = Field(
        None, description="the same in units of the overlap delta0 of two grains at rest"
    )
    velocity: Annotated[Vector, Quantity("speed", count=3)] | None = Field(
        None, description="velocity added to every grain at the start"
    )
    spin: Annotated[Vector, Quantity("angular velocity", count=3)] | None = Field(
        None,
        description="angular velocity added at the start, as to a rigid body: about the centre of "
        "mass of the grains, which get it as spins too",
    )
    force: Annotated[Vector, Quantity("force", count=3)] | None = Field(
        None, description="force on all of the grains together, shared equally"
    )
    duration: Annotated[float, Quantity("time", gt=0)] | None = Field(
        None, description="how long the force acts; default to the end of the run"
    )
    speed: Annotated[Vector, Quantity("speed", count=3)] | None = Field(
        None, description="velocity at which the grains are carried, without turning"
    )

    @model_validator(mode="after")
    def _check(self) -> "Push":
        found = []
        if (self.grains is None) == (self.face is None):
            found.append(("", "exactly one of grains and face is needed"))
        if self.grains is not None and not self.grains:
            found.append(("grains", "at least one grain is needed"))
        if self.depth is not None and self.face is None:
            found.append(("depth", "it belongs to a face"))
        if self.kind is None:
            found.append(("", f"exactly one of {', '.join(KINDS)} is needed"))
        if self.duration is not None and self.force is None:
            found.append(("duration", "it belongs to a force"))
        if found:
            raise problems(found)
        return self

    @property
    def kind(self) -> str | None:
        """Which of KINDS it is; None where it is none of them, or several."""
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        return given[0] if len(given) == 1 else None


def check(scene) -> list[tuple[str, str]]:
    """Problems of the pushes of a scene with its other blocks, as (dotted path, text)."""
    found, given = [], [(f"push.{n}", push) for n, push in enumerate(scene.push)]
    for number, stage in enumerate(scene.stages):
        where = f"stages.{number}.drive.push"
        own = [(f"{where}.{n}", push) for n, push in enumerate(stage.drive.push)]
        if own and number == 0:
            found.append((where, "the run begins with this stage; write it as the scene's push"))
        text = f"it is for the start of the run; allowed in a stage: {', '.join(OF_A_STAGE)}"
        found += [
            (f"{path}.{push.kind}", text) for path, push in own if push.kind not in OF_A_STAGE
        ]
        given += own
    if scene.boundary.kind != "periodic":
        return found
    text = "it needs open space, a box or plates; in a periodic cell use displacement or velocity"
    return found + [
        (f"{path}.{push.kind}", text)
        for path, push in given
        if push.kind in ("spin", "force", "speed")
    ]


def of_stages(scene) -> tuple[Push, ...]:
    """All pushes that stages bring."""
    return tuple(push for stage in scene.stages for push in stage.drive.push)
