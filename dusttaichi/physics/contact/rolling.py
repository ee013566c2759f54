"""Rolling: xi = R (n1 + n2), U = 1/2 k_r xi^2 (S12 eqs 8, 11, 12, 17), inelastic past xi_crit.

On a wall n2 = n_w is fixed, R = r (S12 eqs 21-23). The spring pulls on the contact pointers with
dU/dn_i = R k_r xi, which turns grain i by the torque R k_r xi x n_i.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import Constant
from dusttaichi.physics.contact.limit import limit_displacement

NUMBERS = {
    "k_r": Constant("N/m", "rolling stiffness"),
    "xi_crit": Constant("m", "largest elastic rolling displacement"),
}
HISTORY = {}  # xi itself is part of every contact (physics.contact.kinematics)
CHANNEL = "rolling"


@ti.pyfunc
def numbers(c, block):
    """k_r = 4 F_c/R (S12 eq 17) times the modifier; xi_crit that of the materials."""
    return {"k_r": block.modifier * (4.0 * c.F_jkr / c.R), "xi_crit": c.xi_crit}


@ti.pyfunc
def energy(xi, constants):
    """U = 1/2 k_r xi^2."""
    return 0.5 * constants.k_r * xi.dot(xi)


@ti.func
def update(motion: ti.template(), history: ti.template(), constants, dt):
    """xi back within its limit (Wada et al. 2007); the energy dissipated."""
    past = limit_displacement(history.xi, constants.xi_crit, constants.k_r)
    history.xi = history.xi * (1.0 - past.over)
    return past.lost


@ti.func
def evaluate(motion: ti.template(), history: ti.template(), constants, load: ti.template()):
    """Adds the pull on both pointers; the energy stored."""
    pull = history.xi * (constants.R * constants.k_r)
    load.pull_1 += pull
    load.pull_2 += pull
    return energy(history.xi, constants)
