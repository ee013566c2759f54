"""Order of columns that have no names: what their values allow, or a request for the key."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.contact.constants import CLOSEST
from dusttaichi.physics.geometry import pairs_within
from dusttaichi.samples.formats.names import IGNORED, find_quantity, is_complete
from dusttaichi.samples.formats.text import Source, is_integer_column, is_text

if TYPE_CHECKING:
    from dusttaichi.errors import DustError

LOOKED_AT = 2000  # grains: an overlap among them refuses an order
TOUCHING = 1e-3  # gap or overlap over the sum of two radii, up to which disks touch
KEY = (
    "sample.columns names them in their order, for example columns: [{}], with _ for one that is "
    "not read"
)


def guess(values: list[NDArray[Any]], source: Source, row: int) -> list[str]:
    """Names of the columns of unnamed rows, of which `row` is the first.

    Three numbers are x y z, unless they are disks x y r that touch; a text and three numbers are
    species x y z, a number from 1 on in addition id. Four numbers are x y z r or r x y z, or x y z
    behind a number of an element or grain: the one in which radii are positive, and no grains
    overlap by more than any sample may. Raises DustError where none or several are left.
    """
    column_types = "".join("t" if is_text(column) else "n" for column in values)
    if source.contents.needs_mass:
        raise _unknown_order(column_types, source, row, source.contents.example)
    if column_types in ("nnn", "tnnn") or (column_types == "ntnnn" and _counts(values[0])):
        _refuse_disks(values[-3:], source, row)
        return ["id", "species", "x", "y", "z"][-len(column_types) :]
    if column_types != "nnnn":
        example = "x, y, z, radius" if column_types.startswith("n") else "species, x, y, z, radius"
        raise _unknown_order(column_types, source, row, example)
    orders = {"x y z r": (0, 1, 2, 3), "r x y z": (1, 2, 3, 0)}
    fits = [names for names, order in orders.items() if are_apart([values[n] for n in order])]
    if is_integer_column(values[0], 0):  # numbers of elements or grains
        fits.append("id x y z" if _counts(values[0]) else "type x y z")
    if len(fits) == 1 and fits[0][0] in "xr":
        source.remarks.append(
            f"its columns are read as {fits[0]}, the only order in which radii are positive and no "
            "grains overlap too much (sample.columns names another one)"
        )
        return fits[0].split()
    if len(fits) == 1:
        _refuse_disks(values[1:], source, row)
        source.remarks.append(f"its columns are read as {fits[0]} (sample.columns names others)")
        return ["species" if fits[0].startswith("type") else "id", "x", "y", "z"]
    description = f"can be {' or '.join(fits)}" if fits else f"are neither {' nor '.join(orders)}"
    raise source.fault(
        f"its four columns have no names, and by their values (radii positive, no grains closer "
        f"than {CLOSEST} diameters) {description}; {KEY.format('x, y, z, radius')}."
    )


def _unknown_order(column_types: str, source: Source, row: int, example: str) -> DustError:
    return source.fault(
        f"its columns have no names, and {source.quote(row)} has {len(column_types)}, whose order "
        "is "
        f"not known; {KEY.format(example)}."
    )


def _refuse_disks(columns: Sequence[NDArray[Any]], source: Source, row: int) -> None:
    """Raise DustError where three columns can be x, y and radius of disks, some of which touch."""
    x, y, r = (np.asarray(column, float)[:LOOKED_AT] for column in columns)
    disks = [x, y, np.zeros_like(x), r]
    if len(x) < 2 or not are_apart(disks):
        return
    i, j, distance = pairs_within(np.column_stack(disks[:3]), r, 1.0 + TOUCHING)
    if np.any(distance > (1.0 - TOUCHING) * (r[i] + r[j])):
        raise source.fault(
            f"its columns have no names, and {source.quote(row)} and the others can be x y z, or "
            "x y r of disks, some of which touch; "
            f"{KEY.format('x, y, z')}. Disks need a column z as well, of 0 for a layer."
        )


def _counts(values: NDArray[Any]) -> bool:
    """True for consecutive whole numbers from 0 or 1 on."""
    return (
        is_integer_column(values, 0) and bool(np.all(np.diff(values) == 1)) and values[0] in (0, 1)
    )


def are_apart(columns: Sequence[NDArray[Any]]) -> bool:
    """True where the columns x, y, z, r are spheres that do not overlap much."""
    x = np.column_stack(columns)[:LOOKED_AT]
    if not np.isfinite(x).all() or np.any(columns[3] <= 0):
        return False
    return len(x) < 2 or not len(pairs_within(x[:, :3], x[:, 3], CLOSEST * (1.0 - 1e-9))[0])


COLUMN_NAMES = (
    "x y z, vx vy vz, wx wy wz, radius or r, diameter, mass, density, type, matId, material, "
    "species, id; of a dump also xs, xu, xsu; _ for a column that is not read"
)
_FORMS = ("", "s", "u", "su")


def _plain(name: str) -> str:
    """Name of a column without its unit."""
    return re.sub(r"\s*[\[(].*", "", name).strip()


def is_column(name: str) -> bool:
    """True for a name that `sample.columns` can have."""
    name = _plain(name)
    return name in IGNORED or find_quantity(name) is not None or _form(name) is not None


def _form(name: str) -> str | None:
    return name[1:].lower() if name[:1].lower() in "xyz" and name[1:].lower() in _FORMS else None


def has_position(names: Sequence[str]) -> bool:
    """True where the names have x, y and z in one form."""
    plain = [_plain(name) for name in names]
    low = [name.lower() for name in plain]
    return is_complete(plain) or any(all(axis + form in low for axis in "xyz") for form in _FORMS)
