"""The numbers of a run, and the table that shows them: what the rows of the registry say."""

import math
from itertools import groupby

from dusttaichi import method
from dusttaichi.analysis.numbers import GENERAL, families, known

PROBLEMS = "problems"
"""Key of what could not be measured for an error."""
ONE_SAMPLE = "one sample: fit error only; replicas show the scatter between samples"


def summary(run):
    """The numbers of a Run as a dict (SI units; None where the run does not have them).

    name, status, method: of the run. Then every row of the registry (`analysis.numbers`) by its
    name; see the table of numbers in the documentation. problems: (title, why) of what could not
    be measured for an error.
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

    What the run does not have is left out.
    """
    shown = [
        (number.place or family.place, number)
        for family in families(_method(numbers))
        for number in family.numbers
    ]
    shown.sort(key=lambda pair: pair[0])
    rows = [("status", numbers["status"], "")]
    for general, pairs in groupby(shown, key=lambda pair: pair[0] >= GENERAL):
        if general and has_fit_error(numbers):
            rows.append(("± of the numbers above", ONE_SAMPLE, ""))
        rows += [row for _, number in pairs for row in number.table_rows(numbers)]
    return rows + [("number not found", f"{what}: {why}", "") for what, why in numbers[PROBLEMS]]


def has_fit_error(numbers):
    """True where a number of a `summary`, or of a row of `compare`, has an uncertainty."""
    errors = (numbers.get(number.error) for number in known().values())
    return any(error is not None and math.isfinite(error) for error in errors)


def _method(numbers):
    return method.METHODS.get(numbers["method"]) and method.named(numbers["method"])
