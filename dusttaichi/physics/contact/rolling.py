"""Rolling: xi = R (n1 + n2), U = 1/2 k_r xi^2 (S12 eqs 8, 11, 12, 17), inelastic past xi_crit.

On a wall n2 = n_w is fixed, R = r (S12 eqs 21-23). The springs pull on the contact pointers with
A_i = dU/dn_i = R stiffness xi, which turns grain i by the torque A_i x n_i.
"""

import taichi as ti

from dusttaichi.physics.contact.limit import limited
from dusttaichi.physics.contact.numbers import Number

NUMBERS = {
    "k_r": Number("N/m", "rolling stiffness"),
    "xi_crit": Number("m", "rolling displacement past which rolling costs energy"),
}


@ti.pyfunc
def numbers(c, own):
    """k_r = 4 F_c/R (S12 eq 17) times the modifier; xi_crit that of the materials."""
    return {"k_r": own.modifier * (4.0 * c.F_jkr / c.R), "xi_crit": c.xi_crit}


@ti.pyfunc
def displacement(n1, n2, p):
    """xi (S12 eq 8)."""
    return n1.plus(n2).times(p.R)


@ti.pyfunc
def energy(xi, p):
    """U = 1/2 k_r xi^2."""
    return 0.5 * p.k_r * xi.dot(xi)


@ti.pyfunc
def stiffness(xi, p):
    """dU/dxi = stiffness xi."""
    return p.k_r


@ti.func
def correct(xi, rate, p):
    """How far xi is past its limit (Wada et al. 2007), see `limit.limited`; rate: dxi/dt."""
    return limited(xi, p.xi_crit, p.k_r)
