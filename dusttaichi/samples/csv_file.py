"""Grains from a CSV file.

A header line with x, y, z and optionally vx, vy, vz, wx, wy, wz, radius, material in any order,
comma separated, then a line for each grain. A material is a name or a number of the scene's; lines
that begin with # are skipped. Numbers are in SI unless the header has a unit, as in `x [um]`.
"""

import csv
import re
import warnings
from pathlib import Path

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.scene import quantities

COMPONENTS = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "spin": ("wx", "wy", "wz"),
}
DIMENSIONS = {
    "position": "length",
    "velocity": "speed",
    "spin": "angular velocity",
    "radius": "length",
}
COLUMNS = {name: quantity for quantity, names in COMPONENTS.items() for name in names}
COLUMNS |= {"radius": "radius", "material": "material"}


def read(path: Path, where: str, length_unit: float | None) -> dict:
    """Arrays in SI; the arguments are those of files.read."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = _rows(file)
            line, cells = next(rows, (0, None))
            if cells is None:
                text = "the file is empty; allowed: a header x,y,z and lines of grains."
                raise DustError(f"{where}: {text}")
            names, factors = _header(cells, where, length_unit)
            values = None if "material" in names else _plain_numbers(file, len(names))
            if values is None:
                file.seek(0)
                rows = _rows(file)
                next(rows)
                found = [(_numbers(row, line, names, where), row) for line, row in rows]
                values = np.array([numbers for numbers, _ in found], dtype=np.float64)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DustError(
            f"{where}: it cannot be read as text ({error}); allowed: CSV or NetCDF."
        ) from None
    values = values.reshape(-1, len(names)) * factors
    column = {name: values[:, k] for k, name in enumerate(names)}
    state = {
        quantity: np.column_stack([column[name] for name in parts])
        for quantity, parts in COMPONENTS.items()
        if parts[0] in column
    }
    if "radius" in column:
        state["radius"] = column["radius"]
    if "material" in column:
        state["material"] = [row[names.index("material")] for _, row in found]
    return state


def _rows(file):
    """(line number, cells) of lines that are neither empty nor a comment."""
    for line, row in enumerate(csv.reader(iter(file.readline, ""), skipinitialspace=True), start=1):
        if any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#"):
            yield line, row


def _plain_numbers(file, columns: int) -> np.ndarray | None:
    """Numbers below the header, a million lines per second.

    None where lines must be read one by one.
    """
    lines = (line for line in file if line.strip() and not line.lstrip().startswith("#"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file without lines
            values = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.size == 0 or values.shape[1] == columns else None


def _header(cells: list[str], where: str, length_unit: float | None):
    """Column names, and their factors to SI."""
    allowed = (
        "allowed: x,y,z and optionally vx,vy,vz, wx,wy,wz, radius and material, each optionally "
        "with a unit: x [um]."
    )
    names, factors = [], []
    for cell in cells:
        match = re.fullmatch(r"\s*(\w+)\s*(?:\[([^\]]*)\])?\s*", cell)
        if match is None or match[1] not in COLUMNS or match[1] in names:
            raise DustError(f"{where}: the header has the column {cell.strip()!r}; {allowed}")
        name, unit = match.groups()
        quantity = COLUMNS[name]
        if quantity == "material" and unit is not None:
            raise DustError(f"{where}: the column {cell.strip()!r} has no unit; {allowed}")
        length = quantity in ("position", "radius")
        default = length_unit if length and length_unit is not None else 1.0
        names.append(name)
        factors.append(
            default if unit is None else unit_factor(unit, quantity, f"{where}, column {name}")
        )
    for quantity, parts in COMPONENTS.items():
        missing = [part for part in parts if part not in names]
        if missing and (quantity == "position" or len(missing) < 3):
            raise DustError(f"{where}: the header lacks {', '.join(missing)}; {allowed}")
    return names, np.array(factors)


def unit_factor(unit: str, quantity: str, where: str) -> float:
    """SI value of a unit in a file. Raises DustError for one of another dimension."""
    return quantities.parse(f"1 {unit}", DIMENSIONS[quantity], where)


def _numbers(row: list[str], line: int, names: list[str], where: str) -> list[float]:
    if len(row) != len(names):
        raise DustError(
            f"{where}: line {line} has {len(row)} columns; allowed: {len(names)}, as the header."
        )
    try:
        return [
            0.0 if name == "material" else _number(cell)
            for name, cell in zip(names, row, strict=True)
        ]
    except ValueError as error:
        raise DustError(f"{where}: line {line}: {error}; allowed: plain numbers.") from None


def _number(cell: str) -> float:
    """A number of a CSV file; Python also reads 1_0 and the digits of other scripts."""
    if not cell.isascii() or "_" in cell:
        raise ValueError(f"could not convert string to float: {cell!r}")
    return float(cell)
