"""Dimensions of quantities: names, SI units, examples, and the range of their numbers."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Dimension:
    """Kind of quantity: its name, its SI unit, an example, and the units that `format` uses.

    powers: unit -> power of ten relative to the SI unit; the first listed wins a tie. least, most:
    sizes in SI between which a number other than 0 must be: far outside of the physical range, and
    within the range of numbers that can be computed with. plural: by default that of the name.
    """

    name: str
    unit: str
    example: str
    powers: dict[str, int]
    least: float
    most: float
    _plural: str = ""

    @property
    def plural(self) -> str:
        """Name of several such quantities."""
        name = self.name.partition(" ")[2]
        return self._plural or (f"{name[:-1]}ies" if name.endswith("y") else f"{name}s")


_LENGTHS = {"m": 0, "mm": -3, "um": -6, "nm": -9, "pm": -12}
_TIMES = {"s": 0, "ms": -3, "us": -6, "ns": -9, "ps": -12}
_FORCES = {"N": 0, "uN": -6, "nN": -9, "pN": -12}
_PRESSURES = {"GPa": 9, "MPa": 6, "kPa": 3, "Pa": 0}
_ROWS = (
    ("a length", "m", "0.6 um", _LENGTHS, 1e-25, 1e7),
    ("an area", "m^2", "300 um^2", {"m^2": 0, "um^2": -12}, 1e-40, 1e14),
    ("a time", "s", "0.3 ns", _TIMES, 1e-25, 1e9),
    ("a mass", "kg", "2.4 pg", {"kg": 0, "g": -3, "pg": -15}, 1e-30, 1e9, "masses"),
    ("a speed", "m/s", "1 cm/s", {"m/s": 0, "cm/s": -2, "um/s": -6}, 1e-20, 3e8),
    ("an acceleration", "m/s^2", "9.81 m/s^2", {"m/s^2": 0}, 1e-20, 1e15),
    ("an angle", "rad", "30 deg", {"rad": 0}, 1e-20, 1e6),
    ("an angular velocity", "rad/s", "1e5 rad/s", {"rad/s": 0, "rad/us": 6}, 1e-20, 1e15),
    ("a rate", "s^-1", "1e3 s^-1", {"s^-1": 0}, 1e-20, 1e15),
    ("a force", "N", "57 nN", _FORCES, 1e-30, 1e6),
    ("an energy", "J", "1 fJ", {"J": 0, "fJ": -15, "aJ": -18}, 1e-40, 1e12),
    ("a pressure", "Pa", "10 kPa", _PRESSURES, 1e-15, 1e15),
    ("a density", "kg/m^3", "2.65 g/cm^3", {"g/cm^3": 3, "kg/m^3": 0}, 1e-9, 1e9),
    ("a surface energy", "J/m^2", "20 mJ/m^2", {"mJ/m^2": -3, "J/m^2": 0}, 1e-15, 1e6),
    ("a stiffness", "N/m", "0.75 N/m", {"N/m": 0}, 1e-20, 1e12, "stiffnesses"),
    ("a temperature", "K", "280 K", {"K": 0}, 1e-6, 1e9),
    ("a heat capacity", "J/(kg K)", "800 J/(kg K)", {"J/(kg K)": 0}, 1e-6, 1e9),
    ("a mass per length", "kg/m", "3 g/m", {"kg/m": 0, "g/m": -3}, 1e-30, 1e9, "masses per length"),
    ("a charge", "C", "1e-17 C", {"C": 0, "fC": -15, "aC": -18}, 1e-25, 1e3),
    ("a charge per area", "C/m^2", "1e-6 C/m^2", {"C/m^2": 0}, 1e-20, 1e6, "charges per area"),
    ("a charge per mass", "C/kg", "1e-3 C/kg", {"C/kg": 0}, 1e-20, 1e12, "charges per mass"),
    ("an electric field", "V/m", "1e4 V/m", {"V/m": 0, "kV/m": 3}, 1e-15, 1e12),
    ("a magnetic field", "T", "1 mT", {"T": 0, "mT": -3}, 1e-20, 1e6),
    ("a mass rate", "kg/s", "1e-6 g/s", {"g/s": -3, "kg/s": 0}, 1e-30, 1e9),
)  # fmt: skip
DIMENSIONS = {row[0].partition(" ")[2]: Dimension(*row) for row in _ROWS}
