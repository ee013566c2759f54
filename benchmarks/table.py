"""The result of a benchmark as a table: for the screen and for a spreadsheet."""

import csv
import io
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from dusttaichi.results.outputs import check


@dataclass(frozen=True)
class Row:
    """Speed of one configuration: medians over the rounds; nan where there is nothing.

    contacts: of two grains, a grain. ns_per_contact, ns_per_grain_step: of a step with contacts,
    grains, walls, search and ledger. search, ledger: their share [%]. spread: largest minus
    smallest round over the median [%]. speed_up: time of one thread over that of `threads`.
    lammps_ns_per_contact: LAMMPS on as many processes; lammps_ratio: its time a step over ours.
    speed_up and lammps_ratio are medians of the ratios within a round.
    """

    grains: int
    filling_factor: float
    precision: str
    threads: int
    contacts: float
    ns_per_contact: float
    ns_per_grain_step: float
    search: float
    ledger: float
    spread: float
    speed_up: float
    lammps_ns_per_contact: float = math.nan
    lammps_ratio: float = math.nan


@dataclass(frozen=True)
class Start:
    """Start and memory of a number of grains, one thread.

    cold, warm: from the start of the process to the end of the first step [s], with an empty and
    a filled kernel cache; their difference is the compilation. peak: resident memory [MB], warm.
    peak_per_grain: its growth from the smallest number of grains measured [B], nan for that one.
    fields_per_grain: what the fields of the scene take [B].
    """

    grains: int
    precision: str
    cold: float
    warm: float
    peak: float
    peak_per_grain: float
    fields_per_grain: float


@dataclass(frozen=True)
class Column:
    """Title in lines, name and unit in CSV, how the number is written; words: it is none."""

    title: tuple[str, ...]
    name: str
    unit: str = ""
    write: Callable = str
    words: bool = False


def digits(count: int) -> Callable:
    """Formatter of a number with that many digits behind the point; "-" where there is none."""
    return lambda value: "-" if math.isnan(value) else f"{value:.{count}f}"


_KEY = (Column(("grains",), "grains"), Column(("precision",), "precision"))
SPEED = (
    _KEY[0],
    Column(("filling", "factor"), "filling_factor", "", digits(3)),
    _KEY[1],
    Column(("threads",), "threads"),
    Column(("contacts", "per grain"), "contacts", "1/grain", digits(2)),
    Column(("ns per", "contact"), "ns_per_contact", "ns", digits(1)),
    Column(("ns per", "grain-step"), "ns_per_grain_step", "ns", digits(1)),
    Column(("search", "%"), "search", "%", digits(1)),
    Column(("ledger", "%"), "ledger", "%", digits(1)),
    Column(("spread", "%"), "spread", "%", digits(0)),
    Column(("speed-up", "x 1 thread"), "speed_up", "x 1 thread", digits(2)),
)
LAMMPS = (
    Column(("LAMMPS, ns", "per contact"), "lammps_ns_per_contact", "ns", digits(0)),
    Column(("LAMMPS", "x ours"), "lammps_ratio", "x ours", digits(1)),
)
START = (
    *_KEY,
    Column(("first step", "cold, s"), "cold", "s", digits(1)),
    Column(("first step", "warm, s"), "warm", "s", digits(1)),
    Column(("peak memory", "MB"), "peak", "MB", digits(0)),
    Column(("peak, B", "per grain"), "peak_per_grain", "B", digits(0)),
    Column(("fields, B", "per grain"), "fields_per_grain", "B", digits(0)),
)


@dataclass(frozen=True)
class Table(ABC):
    """Measured rows. machine: one line on it; notes: on the measurements and missing ones."""

    machine: str
    notes: tuple[str, ...] = ()

    @property
    @abstractmethod
    def blocks(self):
        """(title, Columns, rows) of each table; `csv` has the first of them."""

    def text(self) -> str:
        """Text for the screen, in columns."""
        blocks = [self.machine]
        for title, columns, rows in self.blocks:
            heads = [(*column.title, "")[:2] for column in columns]
            lines = [*zip(*heads, strict=True), *_cells(columns, rows)]
            widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
            lines.insert(2, tuple("-" * width for width in widths))
            sides = [str.ljust if column.words else str.rjust for column in columns]
            padded = [
                [side(cell, width) for side, cell, width in zip(sides, line, widths, strict=True)]
                for line in lines
            ]
            blocks.append("\n".join([title, *("  ".join(line).rstrip() for line in padded)]))
        return "\n\n".join([*blocks, *self.notes])

    def csv(self) -> str:
        """Text with a line per row; machine and notes are lines that begin with #."""
        _, columns, rows = self.blocks[0]
        return self._csv(columns, [[_short(getattr(r, c.name)) for c in columns] for r in rows])

    def _csv(self, columns, rows) -> str:
        out = io.StringIO()
        out.writelines(f"# {line}\n" for line in (self.machine, *self.notes))
        table = csv.writer(out, lineterminator="\n")
        table.writerow(f"{c.name} [{c.unit}]" if c.unit else c.name for c in columns)
        table.writerows(rows)
        return out.getvalue()

    def to_csv(self, path) -> None:
        """Write `csv` into a file."""
        text = self.csv()
        check(path, "; dusttaichi ").write_text(text)


@dataclass(frozen=True)
class RowTable(Table):
    """One table of rows, whose attributes are the names of the columns."""

    title: str = ""
    columns: tuple[Column, ...] = ()
    rows: tuple = ()

    @property
    def blocks(self):
        return [(self.title, self.columns, self.rows)]


@dataclass(frozen=True)
class SpeedTable(Table):
    """speed: a Row per configuration; start: a Start per number of grains and precision."""

    speed: tuple[Row, ...] = ()
    start: tuple[Start, ...] = ()

    @property
    def blocks(self):
        with_lammps = any(not math.isnan(row.lammps_ratio) for row in self.speed)
        columns = SPEED + LAMMPS if with_lammps else SPEED
        parts = (("Speed", columns, self.speed), ("Start and memory", START, self.start))
        return [part for part in parts if part[2]]

    def csv(self) -> str:
        """Text with a line per configuration, with start and memory of its grains, empty for nan.

        Machine and notes are lines that begin with #.
        """
        starts = {(start.grains, start.precision): start for start in self.start}
        own, more = SPEED + LAMMPS, START[len(_KEY) :]
        rows = []
        for row in self.speed:
            start = starts.get((row.grains, row.precision))
            values = [getattr(row, column.name) for column in own]
            values += [getattr(start, column.name, math.nan) for column in more]
            rows.append(["" if value != value else value for value in values])
        return self._csv(own + more, rows)


def _short(value):
    return f"{value:.6g}" if isinstance(value, (int, float)) else value


def _cells(columns, rows) -> list[tuple[str, ...]]:
    return [tuple(c.write(getattr(row, c.name)) for c in columns) for row in rows]
