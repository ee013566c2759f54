"""Data files of LAMMPS (read_data, write_data) of every atom style."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.atoms import by_flags, grains_of
from dusttaichi.samples.formats.cell import cell, edges_of
from dusttaichi.samples.formats.columns import Table, find_named_columns, lammps_units, make_table
from dusttaichi.samples.formats.names import find_quantity
from dusttaichi.samples.formats.styles import columns_of
from dusttaichi.samples.formats.text import Source, is_text, parse

COUNT = r"^\s*\d+\s+atoms\s*(?:#.*)?$"
ATOMS = r"^\s*Atoms\s*(?:#.*)?$"
SPINS = ("wx", "wy", "wz")
MOTION = {"sphere": SPINS, "bpm/sphere": SPINS, "ellipsoid": ("angmomx", "angmomy", "angmomz")}
SHAPES = {"line": "lines", "tri": "triangles", "body": "bodies"}


@dataclass
class DataFile:
    """Content of a data file: counts and cell of its header, rows and style of its sections."""

    counts: dict[str, int] = field(default_factory=dict)
    low: NDArray[np.float64] = field(default_factory=lambda: np.full(3, np.nan))
    high: NDArray[np.float64] = field(default_factory=lambda: np.full(3, np.nan))
    tilts: tuple[float, ...] = (0.0, 0.0, 0.0)
    vectors: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    sections: dict[str, list[int]] = field(default_factory=dict)
    hints: dict[str, str] = field(default_factory=dict)

    @property
    def box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origin (3,) and edges (3, 3) as rows; not numbers where the header lacks them."""
        if "avec" in self.vectors:
            origin = self.vectors.get("abc origin", np.zeros(3))
            return origin, np.stack([self.vectors[k] for k in ("avec", "bvec", "cvec")])
        return self.low, edges_of(self.low, self.high, self.tilts)


def read(source: Source) -> dict[str, Any]:
    """State of the grains, as columns.state, with the box.

    Raises DustError for sections whose lines are not as many as the header announces, for an atom
    style that is not named and does not follow from the columns, and for grains that are not
    spheres.
    """
    source.refuse_snapshot()
    plain = replace(source, lines=[line.split("#")[0] for line in source.lines])
    data = _scan(source, plain)
    if "Atoms" not in data.sections:
        raise source.fault("the data file has no section Atoms; allowed: one with grains.")
    rows, count = data.sections["Atoms"], data.counts["atoms"]
    if len(rows) != count:
        raise source.fault(
            f"its header announces {count} atoms, and the number of lines of its section Atoms is "
            f"{len(rows)}; allowed: the same. Was it cut off?"
        )
    units = lammps_units(find_named_columns(source.lines[0]), source)
    values = parse(plain, rows)
    style: str | None = None
    if source.columns is None:
        style, names = columns_of(values, data, source)
    else:
        names = list(source.columns)
    labels = _labels(data, plain)
    named_types = {number: label for label, number in labels.items()}
    at = [n for n, name in enumerate(names) if name == "type"]
    if labels and at and is_text(values[at[0]]):
        values[at[0]] = _number_types(values[at[0]], labels, rows, source)
    table = _append_motion(make_table(names, values, rows, plain), data, style, plain)
    table = _with_shapes(table, data, style, plain)
    state = grains_of(table, plain, units, by_flags(table.names, table.values, data.box[1]))
    state["labels"] = named_types
    state["unread"] = [name for name in state["unread"] if not name.endswith("flag")]
    sections = [name for name in data.sections if name not in READ]
    if sections:
        state["unread"] += [f"section {name}" for name in sections]
    origin, vectors = data.box
    if np.isfinite(vectors).all():
        state |= cell(units.length * vectors, units.length * origin)
    return state


SECTIONS = (
    "Atoms Velocities Masses Ellipsoids Lines Triangles Bodies Bonds Angles Dihedrals Impropers"
).split()
READ = ("Atoms", "Velocities", "Ellipsoids", "Atom Type Labels")


def _scan(source: Source, plain: Source) -> DataFile:
    """Header and sections: a section of any name begins with a line between empty ones."""
    data, name = DataFile(), None
    for n, line in enumerate(plain.lines):
        text = line.strip()
        if n == 0 or not text:
            continue
        alone = not any(line.strip() for line in (plain.lines[n - 1], *plain.lines[n + 1 : n + 2]))
        if text in SECTIONS or (text[0].isalpha() and alone):
            name = " ".join(text.split())
            data.sections[name] = []
            _, _, hint = source.lines[n].partition("#")
            data.hints[name] = hint.strip()
        elif name is not None:
            data.sections[name].append(n)
        else:
            _header(text.split(), data, plain, n)
    if data.vectors and not {"avec", "bvec", "cvec"} <= set(data.vectors):
        raise source.fault("its header lacks one of avec, bvec and cvec; allowed: all or none.")
    if "atoms" not in data.counts:
        raise source.fault("its header has no line such as `100 atoms`; allowed: a data file.")
    return data


def _header(words: list[str], data: DataFile, source: Source, n: int) -> None:
    """Read one line of the header."""
    key = " ".join(word for word in words if not word.lstrip("+-.")[:1].isdigit())
    try:
        if match := re.fullmatch(r"([xyz])lo \1hi", key):
            axis = "xyz".index(match[1])
            data.low[axis], data.high[axis] = float(words[0]), float(words[1])
            if data.high[axis] < data.low[axis]:
                raise source.fault(f"{source.quote(n)}: the upper end is below the lower one.")
        elif key == "xy xz yz":
            data.tilts = tuple(float(word) for word in words[:3])
        elif key in ("avec", "bvec", "cvec", "abc origin"):
            data.vectors[key] = np.array([float(word) for word in words[:3]])
        elif len(words) > 1 and words[0].isdigit():
            data.counts[" ".join(words[1:])] = int(words[0])
    except ValueError:
        raise source.fault(f"{source.quote(n)} is not a line of numbers and {key}.") from None


def _labels(data: DataFile, source: Source) -> dict[str, float]:
    """Number of each type with a label."""
    rows = [source.lines[n].split() for n in data.sections.get("Atom Type Labels", ())]
    return {row[1]: float(row[0]) for row in rows if len(row) == 2 and row[0].isdigit()}


def _number_types(
    values: NDArray[Any], labels: Mapping[str, float], rows: list[int], source: Source
) -> NDArray[np.float64]:
    unknown = next((k for k, v in enumerate(values) if v not in labels and not v.isdigit()), None)
    if unknown is not None:
        raise source.fault(
            f"line {rows[unknown] + 1}: the type is {values[unknown]!r}; allowed: "
            f"{', '.join(labels)} (Atom Type Labels), or a number."
        )
    return np.array([labels.get(v) or float(v) for v in values])


def _sort_by_id(section: str, data: DataFile, table: Table, source: Source) -> list[NDArray[Any]]:
    """Columns of a section in the order of the atoms. Raises DustError for other ids."""
    values = parse(source, data.sections[section])
    ids = next(
        (
            v
            for name, v in zip(table.names, table.values, strict=True)
            if find_quantity(name) == ("id", None)
        ),
        None,
    )
    if ids is None or any(map(is_text, values)):
        raise source.fault(f"its section {section} is not of numbers behind an id; allowed: these.")
    order, order_of_atoms = np.argsort(ids), np.argsort(values[0])
    if len(ids) != len(order_of_atoms) or not np.array_equal(ids[order], values[0][order_of_atoms]):
        raise source.fault(
            f"the ids of its section {section} are not those of its {len(ids)} atoms; allowed: a "
            "line for each."
        )
    back = np.empty(len(ids), int)
    back[order] = order_of_atoms
    return [column[back] for column in values[1:]]


def _append_motion(table: Table, data: DataFile, style: str | None, source: Source) -> Table:
    if not data.sections.get("Velocities"):
        return table
    columns = _sort_by_id("Velocities", data, table, source)
    style_columns: tuple[str, ...] = SPINS if style is None else MOTION.get(style, ())
    names = ["vx", "vy", "vz", *style_columns][: len(columns)]
    names += [f"column {k + 2} of Velocities" for k in range(len(names), len(columns))]
    if len(columns) < 3 or len(names) in (4, 5):
        raise source.fault(
            f"its section Velocities has {len(columns)} columns behind the id; allowed: 3, or 6 "
            "of spheres and ellipsoids."
        )
    return Table([*table.names, *names], [*table.values, *columns], table.rows, [], table.cells)


def _with_shapes(table: Table, data: DataFile, style: str | None, source: Source) -> Table:
    """The table with the diameters of ellipsoids that are spheres; refuses other shapes."""
    flags = next((v for name, v in zip(table.names, table.values, strict=True)
                  if name.endswith("flag")), None)  # fmt: skip
    if style in SHAPES and flags is not None and np.any(flags != 0):
        raise source.fault(f"its grains are {SHAPES[style]}; allowed: spheres.")
    if style != "ellipsoid" or not np.any(flags):  # points alone have no size in the file
        return table
    if "Ellipsoids" not in data.sections:
        raise source.fault("it has ellipsoids without a section Ellipsoids; allowed: a whole file.")
    if np.any(flags != 1):
        raise source.fault("some of its atoms are points, not spheres; allowed: ellipsoidflag 1.")
    shape = np.column_stack(_sort_by_id("Ellipsoids", data, table, source)[:3])
    uneven = np.flatnonzero(np.ptp(shape, axis=1) > 1e-6 * shape.max(axis=1))
    if len(uneven):
        row = shape[uneven[0]]
        raise source.fault(
            f"{source.quote(table.rows[uneven[0]])} is an ellipsoid of the diameters "
            f"{', '.join(f'{d:g}' for d in row)}; allowed: three equal ones, a sphere."
        )
    names = [*table.names, "diameter"]
    return Table(names, [*table.values, shape[:, 0]], table.rows, [], table.cells)
