"""Columns of grains, their units, and a state in SI of them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.names import (
    COMPONENTS,
    DIMENSIONS,
    IGNORED,
    OTHER,
    TENSOR,
    TEXTS,
    VECTORS,
    find_quantity,
    heading,
)
from dusttaichi.samples.formats.text import SPACES, Cells, Source, is_text

if TYPE_CHECKING:
    from dusttaichi.samples.formats.names import Meaning


TRACE = 1e-3  # of the largest component: beyond rounding, the trace of a stress
LENGTHS_DIFFER = 1e-4  # relative: beyond rounding, radii and half diameters


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
    motion: bool = True  #: False where that of time is not known.

    def get_factor(self, quantity: str) -> float:
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
    if name == "lj" and source.length != 1.0:
        return Units(length=source.length, matter=False, motion=False)
    if name == "lj":
        raise source.fault(
            "its units are lj, without a scale; allowed: sample.units with the length that is 1 in "
            "the file, for example sample.units: 1.2 um."
        )
    if name not in LAMMPS_UNITS:
        raise source.fault(f"its units are {name!r}; allowed: {', '.join(LAMMPS_UNITS)}.")
    if source.length not in (1.0, LAMMPS_UNITS[name].length):
        source.remarks.append(f"it names its units ({name}), so that sample.units is not used")
    return LAMMPS_UNITS[name]


def find_named_columns(title: str) -> str | None:
    """Units that the first line of a data file names, `units = micro`."""
    match = re.search(
        rf"\bunits\s*=\s*(\w+)|\bunits\s+({'|'.join(LAMMPS_UNITS)}|lj|electron)\b", title
    )
    return None if match is None else match[1] or match[2]


@dataclass(frozen=True)
class Table:
    """Columns of grains: their names, arrays (N,), and the numbers of their lines, from 0."""

    names: list[str]
    values: list[NDArray[Any]]
    rows: list[int] = field(default_factory=list)  #: [] for variables of a file without lines.
    units: list[float | None] = field(default_factory=list)  #: SI values, None: the file's.
    cells: Cells = SPACES

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.values)

    @property
    def meanings(self) -> list[tuple[str, int | None] | None]:
        """Quantity and component of each column; None for a name that is not known, or ignored."""
        return [None if name in IGNORED else find_quantity(name) for name in self.names]


def make_table(
    names: Sequence[str],
    values: list[NDArray[Any]],
    rows: list[int],
    source: Source,
    cells: Cells = SPACES,
) -> Table:
    """A table whose names may have units, or those of the scene's `columns` instead.

    Raises DustError where there are more or fewer names than columns.
    """
    names = names if source.columns is None else source.columns
    check_width(names, values, rows, source)
    plain, units = zip(*[heading(name, source) for name in names], strict=True)
    check_lengths(plain, units, source)
    return Table(list(plain), values, rows, list(units), cells)


def check_lengths(names: Sequence[str], units: Sequence[float | None], source: Source) -> None:
    """Raise DustError where some lengths have units, other ones than m, and others have none.

    Adds a remark where the file has units and the scene names others.
    """
    lengths = {}
    for name, unit in zip(names, units, strict=True):
        quantity = (find_quantity(name) or ("",))[0]
        if quantity in source.contents.quantities and DIMENSIONS.get(quantity) == "length":
            lengths[name] = unit
    named_units = {unit for unit in lengths.values() if unit is not None}
    if not named_units:
        return
    if None in lengths.values() and {*named_units, source.length} != {1.0}:
        without = [name for name, unit in lengths.items() if unit is None]
        raise source.fault(
            f"some lengths have a unit and others have none ({', '.join(without)}); allowed: a "
            "unit for all of them, or for none (sample.units)."
        )
    if source.length != 1.0 and named_units != {source.length}:
        source.remarks.append("it names its units, so that sample.units is not used")


def check_width(
    names: Sequence[str], values: Sequence[NDArray[Any]], rows: list[int], source: Source
) -> None:
    """Raise DustError where there are more or fewer names than columns."""
    if len(names) != len(values):
        owner = "its header" if source.columns is None else "sample.columns"
        raise source.fault(
            f"{owner} names {len(names)} columns ({' '.join(names)}), and {source.quote(rows[0])} "
            f"has {len(values)}; allowed: a name for each, _ for one that is not read."
        )


def state(table: Table, source: Source, units: Units) -> dict[str, Any]:
    """Arrays in SI in the order of the ids, and under `unread` the names of other columns.

    position, velocity, spin (N, 3), deviator (N, 6), radius, mass, density ... (N,), those of
    source.contents; material, matid, type or species as in the file. Raises DustError for texts
    instead of numbers, with the line, for two columns of the same meaning that differ, and for a
    vector that lacks a component.
    """
    contents = source.contents
    columns: dict[Meaning, tuple[str, NDArray[Any], float | None]] = {}
    unread: list[str] = []
    for n, (name, key) in enumerate(zip(table.names, _meanings(table, source), strict=True)):
        if key is None or key[0] not in contents.quantities:
            unread += [name.removeprefix(OTHER)] if name not in IGNORED else []
            continue
        values, unit = table.values[n], table.units[n] if table.units else None
        if key[0] not in TEXTS:
            _check_numbers(values, table, n, source)
            values = values * (units.get_factor(key[0]) if unit is None else unit)
        if key in columns and not np.array_equal(columns[key][1], values):
            raise source.fault(
                f"the columns {columns[key][0]} and {name} both are its {key[0]}, and differ; "
                f"allowed: one of them, or sample.columns with _ for the other."
            )
        columns[key] = (name, values, unit)
    arrays = _join_components(
        {key: values for key, (_, values, _) in columns.items()}, table, source
    )
    _set_radius(arrays, source)
    _set_spin(arrays, unread)
    if not units.matter and not contents.needs_mass:
        for name in ("mass", "density"):
            if name in arrays and columns[name, None][2] is None:
                unread += [name]
                del arrays[name]
    ids = arrays.pop("id", None)
    if ids is not None and not is_text(ids) and len(np.unique(ids)) == len(ids):
        order = np.argsort(ids, kind="stable")
        arrays = {name: values[order] for name, values in arrays.items()}
    elif ids is not None and len(set(ids)) > 1 and not is_text(ids):
        source.remarks.append("some ids are there twice, so that the order is that of the lines")
    return {**arrays, "unread": list(dict.fromkeys(unread))}


def _meanings(table: Table, source: Source) -> list[Meaning | None]:
    """Quantity and component of each column, or None; of a file in x-y, y is z in a plane."""
    keys = table.meanings
    if not source.contents.plane or not _is_in_xy(keys, table.values):
        return keys
    source.remarks.append("its x and y are read as x and z: with dimension: 2 the plane is x-z")
    turned = {"deviator": (0, 2, 1, 4, 3, 5)}  # xx zz yy xz xy yz
    return [
        key and (key[0], key[1] if key[1] is None else turned.get(key[0], (0, 2, 1))[key[1]])
        for key in keys
    ]


def _is_in_xy(keys: Sequence[Meaning | None], values: Sequence[NDArray[Any]]) -> bool:
    """True for positions along x and y, without a z or with the same z of all."""
    columns = {key[1]: column for key, column in zip(keys, values, strict=True)
               if key and key[0] == "position"}  # fmt: skip
    if not {0, 1} <= columns.keys():
        return False
    y, z = columns[1], columns.get(2)
    if z is None:
        return True
    return not is_text(y) and not is_text(z) and np.ptp(z) == 0.0 < np.ptp(y)


def _check_numbers(values: NDArray[Any], table: Table, n: int, source: Source) -> None:
    if not is_text(values):
        return
    k = next(k for k, cell in enumerate(values) if not table.cells.is_number(cell))
    row = f"line {table.rows[k] + 1}" if table.rows else f"row {k} (from 0)"
    raise source.fault(f"{row}: {table.names[n]} is {values[k]!r}; allowed: plain numbers.")


def _join_components(
    columns: Mapping[Meaning, NDArray[Any]], table: Table, source: Source
) -> dict[str, NDArray[Any]]:
    """Vectors and tensors of their components, and scalars."""
    contents = source.contents
    out = {name: values for (name, component), values in columns.items() if component is None}
    for vector in contents.quantities & VECTORS.keys():
        components = [columns.get((vector, n)) for n in range(3)]
        names = COMPONENTS.get(vector, "xyz")
        missing = [names[axis] for axis in contents.axes if components[axis] is None]
        present = [values for values in components if values is not None]
        if missing and present and vector != "position" and contents.fills_zeros:
            source.remarks.append(f"it has no {', '.join(missing)}, read as 0")
        elif missing and (vector == "position" or present):
            hint = " (sample.columns names the columns in their order)"
            raise source.fault(
                f"it lacks {', '.join(missing)}; allowed: {contents.vectors}"
                f"{hint if table.rows else ''}."
            )
        if present:
            zero = np.zeros(len(present[0]))
            out[vector] = np.column_stack([zero if v is None else v for v in components])
    components = [columns.get(("deviator", n)) for n in range(len(TENSOR))]
    if any(values is not None for values in components):
        out["deviator"] = _complete_deviator(components, source)
    return out


def _complete_deviator(
    components: Sequence[NDArray[Any] | None], source: Source
) -> NDArray[np.float64]:
    """Deviators (N, 6) of their components, of which one on the diagonal follows from the others.

    Raises DustError for two missing ones, and for a trace.
    """
    absent = [n for n in range(3) if components[n] is None]
    zero = np.zeros(len(next(values for values in components if values is not None)))
    if len(absent) > 1:
        raise source.fault(
            f"of its deviator it lacks {', '.join(TENSOR[n] for n in absent)}; allowed: two of xx, "
            "yy and zz, whose sum is 0."
        )
    deviator = np.column_stack([zero if values is None else values for values in components])
    trace = deviator[:, :3].sum(axis=1)
    if absent:
        deviator[:, absent[0]] = -trace
        return deviator
    with np.errstate(invalid="ignore"):
        traced = np.abs(trace) > TRACE * np.abs(deviator).max(axis=1)
    if traced.any():
        worst = int(np.argmax(traced))
        raise source.fault(
            f"xx + yy + zz of particle {worst} (from 0) is {trace[worst]:.4g} Pa; allowed: 0, that "
            "of a deviator (its pressure follows from density and reference)."
        )
    return deviator


def _set_radius(arrays: dict[str, NDArray[Any]], source: Source) -> None:
    diameter = arrays.pop("diameter", None)
    if diameter is None:
        return
    if "radius" in arrays and not np.allclose(
        2.0 * arrays["radius"], diameter, rtol=LENGTHS_DIFFER
    ):
        raise source.fault(
            "its columns of radius and diameter do not agree; allowed: one of them, or "
            "sample.columns with _ for the other."
        )
    arrays.setdefault("radius", 0.5 * diameter)


def _set_spin(arrays: dict[str, NDArray[Any]], unread: list[str]) -> None:
    """Spins of homogeneous spheres from their angular momentum, 2/5 m r^2 w."""
    momentum = arrays.pop("angular_momentum", None)
    if momentum is None or "spin" in arrays:
        return
    radius, mass = arrays.get("radius"), arrays.get("mass")
    if mass is None and radius is not None and "density" in arrays:
        mass = arrays["density"] * 4.0 / 3.0 * np.pi * radius**3
    if mass is None or radius is None or not np.all(mass * radius > 0):
        unread.append("angular momentum (it needs mass and radius)")
        return
    arrays["spin"] = momentum / (0.4 * mass * radius**2)[:, None]
