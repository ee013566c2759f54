"""Columns of grains, their units, and a state in SI of them."""

import re
from dataclasses import dataclass, field

import numpy as np

from dusttaichi.samples.formats.names import (
    COMPONENTS,
    DIMENSIONS,
    IGNORED,
    OTHER,
    VECTORS,
    heading,
    known,
)
from dusttaichi.samples.formats.text import SPACES, Cells, Source, is_text


@dataclass(frozen=True)
class Units:
    """SI values of the units of a file; those of length may be the scene's (`sample.units`)."""

    length: float = 1.0
    speed: float = 1.0
    spin: float = 1.0
    mass: float = 1.0
    density: float = 1.0
    time: float = 1.0
    matter: bool = True  #: False where the units of masses and densities are not known.

    def of(self, quantity: str) -> float:
        """Factor to SI of a quantity."""
        if quantity == "angular_momentum":
            return self.mass * self.length * self.speed
        dimension = DIMENSIONS.get(quantity)
        return getattr(self, {"angular velocity": "spin"}.get(dimension, dimension), 1.0) \
            if dimension else 1.0  # fmt: skip


_GRAM_PER_MOL = 1e-3 / 6.02214076e23
LAMMPS_UNITS = {  # length [m], speed [m/s], spin [rad/s], mass [kg], density [kg/m^3], time [s]
    "micro": Units(1e-6, 1.0, 1e6, 1e-15, 1e3, 1e-6),
    "nano": Units(1e-9, 1.0, 1e9, 1e-21, 1e6, 1e-9),
    "si": Units(),
    "cgs": Units(1e-2, 1e-2, 1.0, 1e-3, 1e3, 1.0),
    "metal": Units(1e-10, 1e2, 1e12, _GRAM_PER_MOL, 1e3, 1e-12),
    "real": Units(1e-10, 1e5, 1e15, _GRAM_PER_MOL, 1e3, 1e-15),
}


def lammps_units(name: str | None, source: Source) -> Units:
    """Units that a file names; without a name those of `sample.units`, else SI."""
    if name is None:
        return Units(length=source.length, matter=False)
    name = name.strip()
    if name not in LAMMPS_UNITS:
        raise source.fault(f"its units are {name!r}; allowed: {', '.join(LAMMPS_UNITS)}.")
    if source.length not in (1.0, LAMMPS_UNITS[name].length):
        source.remarks.append(f"it names its units ({name}), so that sample.units is not used")
    return LAMMPS_UNITS[name]


def named_in(title: str) -> str | None:
    """Units that the first line of a data file names, `units = micro`."""
    match = re.search(
        rf"\bunits\s*=\s*(\w+)|\bunits\s+({'|'.join(LAMMPS_UNITS)}|lj|electron)\b", title
    )
    return None if match is None else match[1] or match[2]


@dataclass(frozen=True)
class Table:
    """Columns of grains: their names, arrays (N,), and the numbers of their lines, from 0."""

    names: list[str]
    values: list[np.ndarray]
    rows: list[int]
    units: list[float | None] = field(default_factory=list)  #: SI values, None: the file's.
    cells: Cells = SPACES

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.values)


def named(names, values, rows, source: Source, cells: Cells = SPACES) -> Table:
    """A table whose names may have units, or those of the scene's `columns` instead.

    Raises DustError where there are more or fewer names than columns.
    """
    names = names if source.columns is None else source.columns
    check_width(names, values, rows, source)
    found = [heading(name, source) for name in names]
    lengths = [unit for name, unit in found
               if DIMENSIONS.get((known(name) or ("",))[0]) == "length"]  # fmt: skip
    if None in lengths and any(lengths):
        raise source.fault(
            f"of its columns {', '.join(names)} some lengths have a unit and others have none; "
            "allowed: a unit for all of them, or for none (sample.units)."
        )
    return Table([name for name, _ in found], values, rows, [unit for _, unit in found], cells)


def check_width(names, values, rows, source: Source) -> None:
    """Raise DustError where there are more or fewer names than columns."""
    if len(names) != len(values):
        whose = "its header" if source.columns is None else "sample.columns"
        raise source.fault(
            f"{whose} names {len(names)} columns ({' '.join(names)}), and {source.shown(rows[0])} "
            f"has {len(values)}; allowed: a name for each, _ for one that is not read."
        )


def state(table: Table, source: Source, units: Units) -> dict:
    """Arrays in SI in the order of the ids, and under `unread` the names of other columns.

    position, velocity, spin (N, 3), radius, mass, density (N,); material, matid, type or species
    as in the file. Raises DustError for texts instead of numbers, with the line, for two columns of
    the same meaning that differ, and for a vector that lacks a component.
    """
    found, unread = {}, []
    for n, (name, values) in enumerate(zip(table.names, table.values, strict=True)):
        key = None if name in IGNORED else known(name)
        if key is None:
            unread += [name.removeprefix(OTHER)] if name not in IGNORED else []
            continue
        if key[0] not in ("material", "species", "type", "id"):
            _check_numbers(values, table, n, source)
            unit = table.units[n] if table.units else None
            values = values * (units.of(key[0]) if unit is None else unit)
        if key in found and not np.array_equal(found[key][1], values):
            raise source.fault(
                f"the columns {found[key][0]} and {name} both are its {key[0]}, and differ; "
                f"allowed: one of them, or sample.columns with _ for the other."
            )
        found[key] = (name, values)
    columns = {key: values for key, (_, values) in found.items()}
    whole = _joined(columns, source)
    _set_radius(whole, source)
    _set_spin(whole, unread)
    if not units.matter:
        unread += [name for name in ("mass", "density") if whole.pop(name, None) is not None]
    ids = whole.pop("id", None)
    if ids is not None and not is_text(ids) and len(np.unique(ids)) == len(ids):
        order = np.argsort(ids, kind="stable")
        whole = {name: values[order] for name, values in whole.items()}
    whole["unread"] = list(dict.fromkeys(unread))
    return whole


def _check_numbers(values, table, n, source):
    if not is_text(values):
        return
    k = next(k for k, cell in enumerate(values) if not table.cells.is_number(cell))
    raise source.fault(
        f"line {table.rows[k] + 1}: {table.names[n]} is {values[k]!r}; allowed: plain numbers."
    )


def _joined(columns, source):
    """Vectors of their components, and scalars."""
    out = {name: values for (name, part), values in columns.items() if part is None}
    for vector in VECTORS:
        parts = [columns.get((vector, n)) for n in range(3)]
        missing = [axis for axis, part in zip("xyz", parts, strict=True) if part is None]
        if vector in COMPONENTS:
            names = COMPONENTS[vector]
            missing = [names["xyz".index(axis)] for axis in missing]
        if missing and (vector == "position" or len(missing) < 3):
            raise source.fault(
                f"it lacks {', '.join(missing)}; allowed: x, y, z, and vx, vy, vz or wx, wy, wz "
                "all three or none (sample.columns names the columns in their order)."
            )
        if not missing:
            out[vector] = np.column_stack(parts)
    return out


def _set_radius(found, source):
    diameter = found.pop("diameter", None)
    if diameter is None:
        return
    if "radius" in found and not np.allclose(2.0 * found["radius"], diameter, rtol=1e-4):
        raise source.fault(
            "its columns of radius and diameter do not agree; allowed: one of them, or "
            "sample.columns with _ for the other."
        )
    found.setdefault("radius", 0.5 * diameter)


def _set_spin(found, unread):
    """Spins of homogeneous spheres from their angular momentum, 2/5 m r^2 w."""
    momentum = found.pop("angular_momentum", None)
    if momentum is None or "spin" in found:
        return
    radius, mass = found.get("radius"), found.get("mass")
    if mass is None and radius is not None and "density" in found:
        mass = found["density"] * 4.0 / 3.0 * np.pi * radius**3
    if mass is None or radius is None or not np.all(mass * radius > 0):
        unread.append("angular momentum (it needs mass and radius)")
        return
    found["spin"] = momentum / (0.4 * mass * radius**2)[:, None]
