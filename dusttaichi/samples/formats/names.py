"""Names of columns by many programs: the quantity and the unit that a name says.

Names are those of this program, LAMMPS, LIGGGHTS, YADE, OVITO, ParaView and ASE, in any case:
`x`, `Position.X`, `Points:0`, `velo`, `omegax`, `Radius`, `matId`.
"""

import re

from dusttaichi.samples.formats.text import Source
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
