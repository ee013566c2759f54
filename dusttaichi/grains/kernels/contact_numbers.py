"""The constants of a contact as kernels have them: a struct made from what the laws declare.

Where all grains are equal they are a row of the field `numbers` for each kind of contact, so that a
change of number does not recompile a kernel; where grains differ they are rows of each contact
(kernels.polydisperse). Kernels read them beside their loops over contacts: as values, which no
store in the loop can change.
"""

from functools import cache
from types import SimpleNamespace

from dusttaichi import units
from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import Constant

PAIR, WALL, RIGID_SPHERE, CURVED = range(4)  # kinds of contact, rows of `numbers`; surfaces follow
RADII = {
    "r1": Constant("m", "radius of the first grain"),
    "r2": Constant("m", "radius of the second grain, 0 for a wall"),
    "inv_r1": Constant("m^-1", "one over r1"),
    "inv_r2": Constant("m^-1", "one over r2, 0 for a flat wall"),
    "R": Constant("m", "reduced radius, r1 on a flat wall"),
    "touch": Constant("m", "distance of centres (centre and wall) at first touch"),
    "inv_sum": Constant("m^-1", "one over the sum of the radii, 0 for a flat wall"),
    "mass": Constant("kg", "reduced mass"),
}
"""Numbers of every contact, whatever its laws."""


def list_numbers(model):
    """Name -> Constant of all numbers of a contact."""
    return {**RADII, **model.numbers}


@cache
def numbers_type(model, dtype):
    """The struct of these numbers in float type `dtype`."""
    return ti.types.struct(**{name: dtype for name in list_numbers(model)})


def internal_numbers(contact, model):
    """All numbers of a contact by name, internal units.

    Beside those that kernels have its `delta0`, `bound`, `gap`, and `far`: gap of the surfaces up
    to which it may exist. contact: ContactConstants.
    """
    r1, wall = contact.r1 / units.LENGTH, contact.r2 == float("inf")
    r2 = 0.0 if wall else contact.r2 / units.LENGTH
    R = contact.R / units.LENGTH
    # of a wall 0; of a curved surface that of the sphere which its reduced radius has
    bend = 1.0 / R - 1.0 / r1 if contact.R != contact.r1 else 0.0
    numbers = {
        "r1": r1,
        "r2": r2,
        "inv_r1": 1.0 / r1,
        "inv_r2": bend if wall else 1.0 / r2,
        "R": R,
        "touch": r1 + r2 + contact.gap / units.LENGTH,
        "inv_sum": bend * R / r1 if wall else 1.0 / (r1 + r2),
        "mass": contact.mass / units.MASS,
    }
    for name, number in model.numbers.items():
        numbers[name] = contact.numbers[name] / units.GRAINS(number.unit)
    delta0, bound = contact.delta0 / units.LENGTH, contact.bound / units.ENERGY
    gap = contact.gap / units.LENGTH
    return SimpleNamespace(
        **numbers, delta0=delta0, bound=bound, gap=gap, far=gap + numbers["reach"]
    )


@ti.data_oriented
class EqualNumbers:
    """Reads the numbers of a kind of contact, the same for all of them."""

    def __init__(self, fields, layout):
        self.table, self.touches = fields["numbers"], fields["touches"]
        self.Numbers = numbers_type(layout.model, layout.law)
        self.columns = range(len(list_numbers(layout.model)))

    @ti.func
    def of_kind(self, contact_kind):
        """Numbers of contacts of a kind, or of a surface, to be read beside a loop over them."""
        return self.Numbers(*[self.table[contact_kind, n] for n in self.columns])

    @ti.func
    def touch_of(self, contact_kind, b, lane):
        """Distance of the centres at first touch, in double precision."""
        return self.touches[contact_kind]

    @ti.func
    def of_contact(self, contact_kind: ti.template(), b, lane, p):
        """Numbers of the contact in a lane of block b; p: numbers of its kind of contact."""
        return p
