"""Twisting: dphi/dt = (w1 - w2).n_c, U = 1/2 k_t phi^2, M1 = -k_t phi n_c (S12 eqs 10, 16, 19),
clamped to +-phi_crit. On a wall w2 = 0 (S12 eqs 26, 27).
"""

import taichi as ti


@ti.func
def correct(phi, p):
    """phi back within its limits, and the energy lost."""
    clamped = ti.min(ti.max(phi, -p.phi_crit), p.phi_crit)
    return clamped, p.k_t * clamped * (phi - clamped)


@ti.func
def torque(phi, p):
    """Torque on grain 1 along n_c."""
    return -p.k_t * phi


@ti.func
def energy(phi, p):
    return 0.5 * p.k_t * phi * phi
