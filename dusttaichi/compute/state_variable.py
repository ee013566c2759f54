"""Declaration of a variable of the state of a method, and its Taichi field."""

from dataclasses import dataclass

from dusttaichi.compute.engine import ti

ELEMENTS = {"f64": ti.f64, "f32": ti.f32, "i32": ti.i32, "i64": ti.i64}


@dataclass(frozen=True)
class StateVariable:
    """A variable of the state.

    Name, meaning, unit and element (name in ELEMENTS, components of a vector or 0).
    """

    name: str
    meaning: str
    unit: str
    element: tuple

    def field(self, **layout):
        """Taichi field with this element; layout: its shape and order, none to place it later."""
        dtype, length = ELEMENTS[self.element[0]], self.element[1]
        return ti.Vector.field(length, dtype, **layout) if length else ti.field(dtype, **layout)
