"""Sliding: U = 1/2 k_s zeta^2 (S12 eqs 9, 13, 14, 18), inelastic past zeta_crit.

zeta is the arm r1 n1 - r2 n2 without its component along n_c; on a wall x + r n1 - foot (S12 eqs
24, 25), where `foot` is the point of the wall that the contact started from. The spring pulls on
the pointers with dU/dn_1 = r1 k_s zeta and dU/dn_2 = -r2 k_s zeta, and on the first grain with the
force k_s zeta (r1 n1 - r2 n2).n_c/d (S12 eq 13), on a wall -k_s zeta.
"""

from math import pi

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import Constant
from dusttaichi.physics.contact.limit import limit_displacement

NUMBERS = {
    "k_s": Constant("N/m", "sliding stiffness"),
    "zeta_crit": Constant("m", "largest elastic sliding displacement"),
}
HISTORY = {}  # zeta itself is part of every contact (physics.contact.kinematics)
CHANNEL = "sliding"


@ti.pyfunc
def numbers(c, block):
    """k_s = 8 a0 G* (S12 eq 18) times the modifier; zeta_crit = (2 - nu) a0/(16 pi).

    The latter after S12 sect. 2.1.6. A softened contact has the k_s of its moduli, which goes with
    s^(2/3), and slides at the same force: zeta_crit goes with s^(-2/3), of which a0 has s^(-1/3).
    """
    return {
        "k_s": block.modifier * (8.0 * c.a0 * c.G_star),
        "zeta_crit": (2.0 - c.nu) * c.a0 / (16.0 * pi) * c.stiffness_scaling ** (-1.0 / 3.0),
    }


@ti.pyfunc
def energy(zeta, constants):
    """U = 1/2 k_s zeta^2."""
    return 0.5 * constants.k_s * zeta.dot(zeta)


@ti.func
def update(motion: ti.template(), history: ti.template(), constants, dt):
    """zeta back within its limit; the energy dissipated."""
    past = limit_displacement(history.zeta, constants.zeta_crit, constants.k_s)
    history.zeta = history.zeta * (1.0 - past.over)
    return past.lost


@ti.func
def evaluate(motion: ti.template(), history: ti.template(), constants, load: ti.template()):
    """Adds force and pulls; the energy stored."""
    load.force += history.zeta * (constants.k_s * motion.lever)
    load.pull_1 += history.zeta * (constants.r1 * constants.k_s)
    load.pull_2 -= history.zeta * (constants.r2 * constants.k_s)
    return energy(history.zeta, constants)
