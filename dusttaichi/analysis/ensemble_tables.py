"""Bands, labels and numbers of a dataset of `ensemble.gather`, for figures and tables."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.analysis.compression import BIN_WIDTH
from dusttaichi.analysis.ensemble import add_statistics
from dusttaichi.analysis.numbers import index_observables, reason, statistics
from dusttaichi.analysis.numbers.number_registry import ENSEMBLES, TABLES
from dusttaichi.analysis.summary import PROBLEMS
from dusttaichi.analysis.symbols import label_key
from dusttaichi.analysis.texts import (
    TextColumn,
    choose_unit,
    format_quantity,
    mask_numbers,
    merge_with_ranges,
    typeset,
)

if TYPE_CHECKING:
    from dusttaichi.analysis.numbers.number_registry import Statistics
    from dusttaichi.physics.geometry import Floats

ONE_SAMPLE = "one sample a point: the scatter between samples is unknown (replicas: 3)"
NAMED = 3  # points of a reason that are named


def title_of(name: str) -> str:
    """Label of a number of the summary in tables and figures."""
    number = index_observables().get(name.removeprefix("final_"))
    if number is None:
        return name.replace("_", " ")
    return f"final {number.heading}" if name.startswith("final_") else number.heading


@dataclass(frozen=True)
class Band:
    """A quantity along the common coordinate: mean and scatter over the replicas of one point."""

    x: NDArray[Any]  #: Common coordinate, (points,), SI.
    mean: Floats  #: (points,), SI.
    std: Floats  #: (points,), SI; NaN for fewer than two replicas.
    replicas: int  #: Their largest number at any x.
    label: str  #: Point of the sweep, "" without one.

    def with_label(self, label: str) -> Band:
        """This Band with another label."""
        return replace(self, label=label)


def bands(
    data: xr.Dataset, name: str, width: float = BIN_WIDTH, along: str | None = None, **selected: Any
) -> list[Band]:
    """Mean and scatter of a variable for each point of a dataset of `gather`.

    Along the filling factor each replica is first smoothed by its median, like a compression curve.
    A Band ends where no replica has a number; gaps between are NaN.

    Parameters
    ----------
    data : xarray.Dataset
    name : str
    width : float
        Width of the windows of the median.
    along : str, optional; default: the common coordinate
    **selected
        Labels of further dimensions, such as wall="top".
    """
    x = along or data.attrs["coordinate"]
    values = data[name].sel(selected) if selected else data[name]
    if x == "filling_factor" and data.sizes[x] > 1:
        window = max(1, round(width / float(np.median(np.diff(data[x].values)))))
        # the last window may be short
        values = values.coarsen({x: window}, boundary="pad").median()
    scattered = xr.Dataset({"y": values.transpose(..., "replica", x)})
    add_statistics(scattered, "y")
    is_finite = np.isfinite(scattered.y.values)
    mean, std = scattered.mean_y.values, scattered.std_y.values
    result = []
    for index, label in zip(np.ndindex(is_finite.shape[:-2]), point_labels(data), strict=True):
        present = np.flatnonzero(is_finite[index].any(axis=0))
        if len(present):
            span = slice(present[0], present[-1] + 1)
            replicas = int(is_finite[index].any(axis=1).sum())
            columns = scattered[x].values[span], mean[index][span], std[index][span]
            result.append(Band(*columns, replicas, label))
    return result


def point_labels(data: xr.Dataset) -> list[str]:
    """ "wall_speed = 1 cm/s, kappa = 1e-6 g/s" for each point in order; [""] without axes.

    Keys of a single value are left out where there are others.
    """
    axes = axes_of(data)
    return format_points(data, axes if _size(data, axes) == 1 else list_varied_keys(data, axes))


def _size(data: xr.Dataset, axes: Sequence[str]) -> int:
    return math.prod(data.sizes[axis] for axis in axes)


def list_varied_keys(data: xr.Dataset, axes: Sequence[str]) -> list[str]:
    """Keys that have more than one value."""
    return [axis for axis in axes if data.sizes[axis] > 1]


def format_points(data: xr.Dataset, axes: Sequence[str]) -> list[str]:
    """ "γ = 20 mJ/m², ..." for each point of a grid of swept keys, in order."""
    keys = key_labels(data, axes)
    return [
        ", ".join(f"{key} = {value}" for key, value in zip(keys, values, strict=True))
        for values in itertools.product(*(_axis_texts(data, axis) for axis in axes))
    ]


def key_labels(data: xr.Dataset, axes: Sequence[str]) -> list[str]:
    """Symbols or words of swept keys, different ones."""
    paths = [key_of(data, axis) for axis in axes]
    return [label_key(path, paths) for path in paths]


def point_values(data: xr.Dataset) -> list[tuple[str, ...]]:
    """Texts of the values of the swept keys, with units, for each point in order."""
    return list(itertools.product(*(_axis_texts(data, axis) for axis in axes_of(data))))


def axes_of(data: xr.Dataset) -> tuple[str, ...]:
    """Names of the swept keys."""
    dims = [str(dim) for dim in data[data.attrs["summary_numbers"].split()[0]].dims]
    return tuple(dims[: dims.index("replica")])


def key_of(data: xr.Dataset, axis: str) -> str:
    """The swept key behind the name of a dimension."""
    return data[axis].attrs.get("key", axis) if axis in data.coords else axis


def list_missing_numbers(data: xr.Dataset) -> list[tuple[str, str, str, str]]:
    """(missing number, names of points, "2 of 3 runs", why), in order, of finished runs.

    Reasons that differ in numbers alone are one, for all of their points (no names if all points).
    """
    rows, points = index_observables(), point_labels(data)
    groups: dict[tuple[str, str], list[tuple[str, str]]] = {}
    reasons = {n: rows[n].title for n in (row.reason_row for row in rows.values()) if n}
    for name, title in (reasons | {PROBLEMS: "number"}).items():
        if name not in data:
            continue
        texts = data[name].transpose(*axes_of(data), "replica").values
        for label, row in zip(points, texts.reshape(len(points), -1).tolist(), strict=True):
            for text in filter(None, row):
                key = title, mask_numbers(text)
                groups.setdefault(key, []).append((label, text.removeprefix("none: ")))
    return [
        (title, *_count_runs(points, [label for label, _ in entries], data.sizes["replica"]),
         merge_with_ranges([text for _, text in entries]))
        for (title, _), entries in groups.items()
    ]  # fmt: skip


def _count_runs(points: Sequence[str], labels: Sequence[str], replicas: int) -> tuple[str, str]:
    """(names of the points, "" if these are all; "2 of 3 runs" of theirs) for the runs' labels."""
    names = list(dict.fromkeys(labels))
    count = f"{len(labels)} of {len(names) * replicas} runs"
    if len(names) == len(points):
        return "", count
    remainder = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return "; ".join(names[:NAMED]) + remainder, count


def statistics_tables(
    data: xr.Dataset,
) -> Iterator[tuple[Statistics, list[TextColumn], list[str], str]]:
    """(Statistics, columns, lines, why it failed or "") of those with something to say."""
    for row in statistics():
        columns: list[TextColumn] = []
        lines: list[str] = []
        problem = ""
        try:
            columns, lines = row.table(data)
        except Exception as error:  # of an extension; the others are still shown
            problem = reason(error)
        if columns or lines or problem:
            yield row, columns, lines, problem


def _axis_texts(data: xr.Dataset, axis: str) -> list[str]:
    values, unit = data[axis].values, data[axis].attrs.get("units")
    return [
        typeset(format_quantity(v, unit)) if values.dtype.kind in "fi" else str(v)
        for v in values.tolist()
    ]


def table_numbers(data: xr.Dataset) -> list[str]:
    """Names of the numbers of the summary that tables show, of those that some run has.

    Fewer for a sweep, whose table has a column for each number.
    """
    shown = (TABLES,) if axes_of(data) else (TABLES, ENSEMBLES)
    rows = index_observables()

    def has_row(name: str) -> bool:
        number = rows.get(name.removeprefix("final_"))  # none: of a method that is not installed
        return number is None or number.sweeps in shown

    names = data.attrs["summary_numbers"].split()
    return [name for name in names if has_row(name) and np.isfinite(data[name].values).any()]


def number_texts(data: xr.Dataset, name: str, size: float | None = None) -> list[str]:
    """ "mean ± std" of one number for each point, in order; "-" where no run has it.

    Followed by "(2 of 3)" where some replicas lack it. size: see `format_quantity`.
    """
    mean, std = data[f"mean_{name}"].values.ravel(), data[f"std_{name}"].values.ravel()
    is_finite = np.isfinite(data[name].transpose(*axes_of(data), "replica").values)
    counts, replicas = is_finite.sum(axis=-1).ravel(), is_finite.shape[-1]
    unit = data[name].attrs.get("units")
    return [
        format_quantity(m, unit, s, size) + _note_count(n, replicas) if math.isfinite(m) else "-"
        for m, s, n in zip(mean.tolist(), std.tolist(), counts.tolist(), strict=True)
    ]


@dataclass(frozen=True)
class Column:
    """A number of a sweep: its name, its unit, and the text of each point.

    The texts lack the unit where it is the same for all, else `unit` is "".
    """

    name: str
    unit: str
    texts: list[str]

    @property
    def head(self) -> str:
        """The name, and the unit if it is common to all."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    @property
    def same(self) -> bool:
        """True where several points have the same text."""
        return len(self.texts) > 1 and len(set(self.texts)) == 1


def columns(data: xr.Dataset) -> list[Column]:
    """A Column for each number that tables show of a sweep.

    The unit is in the head where all points are within a factor of a thousand.
    """
    result = []
    for name in table_numbers(data):
        sizes = np.abs(data[f"mean_{name}"].values)
        sizes = sizes[np.isfinite(sizes) & (sizes > 0.0)]
        largest = float(sizes.max(initial=0.0))
        unit = choose_unit(largest, data[name].attrs.get("units"))[1]
        if unit and largest <= 1e3 * sizes.min(initial=np.inf):
            texts = number_texts(data, name, largest)
        else:
            unit, texts = "", number_texts(data, name)
        result.append(Column(title_of(name), unit, texts))
    return result


def head_and_columns(data: xr.Dataset) -> tuple[list[TextColumn], list[TextColumn], str]:
    """(keys, columns, remark) of the table of a sweep.

    Swept keys and numbers that differ, as lists of (header, texts); a remark about keys and numbers
    that are the same at every point and, where no seed is swept, about single samples, or "".
    """
    axes, all_columns = axes_of(data), columns(data)
    names = key_labels(data, axes)
    keys = list(zip(names, zip(*point_values(data), strict=True), strict=True))
    alone = [] if _size(data, axes) == 1 else [k for k in keys if len(set(k[1])) == 1]
    same = [f"{name} {texts[0]}" for name, texts in alone]
    same += [f"{c.name} {c.texts[0]} {c.unit}".rstrip() for c in all_columns if c.same]
    remarks = [f"the same everywhere: {', '.join(same)}"] if same else []
    if data.sizes["replica"] == 1 and not any(name.endswith("seed") for name in names):
        remarks.append(ONE_SAMPLE)
    shown: list[TextColumn] = [(c.head, c.texts) for c in all_columns if not c.same]
    return [key for key in keys if key not in alone], shown, "; ".join(remarks)


def _note_count(count: int, replicas: int) -> str:
    return "" if count == replicas else f" ({count} of {replicas})"
