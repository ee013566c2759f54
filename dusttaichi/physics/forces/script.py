"""Forces that a Python script sets between steps, on each particle its block."""

from dusttaichi.compute.engine import ti

NUMBERS = {}
USES_SCRIPT = True
USES_VELOCITY = False


def numbers(block):
    """None: the forces are in a field."""
    return {}


@ti.func
def acceleration(constants, particle):
    """The force over the mass."""
    return particle.script_force / particle.mass
