"""Threshold speeds of collisions as variables of a dataset, as CSV, and as a table to print."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.collisions import FAILED, MISS
from dusttaichi.analysis.outcome import PAGE
from dusttaichi.analysis.texts import format_csv
from dusttaichi.analysis.thresholds import list_conditions

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.texts import TextColumn
    from dusttaichi.analysis.thresholds import Threshold


ENDS = {
    "": "{meaning}; 0 below and infinite above the speeds that decide",
    "_low": "lower end of the interval of 68 %",
    "_high": "upper end of the interval of 68 %",
    "_speeds_from": "lowest speed that decides on which side of the threshold it is",
    "_speeds_to": "highest speed that decides on which side of the threshold it is",
}
"""End of the name of a number of a Threshold -> its meaning."""


def _list_numbers(threshold: Threshold) -> tuple[float, float, float, float, float]:
    """The numbers of a Threshold, in the order of ENDS [m/s]."""
    speeds = threshold.speeds or (np.nan,)
    return threshold.speed, threshold.low, threshold.high, speeds[0], speeds[-1]


def build_threshold_variables(
    thresholds: Sequence[Threshold], data: xr.Dataset
) -> dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]]:
    """Variables of a dataset of collisions with its Thresholds: name -> (dims, values, attrs).

    v_NAME and further numbers of ENDS [m/s] (body, mass_ratio); v_NAME_censored (body, mass_ratio,
    speed): 1 where failed collisions leave open on which side of the threshold a speed is.
    """
    variables: dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]] = {}
    shape = data.sizes["body"], data.sizes["mass_ratio"]
    meanings = {condition.name: condition.meaning for condition in list_conditions()}
    for name in _list_names(thresholds):
        same_name = [threshold for threshold in thresholds if threshold.name == name]
        columns = zip(*map(_list_numbers, same_name), strict=True)
        for (end, text), values in zip(ENDS.items(), columns, strict=True):
            attributes = {"units": "m/s", "long_name": text.format(meaning=meanings[name])}
            grid = np.reshape(np.asarray(values), shape)
            variables[f"v_{name}{end}"] = ("body", "mass_ratio"), grid, attributes | {"see": PAGE}
        masks = [np.isin(data.speed.values, threshold.censored) for threshold in same_name]
        attributes = {"long_name": "1 where failed collisions leave the side of the threshold open"}
        censored = np.reshape(masks, (*shape, -1)).astype(int)
        variables[f"v_{name}_censored"] = ("body", "mass_ratio", "speed"), censored, attributes
    return variables


def format_threshold_csv(thresholds: Sequence[Threshold]) -> str:
    """Thresholds as CSV: speeds in m/s, `inf` above all speeds that decide, 0 below them.

    Empty where there is no number; the censored speeds are separated by spaces.
    """
    ends = [*ENDS, "_censored"]
    columns = [f"v_{name}{end}_m_per_s" for name in _list_names(thresholds) for end in ends]
    table: list[list[object]] = [["body", "mass_ratio", "target_filling_factor", *columns]]
    for rows in _group_by_point(thresholds):
        cells = [_format_cell(rows[0].filling_factor)]
        for threshold in rows:
            cells += map(_format_cell, _list_numbers(threshold))
            cells.append(" ".join(map(_format_cell, threshold.censored)))
        table.append([rows[0].body, rows[0].mass_ratio, *cells])
    return format_csv(table)


def _format_cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.4g}"


def format_threshold_columns(
    thresholds: Sequence[Threshold],
) -> tuple[list[TextColumn], list[TextColumn]]:
    """(keys, columns) of a table of Thresholds: a row for each body and mass ratio."""
    points = _group_by_point(thresholds)
    keys: list[TextColumn] = [
        ("body", [rows[0].body for rows in points]),
        ("mass ratio", [f"{rows[0].mass_ratio:g}" for rows in points]),
    ]
    columns: list[TextColumn] = [
        (f"v_{name} m/s", [_format_threshold(rows[n]) for rows in points])
        for n, name in enumerate(_list_names(thresholds))
    ]
    return keys, columns


def explain_missing_thresholds(data: xr.Dataset) -> list[str]:
    """Lines about bodies and mass ratios of which no collision that touched has an outcome."""
    lines = []
    for body, ratio in np.ndindex(data.sizes["body"], data.sizes["mass_ratio"]):
        outcomes = data.isel(body=body, mass_ratio=ratio).outcome.values
        missed, failed = (int((outcomes == name).sum()) for name in (MISS, FAILED))
        if missed + failed == outcomes.size:
            lines.append(
                f"no threshold of {data.body.values[body]}, {data.mass_ratio.values[ratio]:g}:1: "
                f"of {outcomes.size} collisions {missed} missed and {failed} failed"
            )
    return lines


def _list_names(thresholds: Sequence[Threshold]) -> list[str]:
    return list(dict.fromkeys(threshold.name for threshold in thresholds))


def _group_by_point(thresholds: Sequence[Threshold]) -> list[Sequence[Threshold]]:
    size = len(_list_names(thresholds))
    return [thresholds[n : n + size] for n in range(0, len(thresholds), size)]


def _format_threshold(threshold: Threshold) -> str:
    """Text of a Threshold: its speed, its interval where that says more, its censored speeds."""
    speed, low, high = (_format_bound(threshold, v) for v in _list_numbers(threshold)[:3])
    beyond = np.isinf(threshold.speed) and threshold.low in (np.inf, threshold.speeds[-1])
    alike = beyond or low == speed == high
    remarks = [] if alike or np.isnan(threshold.low) else [f"{low} to {high}"]
    if threshold.censored:
        remarks.append("censored at " + ", ".join(f"{v:.3g}" for v in threshold.censored))
    return speed + (f" ({'; '.join(remarks)})" if remarks else "")


def _format_bound(threshold: Threshold, speed: float) -> str:
    if np.isnan(speed) or not threshold.speeds:
        return "-"
    if speed == 0.0:
        return f"< {threshold.speeds[0]:.3g}"
    return f"> {threshold.speeds[-1]:.3g}" if np.isinf(speed) else f"{speed:.3g}"
