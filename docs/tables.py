"""What the scripts of these pages share: tables of validation/ and in Markdown, entry points."""

import sys
import tempfile
from pathlib import Path

import pandas as pd

VALIDATION = Path(__file__).parent / "validation"


def read(name, **how):
    """A table of validation/ as a DataFrame."""
    return pd.read_csv(VALIDATION / name, comment="#", **how)


def write(path, rows):
    """Write rows, dicts of texts and numbers, as a CSV table."""
    pd.DataFrame(rows).replace("nan", "").to_csv(path, index=False, lineterminator="\n")


def markdown(rows):
    """Rows, dicts of texts with the names of the columns, as a table in Markdown."""
    rows = list(rows)
    lines = [list(rows[0]), ["---"] * len(rows[0]), *(row.values() for row in rows)]
    texts = ([cell.replace("|", "\\|").replace("\n", " ") for cell in line] for line in lines)
    return "".join(f"| {' | '.join(line)} |\n" for line in texts)


def main(rows, **others):
    """Entry point of a script: `OUT.csv PATH...` writes the table of the rows of these paths.

    others: functions that the first argument can name instead, and the rest are arguments of it.
    """
    first, *rest = sys.argv[1:]
    if first in others:
        others[first](*rest)
    else:
        write(first, [row for path in rest for row in rows(path)])


def update(name, cases, rows):
    """Entry point of a script: measure these cases anew, by default all, in a table of validation/.

    rows: function of a case and a folder for its runs; returns rows of texts that begin with the
    name. The table is in the order of `cases`; rows of those not measured stay as they are.
    """
    old = pd.read_csv(VALIDATION / name, dtype=str, keep_default_na=False)
    found = {case: own.values.tolist() for case, own in old.groupby(old.columns[0])}
    with tempfile.TemporaryDirectory() as folder:
        for case in sys.argv[1:] or cases:
            found[case] = rows(case, folder)
            print(*(" | ".join(row) for row in found[case]), sep="\n", flush=True)
            table = [row for one in cases for row in found.get(one, [])]
            pd.DataFrame(table, columns=old.columns).to_csv(
                VALIDATION / name, index=False, lineterminator="\n"
            )
