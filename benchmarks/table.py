"""Result of a benchmark: tables for the screen, and one for a spreadsheet."""

import math
from dataclasses import dataclass

import pandas as pd

from dusttaichi.commands.console import say, say_abreast
from dusttaichi.errors import DustError
from dusttaichi.results import outputs

MARK = "; dusttaichi "  # in the line on the machine


@dataclass(frozen=True)
class Column:
    """Column of a table: name and unit in the file, heading on the screen.

    digits: behind the point of its numbers; None: texts and whole numbers.
    """

    name: str
    heading: str
    unit: str = ""
    digits: int | None = None

    def text(self, row) -> str:
        """Text of the number of a row, a dict; "-" where there is none."""
        value = row.get(self.name, math.nan)
        if value == "" or value != value:
            return "-"
        return f"{value}" if self.digits is None else f"{value:.{self.digits}f}"


@dataclass(frozen=True)
class Table:
    """Measured rows, dicts of numbers and texts.

    machine: one line on it. blocks: (title, Columns in front, other Columns) of each table on the
    screen; the file has all of them. notes: on the measurements and missing ones.
    """

    machine: str
    rows: list[dict]
    blocks: tuple
    notes: tuple[str, ...] = ()

    def show(self) -> None:
        """Print the tables; rows of equal texts are one, columns without numbers are left out."""
        say(self.machine)
        for title, front, columns in self.blocks:
            lines = dict.fromkeys(tuple(c.text(r) for c in (*front, *columns)) for r in self.rows)
            texts = dict(zip((*front, *columns), zip(*lines, strict=True), strict=False))
            shown = [
                [(c.heading, texts[c]) for c in some if set(texts.get(c, "-")) != {"-"}]
                for some in (front, columns)
            ]
            if any(shown):
                say()
                say_abreast(*shown, title)
        for note in self.notes:
            say(f"\n{note}")

    def to_csv(self, path) -> None:
        """Write a line for each row; the machine and notes are lines that begin with #."""
        columns = dict.fromkeys(
            c for _, front, numbers_columns in self.blocks for c in (*front, *numbers_columns)
        )
        units = {c.name: f"{c.name} [{c.unit}]" if c.unit else c.name for c in columns}
        table = pd.DataFrame(self.rows, columns=list(units)).rename(columns=units)
        lines = "".join(f"# {line}\n" for line in (self.machine, *self.notes))
        numbers = table.to_csv(index=False, float_format="%.6g", lineterminator="\n")
        outputs.write(path, lines + numbers, MARK)


def check_file(path) -> None:
    """Raise DustError for a file that cannot be written, before the measurements."""
    if path is None:
        return
    try:
        outputs.check(path, MARK).open("a").close()
    except OSError as error:
        raise DustError(f"{path} cannot be written: {error.strerror}") from error
