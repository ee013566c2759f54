"""The numbers of a run, and the table that shows them, by the rows of the registry."""

import math
from itertools import groupby

from dusttaichi import method
from dusttaichi.analysis.numbers import GENERAL, families, in_order, known

PROBLEMS = "problems"  #: Key of the numbers that an error prevented.
ONE_SAMPLE = "one sample: fit error only; replicas show the scatter between samples"


def summary(run):
    """Numbers of a run as a dict (SI units; None where the run does not have them).

    Keys are name, status and method of the run, then every row of the registry (`analysis.numbers`)
    by its name (see the table of numbers in the documentation), and problems: (title, error) of
    numbers that could not be measured.
    """
    numbers = {"name": run.name, "status": run.status, "method": run.method.name}
    problems = []
    for family in families(run.method):
        if not family.compared:
            found, failed = family.of(run)
            numbers |= found
            problems += failed
    return numbers | {PROBLEMS: problems}


def table(numbers):
    """Rows (what, run, literature) of text for a summary, in the order to print them.

    Numbers that the run does not have are left out.
    """
    name, rows = numbers["method"], [("status", numbers["status"], "")]
    shown = in_order(method.METHODS.get(name) and method.named(name))
    for general, pairs in groupby(shown, key=lambda pair: pair[0] >= GENERAL):
        if general and has_fit_error(numbers):
            rows.append(("± of the numbers above", ONE_SAMPLE, ""))
        rows += [row for _, number in pairs for row in number.table_rows(numbers)]
    return rows + [("number not found", f"{what}: {why}", "") for what, why in numbers[PROBLEMS]]


def has_fit_error(numbers):
    """True where a number of a `summary`, or of a row of `compare`, has an uncertainty."""
    errors = (numbers.get(number.error) for number in known().values())
    return any(error is not None and math.isfinite(error) for error in errors)
