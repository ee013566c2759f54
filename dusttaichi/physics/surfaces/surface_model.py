"""The curved surfaces of a scene and their numbers: a row of a table for each."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

# columns behind the numbers of a law and their rates: displacement at time 0, velocity, angular
# velocity (3 each), factor on the springs, principal curvatures (2), length of a step
SHIFT, VELOCITY, SPIN, STRENGTH, CURVATURE, STEP = 0, 3, 6, 9, 10, 12
MOTION_COLUMNS = 13


@dataclass(frozen=True)
class SurfaceModel:
    """Laws of the surfaces of a scene in their order (members: `physics.surfaces`)."""

    laws: tuple = ()

    def __bool__(self):
        return bool(self.laws)

    def __len__(self):
        return len(self.laws)

    @cached_property
    def columns(self):
        """For each law a tuple of its numbers: (name, first column, components)."""
        out = []
        for law in self.laws:
            column, row = 0, []
            for name, number in law.NUMBERS.items():
                row.append((name, column, number.components))
                column += number.components
            out.append(tuple(row))
        return tuple(out)

    @cached_property
    def width(self):
        """Columns of the numbers of the law that has most."""
        counts = [sum(n.components for n in law.NUMBERS.values()) for law in self.laws]
        return max(counts, default=0)

    @property
    def motion(self):
        """First column behind the numbers and their rates."""
        return 2 * self.width

    @property
    def row_length(self):
        """Columns of the table."""
        return self.motion + MOTION_COLUMNS


def reduced_radius(radius: Any, curvatures: Sequence[float]) -> Any:
    """Reduced radius of a sphere on a surface of two principal curvatures.

    The relative curvatures are 1/R' = 1/r - k', 1/R'' = 1/r - k''; where they differ the contact is
    an ellipse, and its equivalent radius sqrt(R' R'') (Johnson 1985, Contact Mechanics, sect. 4.2)
    is used for both: approach and mean radius of Hertz's ellipse are then right to 0.1 % up to
    R'/R'' = 1.25 and to 0.7 % up to 2. A surface must bend around less than the sphere: k < 1/r.
    """
    first, second = (1.0 / radius - k for k in curvatures)
    if curvatures[0] == curvatures[1]:
        return 1.0 / first
    return (first * second) ** -0.5
