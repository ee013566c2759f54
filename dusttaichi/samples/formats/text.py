"""Text of files with grains: plain or packed, and tables of numbers that name the line at fault."""

from __future__ import annotations

import bz2
import csv
import gzip
import lzma
import re
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.samples.formats.contents import GRAINS, Contents
from dusttaichi.samples.sample import check_grains, memory

PACKED: dict[bytes, Callable[..., Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ": lzma.open,
}
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")  # 1.2D-06
_SHOWN = 60  # characters of a line in a message
T = TypeVar("T")


@dataclass(frozen=True)
class Source:
    """A text file with grains, and what the scene says about it."""

    name: str  #: Name of the file, for errors.
    lines: list[str]
    length: float = 1.0  #: Unit of length [m] of a file without units.
    snapshot: int | str = "last"
    columns: tuple[str, ...] | None = None  #: Names of the columns, instead of the file's.
    style: str | None = None  #: Atom style of a data file of LAMMPS, instead of the file's.
    remarks: list[str] = field(default_factory=list)  #: Sentences for the user.
    contents: Contents = GRAINS  #: Quantities that the sample reads.

    def fault(self, text: str) -> DustError:
        """The error with the name of the file."""
        return DustError(f"{self.name}: {text}")

    def quote(self, number: int) -> str:
        """A line for a message, shortened."""
        text = self.lines[number].strip()
        text = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
        return f"line {number + 1} ({text!r})"

    def refuse_snapshot(self) -> None:
        """Raise DustError where a snapshot is requested of a file without any."""
        if self.snapshot != "last":
            raise self.fault("such a file has no snapshots; leave sample.snapshot out.")

    def choose_frame(self, frames: Sequence[T]) -> T:
        """The requested one of the snapshots."""
        return frames[self.choose_number(len(frames))]

    def choose_number(self, count: int) -> int:
        """Number of the requested one of `count` snapshots: a number from 0, or "last"."""
        if count == 0:
            raise self.fault("it has no snapshot yet; allowed: one or more.")
        number = count - 1 if isinstance(self.snapshot, str) else self.snapshot
        if not 0 <= number < count:
            raise DustError(
                f"sample.snapshot = {self.snapshot}: {self.name} has {count} snapshots; "
                f"allowed: 0 to {count - 1}, or last."
            )
        return number


def read_bytes(path: Path, origin: str) -> tuple[bytes, bool]:
    """Content of a file, unpacked (gz, bz2, xz); True where it was packed.

    Raises DustError for a file that cannot be read or unpacked, or that the memory cannot hold.
    """
    try:
        with path.open("rb") as file:
            head = file.read(8)
        opener = next((opener for mark, opener in PACKED.items() if head.startswith(mark)), None)
        if opener is None:
            return path.read_bytes(), False
        max_bytes = min(memory() / 4, 2.0**40)
        with opener(path, "rb") as file:
            data = file.read(int(max_bytes) + 1)
    except (OSError, EOFError, zlib.error, lzma.LZMAError) as error:
        raise DustError(f"{origin}: it cannot be read ({error}); allowed: a whole file.") from None
    if len(data) > max_bytes:
        raise DustError(f"{origin}: unpacked it needs more than a quarter of the memory.")
    return data, True


def decode(data: bytes, origin: str) -> list[str]:
    """Lines of a text in UTF-8 or, failing that, in Latin-1, without a byte order mark."""
    if b"\0" in data:
        raise DustError(
            f"{origin}: it cannot be read as text or NetCDF (it has zero bytes, as UTF-16 has); "
            "allowed: a text in UTF-8, a NetCDF file, a restart file of LAMMPS."
        )
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return data.decode("latin-1").splitlines()


@dataclass(frozen=True)
class Cells:
    """Separators of the cells of a line: `split` is a character, or None for white space."""

    split: str | None = None
    decimal_comma: bool = False

    def split_line(self, line: str) -> list[str]:
        """Cells of a line, without quotation marks; without an empty one behind the last mark."""
        if self.split is None:
            return [cell.strip("\"'") for cell in line.split()]
        cells = next(csv.reader([line], delimiter=self.split, skipinitialspace=True), [])
        cells = [cell.strip() for cell in cells]
        return cells[:-1] if len(cells) > 3 and not cells[-1] else cells

    def number(self, cell: str) -> float:
        """A number, also with a Fortran exponent; ValueError for other texts."""
        if self.decimal_comma:
            cell = cell.replace(",", ".")
        # Python also reads 1_0 and the digits of other scripts
        if not cell.isascii() or "_" in cell:
            raise ValueError(cell)
        return float(_FORTRAN.sub("e", cell))

    def is_number(self, cell: str) -> bool:
        """True where the text is a number."""
        try:
            self.number(cell)
        except ValueError:
            return False
        return True


SPACES = Cells()


def parse(
    source: Source, rows: list[int], cells: Cells = SPACES, width: int | None = None
) -> list[NDArray[Any]]:
    """Columns of the lines `rows`: arrays (N,) of numbers, or of str where one is none.

    width: number of columns, by default that of the first row. Raises DustError, with the line, for
    a row of another width, and for too many rows for the memory.
    """
    if not rows:
        raise source.fault(f"it has no {source.contents.noun}; allowed: one or more.")
    check_grains(len(rows), source.name)
    lines = source.lines
    if not cells.decimal_comma:
        try:  # a million lines per second
            values = np.loadtxt(
                [lines[n] for n in rows], delimiter=cells.split, comments=None, ndmin=2
            )
            if values.shape[0] == len(rows) and width in (None, values.shape[1]):
                return list(values.T)
        except ValueError:
            pass
    table = [cells.split_line(lines[n]) for n in rows]
    width = len(table[0]) if width is None else width
    for n, row in zip(rows, table, strict=True):
        if len(row) != width:
            raise source.fault(
                f"{source.quote(n)} has {len(row)} columns; allowed: {width}, as the others or the "
                "header have."
            )
    return [_column(column, cells) for column in zip(*table, strict=True)]


def _column(texts: Sequence[str], cells: Cells) -> NDArray[Any]:
    try:
        return np.array([cells.number(text) for text in texts])
    except ValueError:
        return np.array(texts, dtype=object)


def is_text(values: NDArray[Any]) -> bool:
    """True for a column that is not made of numbers alone."""
    return values.dtype == object


def is_integer_column(values: NDArray[Any], least: float = -np.inf) -> bool:
    """True for a column of whole numbers, none below `least`."""
    if is_text(values) or not np.isfinite(values).all():
        return False
    return bool(np.all(values == np.round(values)) and np.all(values >= least))
