"""Systems of units. A simulation counts in one (`SI`, grains in `GRAINS`); all else is in SI.

The constants are the SI values of one unit of grains (micrometre, microsecond, picogram): a number
of theirs times the constant is SI, an SI number divided by it is theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

LENGTH = 1e-6  # m
TIME = 1e-6  # s
MASS = 1e-15  # kg
SPEED = 1.0  # m/s
SPIN = 1e6  # rad/s
ACCELERATION = 1e6  # m/s^2
FORCE = 1e-9  # N
TORQUE = 1e-15  # N m
ENERGY = 1e-15  # J
PRESSURE = 1e3  # Pa
STIFFNESS = 1e-3  # N/m, and surface energy in J/m^2
DENSITY = 1e3  # kg/m^3
INERTIA = 1e-27  # kg m^2
DAMPING = 1e-9  # kg/s


class Units:
    """A system of units; called with an SI unit such as "kg/m^3", the SI value of its own.

    symbols: SI value of its unit in the place of each SI unit; without any, it is SI. Raises
    KeyError for a symbol that is not among them.
    """

    def __init__(self, symbols: Mapping[str, float] | None = None) -> None:
        self.symbols = symbols or {}
        self._factors: dict[str, float] = {}

    def __call__(self, unit: str) -> float:
        if unit not in self._factors:
            self._factors[unit] = self._value(unit)
        return self._factors[unit]

    def _value(self, unit: str) -> float:
        value = 1.0
        for n, factors in enumerate(unit.split("/") if self.symbols else ()):
            for factor in factors.split():
                symbol, _, power = factor.partition("^")
                exponent = (-1.0 if n else 1.0) * float(power or 1.0)
                value *= float(self.symbols[symbol] ** exponent)
        return value

    def si(self, number: Any, unit: str) -> Any:
        """A number or array of this system in the SI unit `unit`; whole numbers stay whole."""
        factor = self(unit)
        return number if factor == 1.0 else number * factor


SI = Units()
GRAINS = Units(
    {
        "m": LENGTH,
        "s": TIME,
        "kg": MASS,
        "N": FORCE,
        "J": ENERGY,
        "Pa": PRESSURE,
        "C": 1.0,
        "V": ENERGY,
        "T": MASS / TIME,
        "K": 1.0,
        "rad": 1.0,
        "1": 1.0,
    }
)
