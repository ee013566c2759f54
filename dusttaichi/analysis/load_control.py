"""Quality of load control: share of the time in which a stage misses its load."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.cycles import compute_pressure
from dusttaichi.analysis.loads import find_drive
from dusttaichi.physics.surfaces.surface_motion import REPLACING
from dusttaichi.scene.quantities import parse

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


CONTROLLED = {"force": "surface_load", "pressure": "surface_pressure"}
"""Controlled load of a surface -> the variable of the result."""
CLOSE = 0.05  #: Relative deviation from the controlled load up to which it counts as reached.


@dataclass(frozen=True)
class LoadControl:
    """Loads of one stage that controls a pressure or stresses, or the load of a surface."""

    stage: str  #: Name of the stage.
    surface: str  #: Name of the surface, "" of the load on a wall or of a cell.
    missed_share: float  #: Share of its time in records that deviate by more than CLOSE.
    lowest: float  #: Smallest load of a record over the controlled one, along any axis.
    highest: float  #: Largest one.


def measure_load_control(run: Run) -> list[LoadControl]:
    """LoadControl of every stage of a run that controls a load, in order, and of each surface.

    Records have averages over their time. A stress of 0 is compared with the largest of the others.
    """
    return [control for stage in run.parts for control in _measure_stage(stage)]


def _measure_stage(stage: Run) -> Iterator[LoadControl]:
    series = stage.series
    if not len(series.time):
        return
    of_room = _compute_relative_loads(stage)
    loads_by_surface = {} if of_room is None else {"": of_room}
    loads_by_surface |= _compute_surface_loads(stage)
    steps = np.diff(series.step.values, prepend=int(stage.start.step)).astype(float)
    for surface, loads in loads_by_surface.items():
        # not the record before any motion
        is_measured = np.isfinite(loads).all(axis=1) & (steps > 0.0)
        if not is_measured.any():
            continue
        loads, times = loads[is_measured], steps[is_measured]
        missed = (np.abs(loads - 1.0) > CLOSE).any(axis=1)
        missed_share = float(times[missed].sum() / times.sum())
        yield LoadControl(
            stage.stage_name, surface, missed_share, float(loads.min()), float(loads.max())
        )


def _compute_surface_loads(stage: Run) -> dict[str, NDArray[np.float64]]:
    """Loads over the controlled ones, (times, 1), of each surface that a stage presses, by name."""
    series, loads = stage.series, {}
    if "surface_load" not in series:
        return {}
    drives = find_drive(stage).get("surfaces") or {}
    names, blocks = series.surface.values.tolist(), stage.scene.get("surfaces", ())
    for n, block in enumerate(blocks, start=len(names) - len(blocks)):  # behind a tube
        drive = drives.get(block.get("name")) or {}
        is_replaced = any(drive.get(key) is not None for key in REPLACING)
        source = drive if is_replaced else block
        for key, variable in CONTROLLED.items():
            if source.get(key) is not None:
                prescribed = parse(source[key], key)
                loads[names[n]] = series[variable].values[:, n, None] / prescribed
    return loads


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
