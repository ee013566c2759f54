"""Stages: one simulation whose walls and faces move differently in each of them."""

from dataclasses import dataclass
from typing import Annotated, Literal

from dusttaichi.scene.drive import Drive
from dusttaichi.scene.fields import Block, Field, NameLike
from dusttaichi.scene.output import Interval, OptionalInterval
from dusttaichi.scene.stop import Stop

StageName = Annotated[
    str,
    NameLike(
        r"^[A-Za-z0-9][A-Za-z0-9_-]{0,39}$",
        "a word of at most 40 letters, digits, '_' and '-' is needed, for example \"relax\"",
    ),
]


class StageOutput(Block):
    """Output of a stage; auto: as in `output`."""

    series: OptionalInterval = Field("auto", description="interval of the time series")
    profiles: OptionalInterval = Field("auto", description="interval of the vertical profiles")
    snapshots: OptionalInterval = Field("auto", description="interval of the snapshots")


class Stage(Block):
    """A part of the run, with the motion of walls and faces and with its end."""

    name: StageName = Field(description="name of the stage: letters, digits, `_`, `-`")
    drive: Drive = Field(
        default_factory=Drive, description="motion of walls and faces; at rest if not given"
    )
    stop: Stop = Field(
        description="when the stage ends; times, steps and strain count from its start"
    )
    output: StageOutput = Field({}, description="intervals that differ from those of `output`")


@dataclass(frozen=True)
class StagePlan:
    """A stage with everything resolved; a scene without stages has a single one, without a name.

    `snapshots` "auto" spreads them over the stage (run.schedule).
    """

    name: str
    drive: Drive
    stop: Stop
    series: Interval | None
    profiles: Interval | None
    snapshots: Interval | Literal["auto"] | None
