"""What a law says of each number that a contact stores for it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    """One number of a contact: its SI unit, such as "N/m", and what it is.

    geometry: True for lengths and angles that displacements are compared with, which stay in double
    precision where forces are in single.
    """

    unit: str
    meaning: str
    geometry: bool = False
