"""What the scripts of these pages share: tables of validation/ and in Markdown, entry points."""

import sys
import tempfile
from pathlib import Path

import pandas as pd

VALIDATION = Path(__file__).parent / "validation"


def read(name, **options):
    """A table of validation/ as a DataFrame."""
    return pd.read_csv(VALIDATION / name, comment="#", **options)


def write(path, rows):
    """Write rows, dicts of texts and numbers, as a CSV table."""
    pd.DataFrame(rows).replace("nan", "").to_csv(path, index=False, lineterminator="\n")


def markdown(rows):
    """Rows, dicts of texts with the names of the columns, as a table in Markdown."""
    rows = list(rows)
    lines = [list(rows[0]), ["---"] * len(rows[0]), *(row.values() for row in rows)]
    texts = ([cell.replace("|", "\\|").replace("\n", " ") for cell in line] for line in lines)
    return "".join(f"| {' | '.join(line)} |\n" for line in texts)


def main(rows, **named_functions):
    """Entry point of a script: `OUT.csv PATH...` writes the table of the rows of these paths.

    named_functions: functions that the first argument can name instead, and the other arguments
    are its own.
    """
    first, *arguments = sys.argv[1:]
    if first in named_functions:
        named_functions[first](*arguments)
    else:
        write(first, [row for path in arguments for row in rows(path)])


def update(name, cases, rows):
    """Entry point of a script: measure these cases anew, by default all, in a table of validation/.

    rows: function of a case and a folder for its runs; returns rows of texts that begin with the
    name. The table is in the order of `cases`; rows of those not measured stay as they are.
    """
    stored = pd.read_csv(VALIDATION / name, dtype=str, keep_default_na=False)
    rows_by_case = {
        case: rows_of_case.values.tolist()
        for case, rows_of_case in stored.groupby(stored.columns[0])
    }
    with tempfile.TemporaryDirectory() as folder:
        for case in sys.argv[1:] or cases:
            rows_by_case[case] = rows(case, folder)
            print(*(" | ".join(row) for row in rows_by_case[case]), sep="\n", flush=True)
            table = [row for case_name in cases for row in rows_by_case.get(case_name, [])]
            pd.DataFrame(table, columns=stored.columns).to_csv(
                VALIDATION / name, index=False, lineterminator="\n"
            )
