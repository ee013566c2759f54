"""Sliding: U = 1/2 k_s zeta^2, zeta = the arm without its part along n_c, inelastic past zeta_crit.

The arm of two grains is r1 n1 - r2 n2 (S12 eqs 9, 13, 14, 18); on a wall it is x + r n1 - foot
(S12 eqs 24, 25), where `foot` is the point of the wall that the contact started from.
"""

from math import pi

import taichi as ti

from dusttaichi.physics.contact.limit import limited
from dusttaichi.physics.contact.numbers import Number

NUMBERS = {
    "k_s": Number("N/m", "sliding stiffness"),
    "zeta_crit": Number("m", "sliding displacement past which sliding costs energy"),
}


@ti.pyfunc
def numbers(c, own):
    """k_s = 8 a0 G* (S12 eq 18) times the modifier; zeta_crit = (2 - nu) a0/(16 pi) (S12 sect.
    2.1.6)."""
    return {
        "k_s": own.modifier * (8.0 * c.a0 * c.G_star),
        "zeta_crit": (2.0 - c.nu) * c.a0 / (16.0 * pi),
    }


@ti.pyfunc
def displacement(arm, nc, p):
    """zeta (S12 eqs 9, 24)."""
    return arm.minus(nc.times(arm.dot(nc)))


@ti.pyfunc
def energy(zeta, p):
    """U = 1/2 k_s zeta^2."""
    return 0.5 * p.k_s * zeta.dot(zeta)


@ti.pyfunc
def stiffness(zeta, p):
    """dU/dzeta = stiffness zeta."""
    return p.k_s


@ti.func
def correct(zeta, rate, p):
    """How far zeta is past its limit, see `limit.limited`; rate: dzeta/dt."""
    return limited(zeta, p.zeta_crit, p.k_s)
