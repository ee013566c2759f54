"""Several runs side by side: every row of the registry that one of them has."""

import csv

from dusttaichi.analysis.numbers import AUTO, families, in_order, is_known
from dusttaichi.errors import DustError
from dusttaichi.results.outputs import check


def compare(runs):
    """Rows (dicts) for runs of any kind, SI, all with the same keys.

    Keys are name; the numbers of every family of the registry (`analysis.numbers`) that applies to
    one of the runs, also those for comparisons alone; status; version; and problems, (title, why)
    of numbers that could not be measured. Numbers that a run does not have are None or NaN.
    """
    known = [{family.name: family for family in families(run.method)} for run in runs]
    all_families = {name: family for one in known for name, family in one.items()}
    rows, problems = [{"name": run.name} for run in runs], [[] for _ in runs]
    for family in sorted(all_families.values(), key=lambda family: family.place):
        measured = [
            family.of(run) if family.name in names else ({}, [])
            for run, names in zip(runs, known, strict=True)
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


def columns(rows):
    """(heading, texts) of the rows of `compare` that a terminal shows, one text for each run."""
    table = [("run", [row["name"] for row in rows])]
    for _, number in in_order():
        if number.column is None or not any(is_known(row.get(number.name)) for row in rows):
            continue
        heading = number.heading if number.column == AUTO else number.column[0]
        table.append((heading, [number.cell(row.get(number.name), row) for row in rows]))
    return table


def to_csv(rows, path):
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
    check(path, ",".join(list(rows[0])[:5]))
    try:
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(rows[0])
            for row in rows:
                writer.writerow([text_of(value) for value in row.values()])
    except OSError as error:
        raise DustError(f"{path} cannot be written: {error.strerror}") from error


def text_of(value):
    """Text of a value in a CSV file, numbers with five digits."""
    if value is None:
        return ""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(text_of, value))
    return f"{value:.5g}" if isinstance(value, float) else str(value)
