"""Numbers of runs and sweeps as plain data for JSON; see docs/results.md."""

import math
from dataclasses import asdict, is_dataclass

import numpy as np

from dusttaichi.analysis import ensemble_tables as tables
from dusttaichi.analysis.kind import add_draft_reason
from dusttaichi.analysis.numbers import families, index_observables

SCHEMA = 1  #: Version of the layout, raised by every change except a further entry.


def convert_runs(runs):
    """Every number that Runs have, as plain data."""
    return {"schema": SCHEMA, "runs": [_describe_run(run) for run in runs]}


def _describe_run(run):
    entries, values, rows, problems = {}, {}, {}, []
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


def convert_ensemble(data):
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


def _describe_statistics(row, columns, lines, problem):
    """Table of a Statistics, whose columns have a header and a text for each row."""
    columns = [{"header": header, "texts": list(texts)} for header, texts in columns]
    table = {"name": row.name, "title": row.title, "columns": columns, "lines": lines}
    return table | ({"why": problem} if problem else {})


def _describe_number(values, rows):
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


def convert_dataset(data):
    """A dataset as `xarray.Dataset.from_dict` reads it; numbers that are not finite are None."""
    return convert_value(data.to_dict(data="list"))


def convert_value(value):
    """A value as JSON allows it: None for a number that is not finite."""
    if is_dataclass(value):
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
