"""What a law says of each number that a contact stores for it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    """One number of a contact: its SI unit, such as "N/m", and what it is."""

    unit: str
    meaning: str
