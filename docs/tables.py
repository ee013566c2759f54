"""What the scripts of these pages share: tables of validation/, and tables in Markdown."""

from pathlib import Path

import pandas as pd

VALIDATION = Path(__file__).parent / "validation"


def read(name, **how):
    """A table of validation/ as a DataFrame."""
    return pd.read_csv(VALIDATION / name, comment="#", **how)


def write(path, rows):
    """Write rows, dicts of texts and numbers, as a CSV table."""
    pd.DataFrame(rows).replace("nan", "").to_csv(path, index=False, lineterminator="\n")


def update(name, found, order):
    """Put rows, scene -> lists of texts, into a table of validation/, in the order of the scenes.

    Those of other scenes stay as they are.
    """
    old = pd.read_csv(VALIDATION / name, dtype=str, keep_default_na=False)
    rows = [
        cells
        for scene in order
        for cells in found.get(scene, old[old.iloc[:, 0] == scene].values.tolist())
    ]
    table = pd.DataFrame(rows, columns=old.columns)
    table.to_csv(VALIDATION / name, index=False, lineterminator="\n")


def name_of(path):
    """Name of a run or a study, the last part of its path."""
    return Path(path).name


def cell(content):
    """A text as the cell of a table."""
    return content.replace("|", "\\|").replace("\n", " ")


def row(*cells):
    """Line of a table."""
    return f"| {' | '.join(cells)} |"


def head(*names):
    """First lines of a table."""
    return [row(*names), "| --- " * len(names) + "|"]


def text(lines):
    """Lines as a text that ends with one line break."""
    return "\n".join(lines).rstrip("\n") + "\n"


def prose(docstring):
    """The paragraphs of a docstring, each on one line."""
    return "\n\n".join(" ".join(part.split()) for part in docstring.strip().split("\n\n"))
