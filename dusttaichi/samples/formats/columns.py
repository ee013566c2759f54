"""Columns of grains by the names of many programs, their units, and a state in SI of them.

Names are those of this program, LAMMPS, LIGGGHTS, YADE, OVITO, ParaView and ASE, in any case:
`x`, `Position.X`, `Points:0`, `velo`, `omegax`, `Radius`, `matId`.
"""

import re
from dataclasses import dataclass, field

import numpy as np

from dusttaichi.samples.formats.text import SPACES, Cells, Source, is_text
from dusttaichi.scene import quantities

COMPONENTS = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "spin": ("wx", "wy", "wz"),
}
VECTORS = {
    "position": "pos position positions point points coord coords coordinate coordinates center "
    "centre r",
    "velocity": "v vel velo velocity velocities",
    "spin": "w omega spin angvel ang_vel angular_velocity angularvelocity",
    "angular_momentum": "angmom angular_momentum angularmomentum",
}
SCALARS = {
    "radius": "radius r rad radii particle_radius",
    "diameter": "diameter d diam particle_diameter",
    "mass": "mass m masses",
    "density": "density rho",
    "type": "type particle_type atom_type",
    "matid": "matid mat_id material_id",
    "material": "material materials",
    "species": "species element symbol atom",
    "id": "id index particle_identifier particle_id atom_id identifier",
}
STEMS = {stem: name for name, stems in VECTORS.items() for stem in stems.split()}
_SCALARS = {alias: name for name, aliases in SCALARS.items() for alias in aliases.split()}
NAMES = {"": "id", "unnamed_0": "id"} | _SCALARS  # pandas' column without a name is the index
DIMENSIONS = {
    "position": "length",
    "velocity": "speed",
    "spin": "angular velocity",
    "radius": "length",
    "diameter": "length",
    "mass": "mass",
    "density": "density",
}
IGNORED = ("_", "-")  # names of a column that is not read; YAML wants quotes about the second
OTHER = "~"  # in front of a name that means something else in its format
_BRACKETS = re.compile(r"(.+?)\s*[\[(]([^\])]*)[\])]")
_SUFFIX = re.compile(
    r"(.+?)[ _/]+(pm|nm|um|µm|μm|mm|cm|m|km|micron|angstrom|(?:m|cm|mm|um)_(?:per_)?s"
    r"|rad_(?:per_)?s|kg|g|pg|kg_m3|g_cm3)"
)


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


def known(name: str) -> tuple[str, int | None] | None:
    """Quantity and component (0 to 2, None of a scalar) of a name; None for an unknown one."""
    name = re.sub(r"[\s.:_]+", "_", name.strip().lower())
    if name in NAMES:
        return NAMES[name], None
    if match := re.fullmatch(r"([xyz])_?(.*)", name):  # x, x_center, z_velocity
        if (stem := match[2]) == "" or stem in STEMS:
            return STEMS.get(stem, "position"), "xyz".index(match[1])
    if (match := re.fullmatch(r"(\w+?)_?([xyz012])", name)) and match[1] in STEMS:
        return STEMS[match[1]], "xyz012".index(match[2]) % 3
    return None


def heading(text: str, source: Source) -> tuple[str, float | None]:
    """Name of a column and SI value of the unit that it names, as in `x [um]`, `x (µm)`, `x_um`."""
    whole = text = text.strip().strip("\"'")
    unit = None
    if match := _BRACKETS.fullmatch(text):
        text, unit = match.groups()
    elif known(text) is None and (match := _SUFFIX.fullmatch(text)) and known(match[1]):
        text, unit = match[1], re.sub(r"_(?:per_)?", "/", match[2]).replace("m3", "m^3")
    if unit is None or (found := known(text)) is None:
        return whole, None
    quantity = found[0]
    if quantity not in DIMENSIONS:
        if unit.strip() in ("", "-", "1"):
            return text, None
        raise source.fault(f"the column {text!r} has the unit {unit!r}; allowed: none.")
    return text, unit_factor(unit, quantity, f"{source.where}, column {text}")


def unit_factor(unit: str, quantity: str, where: str) -> float:
    """SI value of a unit in a file. Raises DustError for one of another dimension."""
    return quantities.parse(f"1 {unit}", DIMENSIONS[quantity], where)


def is_complete(names) -> bool:
    """True where the names of columns have a position."""
    found = [known(name) for name in names]
    return all(("position", n) in found for n in range(3))


def words(text: str) -> list[str]:
    """Words of a heading between white space, commas and semicolons; units stay with theirs."""
    return re.findall(r"[^\s,;\[\]()]+(?:\s*[\[(][^\])]*[\])])?", text)


def names_in(text: str, width: int, source: Source) -> list[str] | None:
    """`width` names of columns in a sentence such as "atoms: id x y z r"; None without them."""
    found = words(text)
    plain = [heading(word, source)[0] for word in found]
    if len(found) == width and is_complete(plain):
        return found
    fits = [
        found[n : n + width]
        for n in range(len(found) - width + 1)
        if all(map(known, plain[n : n + width])) and is_complete(plain[n : n + width])
    ]
    return fits[0] if len(fits) == 1 else None


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
