"""Quality of load control: share of the time in which a stage misses its load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.cycles import compute_pressure
from dusttaichi.analysis.loads import find_drive
from dusttaichi.scene.quantities import parse

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


CLOSE = 0.05  #: Relative deviation from the controlled load up to which it counts as reached.


@dataclass(frozen=True)
class LoadControl:
    """Loads of one stage that controls a pressure or stresses."""

    stage: str  #: Name of the stage.
    missed_share: float  #: Share of its time in records that deviate by more than CLOSE.
    lowest: float  #: Smallest load of a record over the controlled one, along any axis.
    highest: float  #: Largest one.


def measure_load_control(run: Run) -> list[LoadControl]:
    """LoadControl of every stage of a run that controls a load, in order.

    Records have averages over their time. A stress of 0 is compared with the largest of the others.
    """
    controls = (_measure_stage(stage) for stage in run.parts if len(stage.series.time))
    return [control for control in controls if control is not None]


def _measure_stage(stage: Run) -> LoadControl | None:
    loads = _compute_relative_loads(stage)
    if loads is None:
        return None
    series = stage.series
    steps = np.diff(series.step.values, prepend=int(stage.start.step)).astype(float)
    is_measured = np.isfinite(loads).all(axis=1) & (steps > 0.0)  # not the record before any motion
    if not is_measured.any():
        return None
    loads, steps = loads[is_measured], steps[is_measured]
    missed = (np.abs(loads - 1.0) > CLOSE).any(axis=1)
    missed_share = float(steps[missed].sum() / steps.sum())
    return LoadControl(stage.stage_name, missed_share, float(loads.min()), float(loads.max()))


def _compute_relative_loads(stage: Run) -> NDArray[np.float64] | None:
    """Loads over the controlled ones, (times, n); None where there is none, or no record of it."""
    drive, series = find_drive(stage), stage.series
    if drive.get("pressure") and ("pressure" in series or "stress" in series):
        return (compute_pressure(series) / parse(drive["pressure"], "pressure"))[:, None]
    stress = drive.get("stress")
    if not isinstance(stress, (list, tuple)) or "stress" not in series:
        return None
    axes = [n for n, level in enumerate(stress) if level != "free"]
    prescribed = np.array([parse(stress[n], "pressure") for n in axes])
    scale = np.abs(prescribed).max()
    stresses: NDArray[np.float64] = series.stress.values[:, axes, axes]
    loads: NDArray[np.float64] = (stresses - prescribed) / np.where(prescribed, prescribed, scale)
    return 1.0 + loads
