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
SURFACE_ENERGY = STIFFNESS
DENSITY = 1e3  # kg/m^3
INERTIA = 1e-27  # kg m^2
DAMPING = 1e-9  # kg/s
