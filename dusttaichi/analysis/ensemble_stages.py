"""Extremes, stages and compression curves of a dataset of several runs, beside its coordinate.

Runs reach a common coordinate at different points and their stages begin at different times. Their
extremes, the ends of their stages and their compression curves are therefore stored apart, from the
records themselves.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.compression import BIN_WIDTH, measure_compression_curve
from dusttaichi.errors import DustError

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.run import Run


CURVE = "loading_pressure"  #: Pressure of the compression curves of runs with stages.
CURVE_AXIS = "loading_filling_factor"  #: Their common coordinate.
MAIN = "pressure stress filling_factor height kinetic coordination_number".split()


def add_extremes(
    data: xr.Dataset, runs: Sequence[Run | None], dims: tuple[str, ...], shape: tuple[int, ...]
) -> list[str]:
    """Add smallest_NAME and largest_NAME, over all records, of every variable of the series."""
    examples: dict[Hashable, xr.DataArray] = {}
    variables: dict[str, tuple[tuple[Hashable, ...], NDArray[np.float64], dict[str, Any]]] = {}
    for run in filter(None, runs):
        for name, variable in run.series.data_vars.items():
            if variable.dims[:1] == ("time",) and variable.dtype.kind in "fi" and name != "stage":
                examples.setdefault(name, variable)
    for name, example in examples.items():
        for word, of in (("smallest", np.fmin), ("largest", np.fmax)):
            rows = [_extreme(run, str(name), of, example.shape[1:]) for run in runs]
            about = {k: v for k, v in example.attrs.items() if k in ("units", "long_name")}
            about["long_name"] = f"{about.get('long_name', name)}, {word} of a run"
            values = np.array(rows).reshape(*shape, *example.shape[1:])
            variables[f"{word}_{name}"] = ((*dims, *example.dims[1:]), values, about)
    data.update(variables)
    return list(variables)


def _extreme(
    run: Run | None, name: str, of: np.ufunc, shape: tuple[int, ...]
) -> NDArray[np.float64]:
    if run is None or name not in run.series:
        return np.full(shape, np.nan)
    values = run.series[name].values.astype(float)
    return of.reduce(values, axis=0) if len(values) else np.full(shape, np.nan)


def add_stages(
    data: xr.Dataset, runs: Sequence[Run | None], dims: tuple[str, ...], shape: tuple[int, ...]
) -> list[str]:
    """Add the stages: their names as a coordinate, and the time and main numbers of their ends.

    stage_end_NAME is NaN for a stage that a run has not begun. Runs without stages have none.
    """
    present = [run for run in runs if run is not None]
    names = max((run.stages for run in present), key=len, default=())
    if not names:
        return []
    stages_by_run = [{} if run is None else {p.stage_name: p for p in run.parts} for run in runs]
    data.coords["stage"] = ("stage", list(names), {"long_name": "stages of the runs, in order"})
    variables, some = {}, present[0].series
    for name in ("time", *(n for n in MAIN if n in some)):
        example = some[name]
        inner = example.dims[1:]
        missing = np.full(example.shape[1:], np.nan)
        rows = [
            [_end(run_stages.get(stage), name, missing) for stage in names]
            for run_stages in stages_by_run
        ]
        about = {k: v for k, v in example.attrs.items() if k in ("units", "long_name")}
        about["long_name"] = f"{about.get('long_name', name)}, at the end of a stage"
        values = np.array(rows, float).reshape(*shape, len(names), *example.shape[1:])
        variables[f"stage_end_{name}"] = ((*dims, "stage", *inner), values, about)
    data.update(variables)
    return list(variables)


def _end(stage: Run | None, name: str, missing: NDArray[np.float64]) -> NDArray[np.float64]:
    if stage is None or name not in stage.series or not len(stage.series.time):
        return missing
    last_record: NDArray[np.float64] = stage.series[name].values[-1]
    return last_record


def add_compression(
    data: xr.Dataset, runs: Sequence[Run | None], dims: tuple[str, ...], shape: tuple[int, ...]
) -> list[str]:
    """Add the compression curves of runs with stages, in bins of filling factor.

    They are those of `compression_curve`: all stages that compress, each beyond the largest filling
    factor before. A run without one has NaN.
    """
    curves = [_curve(run) for run in runs]
    numbers = [n for curve in curves for n in curve]
    if not numbers:
        return []
    first = min(numbers)
    count = max(numbers) - first + 1
    values = np.full((len(runs), count), np.nan)
    for row, curve in zip(values, curves, strict=True):
        for number, pressure in curve.items():
            row[number - first] = pressure
    centres = (first + np.arange(count) + 0.5) * BIN_WIDTH
    about = {"long_name": "filling factor, middles of the bins", "units": "1"}
    data.coords[CURVE_AXIS] = (CURVE_AXIS, centres, about)
    about = {"long_name": "median pressure on the top wall, of the loading", "units": "Pa"}
    data[CURVE] = ((*dims, CURVE_AXIS), values.reshape(*shape, count), about)
    return [CURVE]


def _curve(run: Run | None) -> dict[int, float]:
    """Number of each bin -> its pressure [Pa]; {} for a run without stages that compress."""
    if run is None or not run.stages or not any(stage.compresses for stage in run.parts):
        return {}
    try:
        curve = measure_compression_curve(run)
    except DustError:
        return {}
    numbers = np.floor(curve.filling_factor / BIN_WIDTH + 1e-9).astype(int)
    return dict(zip(numbers.tolist(), curve.pressure.tolist(), strict=True))
