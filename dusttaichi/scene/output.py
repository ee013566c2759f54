"""Output: variables, intervals and directory."""

from pathlib import Path
from typing import Annotated, Any, Literal

from dusttaichi.scene.boundary import BoundaryBlock, filling_direction, has_strain
from dusttaichi.scene.drive import Drive
from dusttaichi.scene.fields import Block, Count, Faults, Field, Number, Switch, UserPath
from dusttaichi.scene.quantities import Quantity


class Interval(Block):
    """Interval between two outputs: exactly one of the four."""

    steps: Count | None = Field(None, description="time steps between two")
    time: Annotated[float, Quantity("time", gt=0, example="5 ns")] | None = Field(
        None, description="simulated time between two"
    )
    filling_factor: Annotated[float, Number(gt=0, lt=1)] | None = Field(
        None, description="change of the filling factor between two"
    )
    strain: Annotated[float, Number(gt=0)] | None = Field(
        None, description="strain between two, defined as in stop.strain"
    )

    def faults(self) -> Faults:
        if sum(getattr(self, name) is not None for name in Interval.model_fields) != 1:
            text = "exactly one of steps, time, filling_factor and strain is needed, "
            yield "", text + "for example {steps: 1000}"


_SWITCH = Switch(
    "auto, off or a block with one of steps, time, filling_factor and strain is needed, "
    "for example {steps: 1000}",
    auto=True,
)
OptionalInterval = Annotated[Interval | None, _SWITCH]


def default_intervals(boundary: BoundaryBlock, drive: Drive, steps: int = 1000) -> dict[str, Any]:
    """Default intervals of the outputs, for one drive.

    steps: of the time series where nothing is strained. Snapshots stay auto: their interval is
    known once the run is built (run.schedule).
    """
    still = {"profiles": "off", "snapshots": "auto"}
    if boundary.kind in ("box", "tube") and filling_direction(boundary, drive) > 0:
        return still | {"series": {"filling_factor": 0.002}, "profiles": {"filling_factor": 0.05}}
    return still | {
        "series": {"strain": 0.005} if has_strain(boundary, drive) else {"steps": steps}
    }


def becomes_due(interval: Interval | None, boundary: BoundaryBlock, drive: Drive) -> bool:
    """True where outputs of an interval (None: off) become due under a drive."""
    if interval is None or (interval.strain is interval.filling_factor is None):
        return True
    if interval.filling_factor is not None:
        return bool(filling_direction(boundary, drive))
    return has_strain(boundary, drive)


class Output(Block):
    """Results on disk. The first and the last frame are always written as snapshots."""

    directory: UserPath = Field(
        Path("runs"),
        description="directory of the results, relative to the current directory; `~` is your home",
        json_schema_extra={"default": "runs/<name>"},
    )
    series: OptionalInterval = Field(
        "auto",
        description="interval of the time series; auto: filling_factor 0.002 in a closed box "
        "whose top wall moves down, strain 0.005 where something else moves, otherwise 1000 "
        "steps, of a continuum 5",
    )
    profiles: OptionalInterval = Field(
        "auto",
        description="interval of the vertical profiles of the filling factor; auto: "
        "filling_factor 0.05 in a closed box whose top wall moves down, else off",
    )
    snapshots: OptionalInterval = Field(
        "auto",
        description="interval of the snapshots of all grains; auto: about thirty over the run, "
        "fewer where they would take more than 40 MB, none where the length of the run is not "
        "known beforehand or in ensembles and sweeps; the first frame and the last of every "
        "stage are always written",
    )
    contacts: bool = Field(True, description="snapshots contain the contacts with their state")
    forces: bool = Field(
        True, description="contacts in snapshots have their forces, in single precision"
    )
    variables: tuple[str, ...] = Field(
        (),
        description="optional variables of snapshots and contacts, such as [orientation, "
        "grain_loss]; with a minus in front those that are left out, such as [-spin]",
    )
    precision: Literal["f64", "f32"] = Field(
        "f64",
        description="precision of the variables of grains and contacts in snapshots; f32 has "
        "seven digits and takes half the space",
    )
    window: Annotated[int | Literal["interval"], Number(whole=True, ge=1, word="interval")] = Field(
        "interval",
        description="steps over which wall pressures and stresses are averaged (S12: 100), or "
        "interval: since the last record of the series",
    )
    stress: bool = Field(
        False,
        description="virial stress in the series; default true for periodic, else false",
        json_schema_extra={"default": "true for periodic, else false"},
    )
    checkpoint: Annotated[float, Quantity("time", gt=0, example="60 s")] = Field(
        "60 s", description="wall-clock time between two checkpoints"
    )

    @property
    def variable_selection(self) -> tuple[tuple[str, ...], str]:
        """Values of `variables` and `precision`, as results.variables.select takes them."""
        return self.variables, self.precision

    def requests(self, name: str) -> bool:
        """True where an optional variable of that name, of any group, is requested."""
        return any(variable.split("/")[-1] == name for variable in self.variables)
