"""Rolling: xi = R (n1 + n2), U = 1/2 k_r xi^2 (S12 eqs 8, 11, 12, 17), inelastic past xi_crit.

An effect says how far the contact pointers move when its limit is passed (`correct`), and pulls on
them with A_i = dU/dn_i, which turns grain i by the torque A_i x n_i. On a wall n2 = n_w is fixed.
"""

import taichi as ti

from dusttaichi.physics.contact.limit import limit, restoring


@ti.func
def displacement(n1, n2, p):
    """xi (S12 eq 8)."""
    return n1.plus(n2).times(p.R)


@ti.func
def correct(xi, n1, n2, p):
    """c1, c2: pointer changes c xi that put |xi| back to xi_crit (Wada et al. 2007); the energy
    lost, k x (displacement after) x (before - after).

    n_i <- n_i - alpha_i (xi - xi_c)/r_i moves xi by R/r1 + R/r2 = 1 times the excess.
    """
    length, inverse, over = limit(xi, p.xi_crit)
    share = -over * p.inv_r
    lost = p.k_r * (1.0 - over) * over * length * length
    return share * restoring(n1, xi, inverse), share * restoring(n2, xi, inverse), lost


@ti.func
def correct_unequal(xi, n1, n2, p):
    """The same of grains of radii r1, r2: r1 dn1 - r2 dn2 = 0, sliding sees nothing of it."""
    length, inverse, over = limit(xi, p.xi_crit)
    lost = p.k_r * (1.0 - over) * over * length * length
    c1 = -over * p.inv_r1 * restoring(n1, xi, inverse)
    return c1, -over * p.inv_r2 * restoring(n2, xi, inverse), lost


@ti.func
def correct_wall(xi, n1, p):
    """The same on a wall: n1 alone moves, R = r (S12 eqs 21-23 with xi_crit in eq 23)."""
    length, inverse, over = limit(xi, p.xi_crit)
    lost = p.k_r * (1.0 - over) * over * length * length
    return -over * p.inv_r * restoring(n1, xi, inverse), lost


@ti.func
def energy(xi, p):
    """U = 1/2 k_r xi^2."""
    return 0.5 * p.k_r * xi.dot(xi)


@ti.func
def pull(p):
    """A1 = A2 = pull xi."""
    return p.R * p.k_r
