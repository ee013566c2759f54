"""Several runs side by side: every row of the registry that one of them has."""

import csv

from dusttaichi.analysis.numbers import AUTO, families, is_known
from dusttaichi.errors import DustError
from dusttaichi.results.outputs import check


def compare(runs):
    """Rows (dicts) for runs of any kind, SI, all with the same keys.

    name; the numbers of every family of the registry (`analysis.numbers`) that applies to one of
    the runs, those for comparisons among them; status, version, and problems: (title, why) of what
    could not be measured. None or nan for what a run has not.
    """
    own = [{family.name: family for family in families(run.method)} for run in runs]
    every = sorted({k: v for one in own for k, v in one.items()}.values(), key=_place)
    rows = [{"name": run.name} for run in runs]
    problems = [[] for _ in runs]
    for family in every:
        found = [
            family.of(run) if family.name in known else ({}, [])
            for run, known in zip(runs, own, strict=True)
        ]
        for failed, (_, why) in zip(problems, found, strict=True):
            failed += why
        if all(value is None for one, _ in found for value in one.values()):
            continue  # no run has it
        names = [number.name for number in family.numbers if number.unit is not None]
        for row, (one, _) in zip(rows, found, strict=True):
            row |= {name: one.get(name) for name in names}
    for row, run, failed in zip(rows, runs, problems, strict=True):
        version = run.attrs.get("git_commit", run.attrs.get("dusttaichi_version", ""))
        row |= {"status": run.status, "version": version, "problems": failed}
    return rows


def columns(rows):
    """(heading, texts) of the rows of `compare` that a terminal shows, one text for each run."""
    shown = [
        (number.place or family.place, number) for family in families() for number in family.numbers
    ]
    shown.sort(key=lambda pair: pair[0])
    found = [("run", [row["name"] for row in rows])]
    for _, number in shown:
        if number.column is None or not any(is_known(row.get(number.name)) for row in rows):
            continue
        heading = number.heading if number.column == AUTO else number.column[0]
        found.append((heading, [number.cell(row.get(number.name), row) for row in rows]))
    return found


def _place(family):
    return family.place


def to_csv(rows, path):
    """Write the rows of `compare`, numbers with five digits. Raises DustError."""
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
    """A value in a CSV file: numbers with five digits."""
    if value is None:
        return ""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(text_of, value))
    return f"{value:.5g}" if isinstance(value, float) else str(value)
