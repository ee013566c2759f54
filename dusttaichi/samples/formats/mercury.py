"""Files .data of MercuryDPM: a line N, time, ends of the box, then a line for each particle.

Source of the columns: MercuryDPM, DPMBase::outputXBallsData.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.cell import cell
from dusttaichi.samples.formats.columns import Units, check_width, make_table, state
from dusttaichi.samples.formats.names import OTHER
from dusttaichi.samples.formats.order import KEY, are_apart
from dusttaichi.samples.formats.text import SPACES, Source, is_integer_column, parse

HEADERS = {8: 3, 6: 2}  # numbers of a header, and dimensions
ANGLES = ["_"] * 3
SPACE = "x y z vx vy vz".split()
SPIN, LAST = ["wx", "wy", "wz"], ["species", "id"]
ORDERS = {  # of the columns of spheres, that of the program first
    "the radius before the angles": [*SPACE, "radius", *ANGLES, *SPIN, *LAST],
    "the radius behind the angular velocities": [*SPACE, *ANGLES, *SPIN, "radius", *LAST],
}
PLANE = ["x", "y", "vx", "vy", "radius", ANGLES[0], "wz", *LAST]
WIDTHS = {3: (14, 15), 2: (8, 9)}


@dataclass(frozen=True)
class _Frame:
    header: NDArray[np.float64]  #: N, time, lower and upper ends of the box.
    rows: list[int]


def is_mercury(source: Source) -> bool:
    """True where the first line is a header, and the second one has the columns of a particle."""
    lines = [line for line in source.lines if line.strip()][:2]
    first, second = (_numbers(line) for line in (*lines, "", "")[:2])
    if first is None or len(first) not in HEADERS or first[0] < 1 or first[0] != int(first[0]):
        return False
    width = len((*lines, "", "")[1].split())
    if source.columns is not None:
        return width == len(source.columns) != len(first)
    return second is not None and width in WIDTHS[HEADERS[len(first)]]


def read(source: Source) -> dict[str, Any]:
    """State of the requested snapshot, as columns.state, with its box and its time.

    Raises DustError for a file that is cut off, and where no order of its columns has radii.
    """
    frame = source.choose_frame(_frames(source))
    values = parse(source, frame.rows)
    dimension = HEADERS[len(frame.header)]
    names = _names(values, dimension, source, frame.rows)
    check_width(names, values, frame.rows, source)
    if dimension == 2 and source.columns is None:
        names, values = _in_space(names, values)
        source.remarks.append("it is two-dimensional: its disks are read as spheres at z = 0")
    table = make_table(names, values, frame.rows, replace(source, columns=None))
    units = Units(length=source.length, matter=source.length == 1.0)
    state_of_frame = state(table, source, units) | {"time": float(frame.header[1])}
    if dimension == 3:
        low, high = source.length * frame.header[2:].reshape(2, 3)
        state_of_frame |= cell(np.diag(high - low), low)
    return state_of_frame


def _numbers(line: str) -> NDArray[np.float64] | None:
    """Numbers of a line, or None."""
    words = line.split()
    if not words or not all(map(SPACES.is_number, words)):
        return None
    return np.array([SPACES.number(word) for word in words])


def _frames(source: Source) -> list[_Frame]:
    lines, frames, n = source.lines, [], 0
    while n < len(lines):
        if not lines[n].strip():
            n += 1
            continue
        header = _numbers(lines[n])
        if header is None or len(header) not in HEADERS or not is_integer_column(header[:1], 1):
            raise source.fault(
                f"{source.quote(n)} is no header of a snapshot of MercuryDPM; allowed: the number "
                "of particles, the time, the lower and upper ends of the box."
            )
        rows = [k for k in range(n + 1, len(lines)) if lines[k].strip()][: int(header[0])]
        if len(rows) < header[0]:
            raise source.fault(
                f"line {n + 1} announces {header[0]:g} particles, and {len(rows)} lines follow; "
                "allowed: as many. Was it cut off?"
            )
        frames.append(_Frame(header, rows))
        n = rows[-1] + 1
    return frames


def _names(
    values: list[NDArray[Any]], dimension: int, source: Source, rows: list[int]
) -> list[str]:
    """Names of the columns: of the scene, or those of the program whose radii are possible."""
    if source.columns is not None:
        return list(source.columns)
    width = len(values)
    if dimension == 2:
        return _with_species(PLANE[:width], values)
    for text, order in ORDERS.items():
        names = order[:width]
        if are_apart([values[names.index(name)] for name in ("x", "y", "z", "radius")]):
            if names != ORDERS["the radius before the angles"][:width]:
                source.remarks.append(
                    f"its columns are read with {text}, since column 7 has no radii "
                    "(sample.columns names others)"
                )
            return _with_species(names, values)
    raise source.fault(
        f"{source.quote(rows[0])}: neither column 7 nor 13 are radii that are positive and with "
        f"which grains hardly overlap; {KEY.format('x, y, z, vx, vy, vz, radius, _, _, ...')}."
    )


def _with_species(names: list[str], values: list[NDArray[Any]]) -> list[str]:
    """Names with matId, which counts from 0 as species do, unless these are something else."""
    species = "matid" if is_integer_column(values[names.index("species")], 0) else f"{OTHER}species"
    return [species if name == "species" else name for name in names]


def _in_space(names: list[str], values: list[NDArray[Any]]) -> tuple[list[str], list[NDArray[Any]]]:
    """Names and columns of disks with the components that they lack, which are 0."""
    zero = np.zeros(len(values[0]))
    missing_columns = ["z", "vz", "wx", "wy"]
    return [*names, *missing_columns], [*values, *[zero] * len(missing_columns)]
