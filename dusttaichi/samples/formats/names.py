"""Names of columns by many programs: the quantity and the unit that a name says.

Names are those of this program, LAMMPS, LIGGGHTS, YADE, OVITO, ParaView and ASE, in any case:
`x`, `Position.X`, `Points:0`, `velo`, `omegax`, `Radius`, `matId`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from dusttaichi.errors import DustError
from dusttaichi.samples.formats.contents import GRAINS, Contents
from dusttaichi.samples.formats.text import Source
from dusttaichi.scene import quantities

Meaning = tuple[str, int | None]  # quantity, and component from 0, None of a scalar
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
TENSOR = ("xx", "yy", "zz", "xy", "xz", "yz")  # components of a symmetric one, in this order
FULL_TENSOR = ("xx", "xy", "xz", "xy", "yy", "yz", "xz", "yz", "zz")  # row by row
DEVIATORS = ("deviator", "dev", "deviatoric_stress", "stress_deviator")
SCALARS = {
    "radius": "radius r rad radii particle_radius",
    "diameter": "diameter d diam particle_diameter",
    "mass": "mass m masses particle_mass",
    "density": "density rho ρ densities particle_density",
    "filling_factor": "filling_factor phi φ ϕ volume_fraction solid_fraction packing_fraction "
    "volume_filling_factor",
    "reference": "reference reference_density",
    "role": "role",
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
    "reference": "density",
    "deviator": "pressure",
}
NUMBERS = {"": 1.0, "-": 1.0, "1": 1.0, "%": 0.01}  # units of quantities without a dimension
TEXTS = ("material", "species", "type", "id")  # quantities that need not be numbers
IGNORED = ("_", "-")  # names of a column that is not read; YAML wants quotes about the second
OTHER = "~"  # in front of a name that means something else in its format
_BRACKETS = re.compile(r"(.+?)[\s/,]*[\[(]([^\])]*)[\])]")
_LENGTH = "pm|nm|um|µm|μm|mm|cm|dm|m|km|microns?|micrometers?|angstrom"
_PER = r"(?:_per_| per |_| ?/ ?)"
_UNIT = (
    rf"{_LENGTH}|(?:{_LENGTH}){_PER}s|rad{_PER}s|(?:kg|mg|g|pg)(?:{_PER}(?:m|cm|m\^?3|cm\^?3))?"
    "|[kMG]?Pa"
)
_SUFFIX = re.compile(rf"(.+?)(?:[ _/]+| in )({_UNIT})", re.IGNORECASE)


def find_quantity(name: str) -> tuple[str, int | None] | None:
    """Quantity and component (from 0, None of a scalar) of a name; None for an unknown one."""
    name = re.sub(r"[\s.:_]+", "_", name.strip().lower())
    if name in NAMES:
        return NAMES[name], None
    if match := re.fullmatch(r"([xyz])_?(.*)", name):  # x, x_center, z_velocity
        if (stem := match[2]) == "" or stem in STEMS:
            return STEMS.get(stem, "position"), "xyz".index(match[1])
    if (match := re.fullmatch(r"(\w+?)_?([xyz012])", name)) and match[1] in STEMS:
        return STEMS[match[1]], "xyz012".index(match[2]) % 3
    return _of_tensor(name)


def _of_tensor(name: str) -> tuple[str, int] | None:
    """`deviator` and the component of xx, deviator_yx, deviator:8, or None."""
    match = re.fullmatch(rf"(?:(?:{'|'.join(DEVIATORS)})_?)?([xyz]{{2}})", name)
    if match:
        return "deviator", TENSOR.index("".join(sorted(match[1])))
    match = re.fullmatch(rf"(?:{'|'.join(DEVIATORS)})_?([0-8])", name)
    return ("deviator", TENSOR.index(FULL_TENSOR[int(match[1])])) if match else None


def heading(text: str, source: Source) -> tuple[str, float | None]:
    """Name of a column and SI value of the unit that it names, as in `x [um]`, `x (µm)`, `x_um`."""
    full_text = text = text.strip().strip("\"'").strip()
    unit = None
    if match := _BRACKETS.fullmatch(text):
        text, unit = match.groups()
        unit = unit.lower() if unit in ("MM", "UM", "NM", "CM", "KG", "M") else unit
    elif (
        find_quantity(text) is None
        and (match := _SUFFIX.fullmatch(text))
        and find_quantity(match[1])
    ):
        text, unit = match[1], _plain_unit(match[2])
    if unit is None or (column := find_quantity(text)) is None:
        return full_text, None
    quantity = column[0]
    if quantity not in DIMENSIONS:
        if unit.strip() not in NUMBERS:
            raise source.fault(f"the column {text!r} has the unit {unit!r}; allowed: none.")
        factor = NUMBERS[unit.strip()]
        return text, None if factor == 1.0 else factor
    return text, unit_factor(unit, quantity, f"{source.name}, column {text}", source.contents)


def is_unit(text: str) -> bool:
    """True for a unit that a column may have, alone in its cell."""
    return re.fullmatch(_UNIT, text) is not None


def _plain_unit(text: str) -> str:
    """Unit that follows a name, as in vx_m_per_s, DENSITY_KG_M3."""
    text = text if "pa" in text.lower() else text.lower()  # MPa, not mPa
    return re.sub(r"_(?:per_)?| per ", "/", text).replace("m3", "m^3")


def unit_factor(unit: str, quantity: str, origin: str, contents: Contents = GRAINS) -> float:
    """SI value of a unit in a file. Raises DustError for one of another dimension.

    A mass in a plane is per metre of depth, in kg or kg/m.
    """
    text = f"1 {unit}"
    if contents.plane and quantity == "mass":
        try:
            return quantities.parse(text, "mass", origin)
        except DustError:
            return quantities.parse(text, "mass per length", origin)
    return quantities.parse(text, DIMENSIONS[quantity], origin)


def is_complete(names: Iterable[str], contents: Contents = GRAINS) -> bool:
    """True where the names of columns have a position; in a plane x and y are one, too."""
    components = {axis for quantity, axis in filter(None, map(find_quantity, names))
                  if quantity == "position"}  # fmt: skip
    return components >= set(contents.axes) or (contents.plane and components >= {0, 1})


def words(text: str) -> list[str]:
    """Words of a heading between white space, commas and semicolons; units stay with theirs."""
    return re.findall(r"[^\s,;\[\]()]+(?:\s*[\[(][^\])]*[\])])?", text)


def names_in(text: str, width: int, source: Source) -> list[str] | None:
    """`width` names of columns in a sentence such as "atoms: id x y z r"; None without them."""
    candidates = words(text)
    plain = [heading(word, source)[0] for word in candidates]
    if len(candidates) == width and is_complete(plain, source.contents):
        return candidates
    fits = [
        candidates[n : n + width]
        for n in range(len(candidates) - width + 1)
        if all(map(find_quantity, plain[n : n + width]))
        and is_complete(plain[n : n + width], source.contents)
    ]
    return fits[0] if len(fits) == 1 else None
