"""Dumps of LAMMPS and LIGGGHTS (dump custom, dump atom)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.atoms import by_flags, grains_of
from dusttaichi.samples.formats.cell import cell, edges_of
from dusttaichi.samples.formats.columns import check_width, lammps_units, make_table
from dusttaichi.samples.formats.names import OTHER
from dusttaichi.samples.formats.text import SPACES, Source, is_integer_column, is_text, parse

if TYPE_CHECKING:
    from dusttaichi.samples.formats.atoms import Unwrapped


# names of positions by what they are: scaled with the cell or not, in the order of preference;
# every second one is not in the cell
POSITIONS = (
    (False, ("x", "y", "z")),
    (False, ("xu", "yu", "zu")),
    (True, ("xs", "ys", "zs")),
    (True, ("xsu", "ysu", "zsu")),
)
OLD = ("id", "type")  # in front of the positions of a dump that names no columns
MARGIN = 0.5  # of the cell, by which positions of an old dump may be outside


@dataclass(frozen=True)
class _Frame:
    """One snapshot: the line of each of its items, and its rows."""

    items: dict[str, int]
    rows: list[int]


def read(source: Source) -> dict[str, Any]:
    """State of the requested snapshot, as columns.state, with its cell and its time if it has one.

    Raises DustError for a dump that is cut off, has no grains, or lacks a position.
    """
    frame = source.choose_frame(_split_frames(source))
    _check_count(frame, source)
    lines, items = source.lines, frame.items
    heads = {name.split()[0]: name for name in items}
    units = lammps_units(lines[items["UNITS"] + 1] if "UNITS" in items else None, source)
    origin, vectors, ends = _box(items.get(heads.get("BOX", "")), source)
    names = heads["ATOMS"].split()[1:]
    values = parse(source, frame.rows, width=len(names) or None)
    if not names and source.columns is None:
        names = _guess_old_names(values, vectors, origin, source)
    names = list(names if source.columns is None else source.columns)
    # variables, computes and fixes of LAMMPS, whatever they are called
    column_names = [OTHER + name if re.match("[vcfid]2?_", name) else name for name in names]
    check_width(column_names, values, frame.rows, source)
    unwrapped = _forms(column_names, values, (origin, vectors), POSITIONS[1::2])
    values, column_names = _choose_positions(column_names, values, (origin, vectors))
    unwrapped = by_flags(column_names, values, vectors) if unwrapped is None else unwrapped
    table = make_table(column_names, values, frame.rows, replace(source, columns=None))
    state = grains_of(table, source, units, unwrapped)
    state |= cell(units.length * vectors, units.length * origin, ends)
    if "TIME" in items and units.motion:
        state["time"] = float(units.time * _read_numbers(items["TIME"] + 1, 1, source)[0])
    return state


def _split_frames(source: Source) -> list[_Frame]:
    """Snapshots of the dump."""
    lines, frames, items = source.lines, [], {}
    starts = [n for n, line in enumerate(lines) if line.lstrip().startswith("ITEM:")]
    for n, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        name = lines[n].strip().removeprefix("ITEM:").strip()
        if not name:
            raise source.fault(f"{source.quote(n)} names no item; allowed: a whole dump.")
        items[name] = n
        if name.split()[:1] == ["ATOMS"]:
            rows = [k for k in range(n + 1, end) if lines[k].strip()]
            frames.append(_Frame(items, rows))
            items = {"UNITS": items["UNITS"]} if "UNITS" in items else {}
    if not frames:
        entries_item = next((name for name in items if name.startswith("ENTRIES")), None)
        text = "the dump has no ITEM: ATOMS"
        if entries_item:
            text = "it is a dump local (ITEM: ENTRIES), of contacts or bonds"
        raise source.fault(f"{text}; allowed: a dump of grains (dump custom or atom).")
    if "TIMESTEP" in items:
        source.remarks.append("it is cut off in the header of a snapshot, the one after the last")
    return frames


def _check_count(frame: _Frame, source: Source) -> None:
    lines, items = source.lines, frame.items
    if "NUMBER OF ATOMS" not in items:
        raise source.fault("a snapshot has no ITEM: NUMBER OF ATOMS; allowed: a whole dump.")
    n = items["NUMBER OF ATOMS"] + 1
    count = _read_numbers(n, 1, source)[0]
    if count != len(frame.rows):
        step = f" of step {lines[items['TIMESTEP'] + 1].strip()}" if "TIMESTEP" in items else ""
        raise source.fault(
            f"line {n + 1} announces {count:g} grains of the snapshot{step}, and the number of "
            f"lines below is {len(frame.rows)}; allowed: the same. Was it cut off? sample.snapshot "
            "selects another snapshot."
        )


def _read_numbers(n: int, count: int, source: Source) -> NDArray[np.float64]:
    """The first `count` numbers of a line."""
    try:
        words = source.lines[n].split()[:count]
        return np.array([SPACES.number(word) for word in words]).reshape(count)
    except (ValueError, IndexError):
        text = source.quote(n) if n < len(source.lines) else "its end"
        raise source.fault(f"{text} is not {count} numbers; allowed: a whole dump.") from None


def _box(
    n: int | None, source: Source
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str] | None]:
    """Origin (3,), edges (3, 3) as rows, and words such as pp of ITEM: BOX BOUNDS in line `n`."""
    if n is None:
        raise source.fault("a snapshot has no ITEM: BOX BOUNDS; allowed: a whole dump.")
    words = source.lines[n].split()[3:]
    end_words = [word for word in words if len(word) == 2 and set(word) <= set("pfsm")]
    ends = end_words if len(end_words) == 3 else None
    if words[:2] == ["abc", "origin"]:
        rows = np.stack([_read_numbers(n + 1 + k, 4, source) for k in range(3)])
        return rows[:, 3], rows[:, :3], ends
    if words[:3] == ["xy", "xz", "yz"]:
        rows = np.stack([_read_numbers(n + 1 + k, 3, source) for k in range(3)])
        xy, xz, yz = rows[:, 2]
        # the bounds are those of the corners: lammps.org, Howto_triclinic
        low = rows[:, 0] - [min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0]
        high = rows[:, 1] - [max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0]
        tilts = (xy, xz, yz)
    else:
        low, high = np.stack([_read_numbers(n + 1 + k, 2, source) for k in range(3)]).T
        tilts = (0.0, 0.0, 0.0)
    if (high < low).any():
        axis = int(np.argmax(high < low))
        raise source.fault(
            f"{source.quote(n + 1 + axis)}: the upper end of the cell along {'xyz'[axis]} is below "
            "its lower end; allowed: above it."
        )
    return low, edges_of(low, high, tilts), ends


def _forms(
    names: Sequence[str],
    values: Sequence[NDArray[Any]],
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
    forms: Iterable[tuple[bool, tuple[str, ...]]],
) -> Unwrapped | None:
    """(Names, columns x, y, z) of the first of these forms that the dump has, or None."""
    lower = [name.lower() for name in names]
    for scaled, axes in forms:
        if not all(axis in lower for axis in axes):
            continue
        x = [values[lower.index(axis)] for axis in axes]
        if any(map(is_text, x)):
            return None  # said with its line by columns.state
        if scaled:
            origin, vectors = box
            x = list((origin + np.column_stack(x) @ vectors).T)
        return " ".join(axes), x
    return None


def _choose_positions(
    names: Sequence[str],
    values: Sequence[NDArray[Any]],
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> tuple[list[NDArray[Any]], list[str]]:
    """Columns and names with x, y, z from the positions that the dump has."""
    lower = [name.lower() for name in names]
    values, names = list(values), list(names)
    if (form := _forms(names, values, box, POSITIONS)) is None:
        return values, names
    for axis, name, column in zip("xyz", form[0].split(), form[1], strict=True):
        values[lower.index(name)], names[lower.index(name)] = column, axis
    alternative_names = {axis for _, axes in POSITIONS[1:] for axis in axes}
    # the same positions in another form
    keep = [n for n, name in enumerate(names) if name.lower() not in alternative_names]
    return [values[n] for n in keep], [names[n] for n in keep]


def _guess_old_names(
    values: list[NDArray[Any]],
    vectors: NDArray[np.float64],
    origin: NDArray[np.float64],
    source: Source,
) -> list[str]:
    """Names of the columns of an old dump, whose positions are scaled or not."""
    width = len(values)
    numbers = not any(map(is_text, values))
    if (
        width in (5, 8)
        and numbers
        and is_integer_column(values[0], 0)
        and is_integer_column(values[1], 1)
    ):
        x = np.column_stack(values[2:5])
        with np.errstate(all="ignore"):
            inside = (x - origin) @ np.linalg.pinv(vectors)
        flags = ["ix", "iy", "iz"][: width - 5]
        fits = [
            axis_names
            for (scaled, axis_names), coordinates in ((POSITIONS[2], x), (POSITIONS[0], inside))
            if np.all(np.abs(coordinates - 0.5) <= 0.5 + MARGIN)
        ]
        if len(fits) == 1:
            names = [*OLD, *fits[0], *flags]
            source.remarks.append(
                f"its columns have no names and are read as {' '.join(names)}, by the values "
                "(sample.columns names others)"
            )
            return names
    raise source.fault(
        "ITEM: ATOMS names no columns, and their values do not say what they are; "
        "sample.columns names them in their order, for example columns: [id, type, xs, ys, zs] "
        "for positions scaled with the cell, _ for a column that is not read."
    )
