"""The numbers of a run by the rows of the registry, its table, and several runs side by side."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dusttaichi import method
from dusttaichi.analysis.names import name_runs
from dusttaichi.analysis.numbers import AUTO, GENERAL, families, is_known, list_in_table_order
from dusttaichi.results import outputs

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run
    from dusttaichi.analysis.texts import TextColumn
    from dusttaichi.method import Method


PROBLEMS = "problems"  #: Key of the numbers that an error prevented.
ONE_SAMPLE = "one sample: fit error only; replicas show the scatter between samples"


def summarise(run: Run) -> dict[str, Any]:
    """Numbers of a run as a dict (SI units; None where the run does not have them).

    Keys are name, status and method of the run, then every row of the registry (`analysis.numbers`)
    by its name (see the table of numbers in the documentation), and problems: (title, error) of
    numbers that could not be measured.
    """
    numbers = {"name": run.name, "status": run.status, "method": run.method.name}
    problems = []
    for family in families(run.method):
        if not family.compared:
            values, failed = family.evaluate(run)
            numbers |= values
            problems += failed
    return numbers | {PROBLEMS: problems}


def tabulate(numbers: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Rows (what, run, literature) of text for a summary, in the order to print them.

    Numbers that the run does not have are left out.
    """
    name, rows = numbers["method"], [("status", numbers["status"], "")]
    run_method = method.load_method(name) if name in method.METHODS else None
    shown = list_in_table_order(run_method)
    for general, pairs in groupby(shown, key=lambda pair: pair[0] >= GENERAL):
        if general and has_fit_error(numbers, run_method):
            rows.append(("meaning of ±", ONE_SAMPLE, ""))
        rows += [row for _, number in pairs for row in number.table_rows(numbers)]
    return rows + [("not computed", f"{title}: {error}", "") for title, error in numbers[PROBLEMS]]


def has_fit_error(numbers: Mapping[str, Any], run_method: Method | None = None) -> bool:
    """True where a number of a `summarise`, or of a row of `compare`, has an uncertainty.

    run_method: the method of the run; by default the numbers of all methods are checked.
    """
    rows = (number for family in families(run_method) for number in family.numbers)
    errors = (numbers.get(number.error) for number in rows)
    return any(error is not None and math.isfinite(error) for error in errors)


def compare(runs: Sequence[Run]) -> list[dict[str, Any]]:
    """Rows (dicts) for runs of any kind, SI, all with the same keys.

    Keys are name; the numbers of every family of the registry (`analysis.numbers`) that applies to
    one of the runs, also those for comparisons alone; status; version; and problems, (title, why)
    of numbers that could not be measured. Numbers that a run does not have are None or NaN.
    """
    families_of_runs = [{family.name: family for family in families(run.method)} for run in runs]
    all_families = {
        name: family
        for families_by_name in families_of_runs
        for name, family in families_by_name.items()
    }
    rows: list[dict[str, Any]] = [{"name": name} for name in name_runs(runs)]
    problems: list[list[tuple[str, str]]] = [[] for _ in runs]
    for family in sorted(all_families.values(), key=lambda family: family.order):
        measured = [
            family.evaluate(run) if family.name in names else ({}, [])
            for run, names in zip(runs, families_of_runs, strict=True)
        ]
        for of_run, (_, failed) in zip(problems, measured, strict=True):
            of_run += failed
        if any(value is not None for values, _ in measured for value in values.values()):
            names = [number.name for number in family.numbers if number.unit is not None]
            for row, (values, _) in zip(rows, measured, strict=True):
                row |= {name: values.get(name) for name in names}
    for row, run, failed in zip(rows, runs, problems, strict=True):
        version = run.attrs.get("git_commit", run.attrs.get("dusttaichi_version", ""))
        row |= {"status": run.status, "version": version, "problems": failed}
    return rows


def format_columns(rows: Sequence[Mapping[str, Any]]) -> list[TextColumn]:
    """(heading, texts) of the rows of `compare` that a terminal shows, one text for each run."""
    table: list[TextColumn] = [("run", [row["name"] for row in rows])]
    for _, number in list_in_table_order():
        if number.column is None or not any(is_known(row.get(number.name)) for row in rows):
            continue
        heading = number.heading if number.column == AUTO else number.column[0]
        table.append((heading, [number.cell(row.get(number.name), row) for row in rows]))
    return table


def to_csv(rows: Sequence[Mapping[str, Any]], path: str | Path) -> None:
    """Write the rows of `compare`, numbers with five digits.

    Parameters
    ----------
    rows : list of dict
    path : path

    Raises
    ------
    DustError
        The file cannot be written.
    """
    table = io.StringIO()
    csv.writer(table).writerows(
        [rows[0], *([format_value(v) for v in row.values()] for row in rows)]
    )
    outputs.write(path, table.getvalue(), ",".join(list(rows[0])[:5]))


def format_value(value: Any) -> str:
    """Text of a value in a CSV file, numbers with five digits."""
    if value is None:
        return ""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(format_value, value))
    return f"{value:.5g}" if isinstance(value, float) else str(value)
