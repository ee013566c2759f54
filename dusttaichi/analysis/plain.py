"""Numbers of runs and sweeps as plain data for JSON; see docs/results.md."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis import ensemble_tables as tables
from dusttaichi.analysis.kind import add_draft_reason
from dusttaichi.analysis.numbers import families, index_observables

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.numbers.number_registry import Observable, Statistics
    from dusttaichi.analysis.run import Run
    from dusttaichi.analysis.texts import TextColumn


SCHEMA = 1  #: Version of the layout, raised by every change except a further entry.


def convert_runs(runs: Sequence[Run]) -> dict[str, Any]:
    """Every number that Runs have, as plain data."""
    return {"schema": SCHEMA, "runs": [_describe_run(run) for run in runs]}


def _describe_run(run: Run) -> dict[str, Any]:
    entries: dict[str, Any] = {}
    values: dict[str, Any] = {}
    rows: dict[str, Observable] = {}
    problems: list[dict[str, str]] = []
    for family in families(run.method):
        family_values, failed = family.evaluate(run)
        problems += [{"what": title, "why": error} for title, error in failed]
        if any(value is not None for value in family_values.values()):
            values |= family_values
            rows |= {number.name: number for number in family.numbers}
    errors = {number.error for number in rows.values()}
    for name, number in rows.items():
        value = convert_value(values[name])
        entry = {"title": number.about or number.title, "unit": number.unit, "value": value}
        if number.error:
            entry["error"] = convert_value(values[number.error])
        if value is None and values.get(number.reason_row):
            entry["why"] = values[number.reason_row]
        if name not in errors:
            entries[name] = entry
    return {
        "name": add_draft_reason(run.title, run.scene),
        "file": str(run.path),
        "method": run.method.name,
        "status": run.status,
        "version": run.attrs.get("dusttaichi_version", ""),
        "numbers": entries,
        "problems": problems,
    }


def convert_ensemble(data: xr.Dataset) -> dict[str, Any]:
    """The numbers of a dataset of `gather`, an ensemble or a sweep, at each of its points."""
    axes, rows = tables.axes_of(data), index_observables()
    keys = [tables.key_of(data, axis) for axis in axes]
    shape = [data.sizes[axis] for axis in axes]
    points = []
    for index in np.ndindex(*shape):
        selection = dict(zip(axes, index, strict=True))
        point_keys = {
            key: {
                "value": convert_value(data[axis].values[n]),
                "unit": data[axis].attrs.get("units", ""),
            }
            for key, (axis, n) in zip(keys, selection.items(), strict=True)
        }
        names = data.attrs["summary_numbers"].split()
        numbers = {
            name.removeprefix("final_"): _describe_number(data[name][selection], rows)
            for name in names
        }
        points.append({"keys": point_keys, "numbers": numbers})
    document = {"schema": SCHEMA, "name": data.attrs["title"], "points": points}
    return document | {
        "statistics": [_describe_statistics(*table) for table in tables.statistics_tables(data)]
    }


def _describe_statistics(
    row: Statistics, columns: Sequence[TextColumn], lines: Sequence[str], problem: str
) -> dict[str, Any]:
    """Table of a Statistics, whose columns have a header and a text for each row."""
    described = [{"header": header, "texts": list(texts)} for header, texts in columns]
    table = {"name": row.name, "title": row.title, "columns": described, "lines": lines}
    return table | ({"why": problem} if problem else {})


def _describe_number(values: xr.DataArray, rows: Mapping[str, Observable]) -> dict[str, Any]:
    """A number at a point of a sweep, over all its replicas."""
    number = rows.get(str(values.name).removeprefix("final_"))
    finite_values = values.values[np.isfinite(values.values)]
    return {
        "title": (number and (number.about or number.title)) or values.name,
        "unit": values.attrs.get("units", ""),
        "mean": convert_value(finite_values.mean()) if len(finite_values) else None,
        "std": convert_value(finite_values.std(ddof=1)) if len(finite_values) > 1 else None,
        "runs": len(finite_values),
        "values": convert_value(values.values),
    }


def convert_dataset(data: xr.Dataset) -> dict[str, Any]:
    """A dataset as `xarray.Dataset.from_dict` reads it; numbers that are not finite are None."""
    document: dict[str, Any] = convert_value(data.to_dict(data="list"))
    return document


def convert_value(value: Any) -> Any:
    """A value as JSON allows it: None for a number that is not finite."""
    if is_dataclass(value) and not isinstance(value, type):
        return convert_value(asdict(value))
    if isinstance(value, np.ndarray):
        return convert_value(value.tolist())
    if isinstance(value, np.generic):
        return convert_value(value.item())
    if isinstance(value, dict):
        return {str(k): convert_value(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [convert_value(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
