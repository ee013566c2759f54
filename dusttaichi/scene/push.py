"""External pushes on a face of the sample or on single grains, from the start of a run or stage."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Tag

from dusttaichi.physics.geometry import WallName
from dusttaichi.scene.fields import AnyScene, Block, Faults, Field, Number, build_value_error
from dusttaichi.scene.quantities import Quantity, Vector

Grain = Annotated[int, Number(whole=True, ge=0)]
Plain = Annotated[float, Number()]


def _grains(value: Any) -> Any:
    if value == "all" or isinstance(value, (list, tuple)):
        return value
    raise build_value_error("a list of numbers such as [0, 1], or all, is needed")


Grains = Annotated[
    Annotated[tuple[Grain, ...], Tag("list")] | Annotated[Literal["all"], Tag("word")],
    Discriminator(lambda value: "word" if value == "all" else "list"),
    BeforeValidator(_grains),
]
STAGE_KINDS = ("velocity", "spin", "force", "speed")
KINDS = ("displacement", "displacement_delta0", "velocity", "spin", "force", "speed")


class Push(Block):
    """A push of grains or of a face.

    Exactly one of displacement, displacement_delta0, velocity, spin, force and speed is given.
    """

    grains: Grains | None = Field(
        None, description="numbers of the grains, from 0, or all; either this or face"
    )
    face: WallName | None = Field(None, description="face of the sample; either this or grains")
    depth: Annotated[float, Quantity("length", ge=0)] | None = Field(
        None,
        description="with face: thickness of the layer of centres of grains, from the outermost "
        "inwards; default one radius",
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
        description="angular velocity added at the start, as of a rigid body about the centre of "
        "mass of the grains, and to their spins",
    )
    force: Annotated[Vector, Quantity("force", count=3)] | None = Field(
        None, description="force on all of the grains together, shared equally"
    )
    duration: Annotated[float, Quantity("time", gt=0)] | None = Field(
        None, description="duration of the force, by default up to the end of the run"
    )
    speed: Annotated[Vector, Quantity("speed", count=3)] | None = Field(
        None, description="prescribed velocity of the grains, which do not rotate"
    )

    def faults(self) -> Faults:
        if (self.grains is None) == (self.face is None):
            yield "", "exactly one of grains and face is needed"
        if self.grains is not None and not self.grains:
            yield "grains", "at least one grain is needed"
        if self.depth is not None and self.face is None:
            yield "depth", "it belongs to a face"
        if self.kind is None:
            yield "", f"exactly one of {', '.join(KINDS)} is needed"
        if self.duration is not None and self.force is None:
            yield "duration", "it belongs to a force"

    @property
    def kind(self) -> str | None:
        """The one of KINDS that is given; None where none or several are."""
        present_kinds = [kind for kind in KINDS if getattr(self, kind) is not None]
        return present_kinds[0] if len(present_kinds) == 1 else None


def check(scene: AnyScene) -> Faults:
    """Faults of the pushes of a scene with its other blocks."""
    pushes = [(f"push.{n}", push) for n, push in enumerate(scene.push)]
    for number, stage in enumerate(scene.stages):
        key_path = f"stages.{number}.drive.push"
        stage_pushes = [(f"{key_path}.{n}", push) for n, push in enumerate(stage.drive.push)]
        if stage_pushes and number == 0:
            yield key_path, "the run begins with this stage; write it as the scene's push"
        for path, push in stage_pushes:
            if push.kind not in STAGE_KINDS:
                allowed = ", ".join(STAGE_KINDS)
                text = f"it is for the start of the run; allowed in a stage: {allowed}"
                yield f"{path}.{push.kind}", text
        pushes += stage_pushes
    if scene.boundary.kind == "periodic":
        text = (
            "it needs open space, a box or plates; in a periodic cell use displacement or velocity"
        )
        for path, push in pushes:
            if push.kind in ("spin", "force", "speed"):
                yield f"{path}.{push.kind}", text


def list_stage_pushes(scene: AnyScene) -> tuple[Push, ...]:
    """All pushes of stages."""
    return tuple(push for stage in scene.stages for push in stage.drive.push)
