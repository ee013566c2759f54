"""Start of the tension of a sample that is pulled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.loads import find_drive, find_stage_block
from dusttaichi.results.datasets import read_at

if TYPE_CHECKING:
    from dusttaichi.analysis.records import Records


RECORDS = 10
"""Successive records whose mean distinguishes tension from fluctuations, see stop.past_maximum."""


def read_tension(stage: Records) -> NDArray[np.float64]:
    """Tension [Pa] of the records of a stage, (times,), along the axis that grows most.

    Along the axis of the largest mean if the edges are unknown; on the top wall without a stress.
    """
    series = stage.series
    if "stress" not in series or (stage.has_top_pressure and "box_length" not in series):
        return -read_at(series.pressure, wall="top")
    normal = np.diagonal(series.stress.values, axis1=1, axis2=2)
    if "box_length" not in series:
        return normal[:, np.argmax(np.nanmean(normal, axis=0))]
    return normal[:, find_longest_axis(stage)]


def find_longest_axis(stage: Records) -> int:
    """Number of the axis along which the cell of a stage, which has `box_length`, grows most."""
    return int(np.nanargmax(stage.series.box_length.values[-1] / stage.start.box_length.values))


def _is_load_controlled(stage: Records) -> bool:
    """True where the scene prescribes the load along the axis that grows most."""
    drive = find_drive(stage)
    stress = drive.get("stress")
    if isinstance(stress, (list, tuple)) and "box_length" in stage.series:
        return bool(stress[find_longest_axis(stage)] != "free")
    return bool(stress or drive.get("pressure"))


def find_start_of_tension(stress: NDArray[np.float64]) -> int | None:
    """Number of the record from which a stress [Pa] (times,) is tensile (positive), or None.

    The mean over the next RECORDS and that over all later ones must be tensile.
    """
    stress = np.nan_to_num(stress)
    if not len(stress):
        return None
    width = min(RECORDS, len(stress))
    mean = np.convolve(stress, np.ones(width) / width, "valid")
    tensile = np.flatnonzero(mean > 0.0)
    if not len(tensile) or stress[tensile[0] :].mean() <= 0.0:
        return None
    return int(tensile[0])


def is_tensile_test(stage_run: Records) -> bool:
    """True for a stage, or a run without stages, that its scene ends past the largest tension."""
    stage_block = find_stage_block(stage_run)
    block = stage_run.scene if stage_block is None else stage_block
    return (block.get("stop") or {}).get("past_maximum") is not None


def explain_missing_strength(run: Records) -> str | None:
    """Reason why a tensile test has no tensile strength; None if it has one, and of other runs."""
    if run.stretches and _is_load_controlled(run.part_that("stretches")):
        return "none: the scene prescribes the load; a strength needs a speed or a strain rate"
    tests = [stage for stage in run.parts if is_tensile_test(stage) and len(stage.series.time)]
    if not tests or run.stretches:
        return None
    (stage, *_), growth = tests, tests[0].growth
    if growth >= 0.0:
        return f"none: the filling factor rose by {growth:.2%} in the tensile test"
    if not stage.has_tension:
        return "none: neither the stress nor a pressure on the top wall is recorded"
    largest_tension = np.nanmax(read_tension(stage))
    largest = f"{largest_tension / 1e3:.3g} kPa"
    return f"none: the mean stress stayed compressive, its largest record is {largest}"
