"""What is written, how often and where."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dusttaichi.scene.fields import Block, Count, Number, Switch, problems
from dusttaichi.units import Quantity


class Interval(Block):
    """How often something is written: exactly one of the three."""

    steps: Count | None = Field(None, description="every so many time steps")
    time: Annotated[float, Quantity("time", gt=0, example="5 ns")] | None = Field(
        None, description="simulated time between two"
    )
    filling_factor: Annotated[float, Number(gt=0, lt=1)] | None = Field(
        None, description="growth of the filling factor between two"
    )

    @model_validator(mode="after")
    def _check(self) -> "Interval":
        if [self.steps, self.time, self.filling_factor].count(None) != 2:
            raise problems(
                [
                    (
                        "",
                        "exactly one of steps, time and filling_factor is needed, "
                        "for example {steps: 1000}",
                    )
                ]
            )
        return self


_SWITCH = Switch(
    "off or a block with one of steps, time and filling_factor is needed, for example {steps: 1000}"
)
OptionalInterval = Annotated[Interval | None, _SWITCH]


def default_intervals(compressing: bool) -> dict[str, Any]:
    """Intervals of what the YAML does not mention; compressing: a closed box with a moving top."""
    if compressing:
        return {"series": {"filling_factor": 0.002}, "profiles": {"filling_factor": 0.05}}
    return {"series": {"steps": 1000}, "profiles": "off"}


class Output(Block):
    """Results on disk. The first and the last frame are always written as snapshots."""

    directory: Path = Field(
        Path("runs"),
        description="where the results go, relative to the current directory; "
        "default runs/ and the name of the scene",
        json_schema_extra={"default": "runs/<name>"},
    )
    series: OptionalInterval = Field(
        {"steps": 1000},
        description="interval of the time series; default filling_factor 0.002 in a closed box "
        "whose top wall moves, else 1000 steps",
    )
    profiles: OptionalInterval = Field(
        "off",
        description="interval of the vertical profiles of the filling factor; default "
        "filling_factor 0.05 in a closed box whose top wall moves, else off",
    )
    snapshots: OptionalInterval = Field(
        "off", description="interval of the snapshots of all grains"
    )
    contacts: bool = Field(True, description="snapshots hold the contacts with their state")
    window: Annotated[int | Literal["interval"], Number(whole=True, ge=1, word="interval")] = Field(
        "interval",
        description="steps over which wall pressures are averaged (S12: 100), or interval: "
        "since the last point of the series",
    )
    checkpoint: Annotated[float, Quantity("time", gt=0, example="60 s")] = Field(
        "60 s", description="wall-clock time between two checkpoints"
    )
