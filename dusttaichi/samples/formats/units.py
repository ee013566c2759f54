"""Units of LAMMPS."""

import re

from dusttaichi.samples.formats.columns import Units
from dusttaichi.samples.formats.text import Source

_GRAM_PER_MOL = 1e-3 / 6.02214076e23
UNITS = {  # length [m], speed [m/s], spin [rad/s], mass [kg], density [kg/m^3], time [s]
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
    if name not in UNITS:
        raise source.fault(f"its units are {name!r}; allowed: {', '.join(UNITS)}.")
    if source.length not in (1.0, UNITS[name].length):
        source.remarks.append(f"it names its units ({name}), so that sample.units is not used")
    return UNITS[name]


def named_in(title: str) -> str | None:
    """Units that the first line of a data file names, `units = micro`."""
    match = re.search(rf"\bunits\s*=\s*(\w+)|\bunits\s+({'|'.join(UNITS)}|lj|electron)\b", title)
    return None if match is None else match[1] or match[2]
