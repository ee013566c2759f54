"""Quantities that a sample reads from the columns of a file; those of grains."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Contents:
    """Quantities that a sample reads from a file, and words about them for messages.

    Attributes
    ----------
    noun : str
        "grains" or "particles".
    quantities : frozenset of str
        Names of formats.names; columns of all others are listed as not read.
    columns : str
        The columns of a list, those that it needs first.
    vectors : str
        The components that a file has together.
    example : str
        Names in the order of a list, for the key `columns`.
    plane : bool
        True in two dimensions: the plane is x-z, and masses are per metre of depth.
    needs_mass : bool
        True where masses are needed, which are in SI where a file does not say.
    fills_zeros : bool
        True where components of vectors that a file does not have are 0.
    history : frozenset of str
        Variables in results of this program on the past of the particles that are not read.
    """

    noun: str
    quantities: frozenset[str]
    columns: str
    vectors: str
    example: str
    plane: bool = False
    needs_mass: bool = False
    fills_zeros: bool = False
    history: frozenset[str] = frozenset()

    @property
    def axes(self) -> tuple[int, ...]:
        """Numbers of the axes along which positions are needed."""
        return (0, 2) if self.plane else (0, 1, 2)


GRAINS = Contents(
    noun="grains",
    quantities=frozenset(
        "position velocity spin angular_momentum radius diameter mass density type matid material "
        "species id".split()
    ),
    columns="x y z and optionally vx vy vz, wx wy wz, radius and material",
    vectors="x, y, z, and vx, vy, vz or wx, wy, wz all three or none",
    example="x, y, z, radius",
)
