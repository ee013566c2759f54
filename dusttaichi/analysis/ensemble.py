"""Several runs of one scene, or of the points of a sweep, in one dataset with means and scatter.

Every run is interpolated linearly onto one coordinate, each within its own range only, whose ends
are points of the coordinate.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.analysis.ensemble_stages import add_compression, add_extremes, add_stages
from dusttaichi.analysis.numbers import families
from dusttaichi.analysis.summary import PROBLEMS, summarise
from dusttaichi.errors import DustError
from dusttaichi.results.outputs import NETCDF, write_dataset

if TYPE_CHECKING:
    from dusttaichi.analysis.numbers.number_registry import Observable
    from dusttaichi.analysis.run import Run


MOST = 10_000  # points of the common coordinate
CHANGE = 1.001  # factor by which a filling factor changes that counts as driven
# global attributes of the runs that the dataset copies, all values that occur
COPIED = """dusttaichi_version git_commit extensions taichi_version numpy_version netcdf4_version
python_version platform cpu backend precision""".split()
CONVENTION = (
    "NAME: every replica, interpolated linearly onto {coordinate} within its own range, not a "
    "number outside it. mean_NAME and std_NAME: mean and standard deviation (n - 1) over the "
    "replicas that have a number there. replica_count: how many reach that far. summary_numbers: "
    "the variables that hold the numbers of dusttaichi.analysis.summarise; final_NAME is NAME at "
    "the end of a run. smallest_NAME and largest_NAME: extremes of all records of a run. Of runs "
    "with stages, stage_end_NAME: at the end of each stage; loading_pressure: compression curve of "
    "all stages that compress."
)


EXTREMES = "smallest_", "largest_"  # begin of names of numbers without a mean
NO_NUMBER = "why there is no such number of a run, if so"


def gather(
    runs: Sequence[Run | None],
    axes: Mapping[str, xr.Variable] | None = None,
    labels: Mapping[str, Sequence[Any]] | None = None,
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """One dataset of several runs, with the dimensions (*axes, replica, coordinate, ...).

    The coordinate is the filling factor where it is monotonic in the last stage of every run, else
    the time; see the attribute `convention`.

    Parameters
    ----------
    runs : list of Run
        In the order of the axes and then of the replicas, the same number for each point. None is a
        missing run, whose numbers are NaN.
    axes : dict, optional
        Name -> 1-d xr.Variable of a swept key.
    labels : dict, optional
        Name -> one value for each run, coordinates of the dataset (seed, status).
    attrs : dict, optional
        Further global attributes.

    Raises
    ------
    DustError
        No run has a time series.
    """
    axes = dict(axes or {})
    present = [run for run in runs if run is not None and len(run.series.time)]
    if not present:
        raise DustError("No run has finished: there is nothing to gather.")
    shape = tuple(len(values) for values in axes.values())
    shape = (*shape, len(runs) // math.prod(shape))
    dims = (*axes, "replica")
    name = "filling_factor" if all(_driven(_last_stage(run)) for run in present) else "time"
    stages = [None if run is None else _driven_part(run, name) for run in runs]
    grid = common_coordinate([c[name].values for c in stages if c is not None])
    data = xr.Dataset(coords={**axes, "replica": ("replica", np.arange(shape[-1]))})
    data.coords[name] = (name, grid, _attributes(present[0].series[name]))
    data["replica"].attrs["long_name"] = "number of the replica"
    for label, values in (labels or {}).items():
        data.coords[label] = (dims, np.array(values).reshape(shape))
    _add_series(data, stages, data[name], dims, shape)
    data.attrs["summary_numbers"] = _add_numbers(data, runs, dims, shape)
    for add in (add_extremes, add_stages, add_compression):
        add(data, runs, dims, shape)
    names = map(str, data.data_vars)
    add_statistics(data, *[name for name in names if not name.startswith(EXTREMES)])
    reach = [_reaches(c, name, grid) for c in stages]
    count = np.array(reach).reshape(*shape, len(grid)).sum(axis=len(dims) - 1)
    about = {"long_name": f"replicas that reach this {name.replace('_', ' ')}", "units": "1"}
    data["replica_count"] = ((*axes, name), count, about)
    data.attrs |= _join_attributes(present)
    data.attrs |= {"Conventions": "CF-1.11", "coordinate": name, **(attrs or {})}
    data.attrs["convention"] = CONVENTION.format(coordinate=name)
    return data


def _add_series(
    data: xr.Dataset,
    stages: Sequence[xr.Dataset | None],
    grid: xr.DataArray,
    dims: tuple[str, ...],
    shape: tuple[int, ...],
) -> None:
    """Add the series of the stages over a common coordinate, with the coordinates of the stages."""
    series = {}
    for key, variable in _series(stages, str(grid.name), grid.values).items():
        shaped = variable.values.reshape(*shape, *variable.shape[1:])
        series[key] = ((*dims, *variable.dims[1:]), shaped, variable.attrs)
    data.update(series)  # at once: xarray aligns all variables with each one that comes
    for stage in (part for part in stages if part is not None):
        data.coords.update({k: v for k, v in stage.coords.items() if "time" not in v.dims})


def _join_attributes(runs: Sequence[Run]) -> dict[str, str]:
    """Global attributes that a dataset has of its runs (COPIED), of several values all of them."""
    texts = {name: {str(run.attrs[name]) for run in runs if name in run.attrs} for name in COPIED}
    return {name: ", ".join(sorted(values)) for name, values in texts.items() if values}


def _last_stage(run: Run) -> xr.Dataset:
    series = run.series
    if "stage" not in series:
        return series
    return series.isel(time=series.stage.values == series.stage.values[-1])


def _driven(series: xr.Dataset) -> bool:
    """True where the filling factor is monotonic and changes by more than rounding."""
    phi = series.filling_factor.values if "filling_factor" in series else np.zeros(0)
    phi = phi[np.isfinite(phi)]
    steps = np.diff(phi)
    one_way = np.all(steps >= 0) or np.all(steps <= 0)
    return bool(len(steps) and one_way and max(phi) > CHANGE * min(phi))


def _driven_part(run: Run, name: str) -> xr.Dataset:
    """The part of the series along which the coordinate changes, in the order in which it grows."""
    series = _last_stage(run) if name == "filling_factor" else run.series
    series = series.drop_vars("stage", errors="ignore")
    if series[name].values[-1] < series[name].values[0]:
        series = series.isel(time=slice(None, None, -1))
    values = series[name].values
    series = series.isel(time=np.isfinite(values))
    values = values[np.isfinite(values)]
    return series.isel(time=np.concatenate([[True], np.diff(values) > 0])[: len(values)])


def common_coordinate(ranges: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """One coordinate for several, each (points,) and growing.

    The longest of them where the others are its first parts; else from the lowest to the highest
    value in multiples of the median distance of points, rounded to two digits, so that a series
    written at equal steps of that coordinate keeps its points; and the ends of all of them, so that
    each keeps its first and its last point.
    """
    longest = max(ranges, key=len)
    if all(np.array_equal(values, longest[: len(values)]) for values in ranges):
        return longest
    low, high = min(r[0] for r in ranges), max(r[-1] for r in ranges)
    steps = np.concatenate([np.diff(r) for r in ranges])
    step = float(np.median(steps)) if len(steps) else high - low
    step = float(f"{max(step, (high - low) / MOST):.1e}")
    # a value that misses a multiple by rounding is on it
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    grid = step * np.arange(first, last + 1) if last > first else np.array([low, high])
    # ends that are not on it by rounding
    ends = np.unique([end for values in ranges for end in (values[0], values[-1])])
    indices = np.searchsorted(grid, ends)
    near = np.pad(grid, 1, constant_values=(-np.inf, np.inf))
    apart = np.minimum(ends - near[indices], near[indices + 1] - ends)
    return np.sort(np.concatenate([grid, ends[apart > 1e-6 * step]]))


def _inside(values: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Points of the grid between the first and the last value, with a tolerance for rounding."""
    slack = 1e-6 * float(np.min(np.diff(grid), initial=np.inf)) if len(grid) > 1 else 0.0
    inside: NDArray[np.bool_] = (grid >= values[0] - slack) & (grid <= values[-1] + slack)
    return inside


def _reaches(stage: xr.Dataset | None, name: str, grid: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.zeros(len(grid), bool) if stage is None else _inside(stage[name].values, grid)


def interpolate(
    x: NDArray[np.float64], y: NDArray[np.float64], grid: NDArray[np.float64]
) -> NDArray[np.float64]:
    """y, shape (points, ...), at x (points,) growing, on the grid: (grid, ...), NaN outside."""
    out = np.full((len(grid), *y.shape[1:]), np.nan)
    inside = _inside(x, grid)
    flat, columns = out.reshape(len(grid), -1), y.reshape(len(x), -1)
    for column in range(columns.shape[1]):
        flat[inside, column] = np.interp(grid[inside], x, columns[:, column])
    return out


def _series(
    stages: Sequence[xr.Dataset | None], name: str, grid: NDArray[np.float64]
) -> dict[str, xr.Variable]:
    """Every variable of the series but the coordinate on the grid, (run, coordinate, ...).

    NaN for runs that lack it.
    """
    examples: dict[str, xr.DataArray] = {}
    variables: dict[str, xr.Variable] = {}
    for stage in (part for part in stages if part is not None):
        for key, variable in stage.variables.items():
            if key != name and variable.dims[:1] == ("time",):
                examples.setdefault(str(key), stage[key])
    for key, example in examples.items():
        rows = [
            interpolate(stage[name].values, stage[key].values.astype(float), grid)
            if stage is not None and key in stage.variables
            else np.full((len(grid), *example.shape[1:]), np.nan)
            for stage in stages
        ]
        dims = ("run", name, *example.dims[1:])
        variables[key] = xr.Variable(dims, np.array(rows), _attributes(example))
    return variables


def _attributes(variable: xr.DataArray) -> dict[str, Any]:
    return {k: v for k, v in variable.attrs.items() if k in ("units", "long_name", "comment")}


def _add_numbers(
    data: xr.Dataset, runs: Sequence[Run | None], dims: tuple[str, ...], shape: tuple[int, ...]
) -> str:
    """The numbers of the summaries as variables over the runs; returns their names, joined."""
    summaries = [{} if run is None else summarise(run) for run in runs]
    methods = {run.method.name: run.method for run in runs if run is not None}
    observables = {n.name: n for m in methods.values() for f in families(m) for n in f.numbers}
    present_names = {
        name for numbers in summaries for name, value in numbers.items() if value is not None
    }
    rows = {name: row for name, row in observables.items() if row.unit and name in present_names}
    for name, texts in _reasons(summaries, observables.values()).items():
        data.coords[name] = (dims, np.array(texts).reshape(shape), {"long_name": NO_NUMBER})
    nothing: Mapping[Hashable, xr.Variable] = {}
    recorded = next((run.series.variables for run in runs if run is not None), nothing)
    for name, number in rows.items():
        values = [np.nan if summary.get(name) is None else summary[name] for summary in summaries]
        attrs = {"long_name": number.about or number.title, "units": number.unit}
        if name in recorded:
            recorded_attrs = recorded[name].attrs
            attrs["long_name"] = f"{recorded_attrs.get('long_name', name)}, at the end of a run"
            attrs["units"] = recorded_attrs.get("units", number.unit)
        data[_number(name, recorded)] = (dims, np.array(values, float).reshape(shape), attrs)
    return " ".join(_number(name, recorded) for name in rows)


def _reasons(
    summaries: Sequence[Mapping[str, Any]], rows: Iterable[Observable]
) -> dict[str, list[str]]:
    """Reasons of the runs for missing numbers, by the name of their row; errors by PROBLEMS."""
    texts = {
        row.reason_row: [summary.get(row.reason_row) or "" for summary in summaries]
        for row in rows
        if row.reason_row
    }
    wrong = [
        [f"{title}: {problem}" for title, problem in summary.get(PROBLEMS, [])]
        for summary in summaries
    ]
    texts[PROBLEMS] = ["; ".join(problems) for problems in wrong]
    return {name: column for name, column in texts.items() if any(column)}


def _number(name: str, recorded: Collection[Hashable]) -> str:
    """Name in the dataset, other than that of a variable of the series."""
    return f"final_{name}" if name in recorded else name


def add_statistics(data: xr.Dataset, *names: str) -> None:
    """Add mean_NAME and std_NAME over the replicas, NaN for none, or fewer than two."""
    statistics = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of means without values
        for name in names:
            values = data[name].where(np.isfinite(data[name]))
            for prefix, method, result in (
                ("mean", "mean", values.mean("replica")),
                ("std", "standard_deviation", values.std("replica", ddof=1)),
            ):
                attrs = data[name].attrs | {"cell_methods": f"replica: {method}"}
                statistics[f"{prefix}_{name}"] = (result.dims, result.values, attrs)
    data.update(statistics)


def save_ensemble(data: xr.Dataset, path: str | Path) -> None:
    """Write the dataset of `gather`, completely or not at all.

    Parameters
    ----------
    data : xarray.Dataset
    path : path

    Raises
    ------
    DustError
        The file cannot be written.
    """
    write_dataset(path, data, NETCDF, packed=True)
