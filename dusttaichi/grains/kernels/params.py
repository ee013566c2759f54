"""The numbers of a contact as kernels have them: a struct made from what the laws declare.

Where all grains are equal they are a kernel argument, so that a change of number does not recompile
a kernel; where grains differ they are lanes (kernels.polydisperse). Both have the same names.
"""

from functools import cache

import taichi as ti

from dusttaichi import units
from dusttaichi.physics.contact.numbers import Number

RADII = {
    "r1": Number("m", "radius of the first grain"),
    "r2": Number("m", "radius of the second grain, 0 for a wall"),
    "inv_r1": Number("m^-1", "one over r1"),
    "inv_r2": Number("m^-1", "one over r2, 0 for a wall"),
    "R": Number("m", "reduced radius, r1 on a wall"),
    "touch": Number("m", "distance of centres (centre and wall) at first touch"),
    "inv_touch": Number("m^-1", "one over touch"),
    "mass": Number("kg", "reduced mass"),
}
"""What every contact has, whatever its laws."""
WIDE = ("touch",)  # in the precision of positions: overlaps are small differences from it


def declared(laws):
    """Name -> Number of all numbers of a contact."""
    return {**RADII, **laws.numbers}


@cache
def params_type(laws, geometry=ti.f64, law=ti.f64):
    """The struct ContactParams of these laws with these float types."""
    return ti.types.struct(**{name: geometry if name in WIDE else law for name in declared(laws)})


@cache
def lanes_type(laws, width, geometry=ti.f64, law=ti.f64):
    """The same with a vector of `width` lanes for each number."""
    return ti.types.struct(
        **{
            name: ti.types.vector(width, geometry if name in WIDE else law)
            for name in declared(laws)
        }
    )


def internal_numbers(contact, laws):
    """All numbers of a contact by name, internal units; contact: ContactConstants."""
    r1, wall = contact.r1 / units.LENGTH, contact.r2 == float("inf")
    r2 = 0.0 if wall else contact.r2 / units.LENGTH
    own = {
        "r1": r1,
        "r2": r2,
        "inv_r1": 1.0 / r1,
        "inv_r2": 0.0 if wall else 1.0 / r2,
        "R": contact.R / units.LENGTH,
        "touch": r1 + r2,
        "inv_touch": 1.0 / (r1 + r2),
        "mass": contact.mass / units.MASS,
    }
    for name, number in laws.numbers.items():
        own[name] = contact.numbers[name] / units.internal(number.unit)
    return own


def contact_params(contact, laws, layout):
    """ContactParams in internal units (um, us, pg) from SI ContactConstants."""
    return params_type(laws, layout.geometry, layout.law)(**internal_numbers(contact, laws))
