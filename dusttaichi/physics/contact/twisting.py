"""Twisting: dphi/dt = (w1 - w2).n_c, U = 1/2 k_t phi^2, M1 = -k_t phi n_c (S12 eqs 10, 16, 19).

Clamped to +-phi_crit. On a wall w2 = 0 (S12 eqs 26, 27).
"""

from math import pi

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import Constant, History

NUMBERS = {
    "k_t": Constant("N m", "twisting stiffness"),
    "phi_crit": Constant("rad", "largest elastic twisting angle"),
}
HISTORY = {"twist": History("rad", "twisting angle", result="twist")}
CHANNEL = "twisting"


@ti.pyfunc
def numbers(c, block):
    """k_t = (16/3) G a0^3 with 1/G = 1/G1 + 1/G2 (S12 eq 19) times the modifier.

    On a wall a0 is that of a pair; phi_crit = 1/(16 pi) (S12 sect. 2.1.6). A softened contact has
    the same of both: G a0^3 does not depend on the moduli.
    """
    return {
        "k_t": block.modifier * (16.0 / 3.0 * c.G * c.a0_pair**3),
        "phi_crit": 1.0 / (16.0 * pi) + 0.0 * c.R,
    }


@ti.pyfunc
def energy(phi, constants):
    """U = 1/2 k_t phi^2."""
    return 0.5 * constants.k_t * phi * phi


@ti.func
def update(motion: ti.template(), history: ti.template(), constants, dt):
    """Update the twist within its limits; returns the energy dissipated."""
    phi = history.twist + (motion.rotation_1 - motion.rotation_2).dot(motion.middle)
    history.twist = ti.min(ti.max(phi, -constants.phi_crit), constants.phi_crit)
    return constants.k_t * history.twist * (phi - history.twist)


@ti.func
def evaluate(motion: ti.template(), history: ti.template(), constants, load: ti.template()):
    """Adds the torque about n_c; the energy stored."""
    torque = motion.normal * (constants.k_t * history.twist)
    load.torque_1 -= torque
    load.torque_2 += torque
    return energy(history.twist, constants)
