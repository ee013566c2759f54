"""SI values of one internal unit (micrometre, microsecond, picogram).

An internal number times the constant is SI, an SI number divided by it is internal.
"""

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

SYMBOLS = {
    "m": LENGTH,
    "s": TIME,
    "kg": MASS,
    "N": FORCE,
    "J": ENERGY,
    "Pa": PRESSURE,
    "rad": 1.0,
    "1": 1.0,
}
"""SI value of the internal unit in the place of an SI unit."""


def internal(unit):
    """SI value of the internal unit in the place of the SI unit `unit`, such as "kg/m^3".

    Raises KeyError for a symbol that is not in SYMBOLS.
    """
    value = 1.0
    for n, part in enumerate(unit.split("/")):
        for factor in part.split():
            symbol, _, power = factor.partition("^")
            value *= SYMBOLS[symbol] ** ((-1.0 if n else 1.0) * float(power or 1.0))
    return value
