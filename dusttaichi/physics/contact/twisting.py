"""Twisting: dphi/dt = (w1 - w2).n_c, U = 1/2 k_t phi^2, M1 = -k_t phi n_c (S12 eqs 10, 16, 19),
clamped to +-phi_crit. On a wall w2 = 0 (S12 eqs 26, 27).
"""

from math import pi

import taichi as ti

from dusttaichi.physics.contact.numbers import Number

NUMBERS = {
    "k_t": Number("N m", "twisting stiffness"),
    "phi_crit": Number("rad", "twist past which twisting costs energy"),
}


@ti.pyfunc
def numbers(c, own):
    """k_t = (16/3) G a0^3 with 1/G = 1/G1 + 1/G2 (S12 eq 19) times the modifier, on a wall with the
    a0 of a pair; phi_crit = 1/(16 pi) (S12 sect. 2.1.6)."""
    return {
        "k_t": own.modifier * (16.0 / 3.0 * c.G * c.a0_pair**3),
        "phi_crit": 1.0 / (16.0 * pi) + 0.0 * c.R,
    }


@ti.pyfunc
def energy(phi, p):
    """U = 1/2 k_t phi^2."""
    return 0.5 * p.k_t * phi * phi


@ti.pyfunc
def stiffness(phi, p):
    """dU/dphi = stiffness phi."""
    return p.k_t


@ti.func
def correct(phi, rate, p):
    """phi back within its limits, and the energy lost; rate: dphi/dt."""
    clamped = ti.min(ti.max(phi, -p.phi_crit), p.phi_crit)
    return ti.Struct(phi=clamped, lost=p.k_t * clamped * (phi - clamped))
