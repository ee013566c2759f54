"""Declaration of the constants of a force."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    """A constant of a force: its SI unit, such as "m/s^2", and its components (1 or 3)."""

    unit: str
    components: int = 1
