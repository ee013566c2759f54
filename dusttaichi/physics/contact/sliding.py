"""Sliding: U = 1/2 k_s zeta^2, zeta = [r1 n1 - r2 n2] without its part along n_c (S12 eqs 9, 13,
14, 18), inelastic past zeta_crit; on a wall zeta = [x + r n1 - foot] without its part along n_w
(S12 eqs 24, 25), where `foot` is the point of the wall that the contact started from.
"""

import taichi as ti

from dusttaichi.physics.contact.limit import limit, restoring


@ti.func
def displacement(n1, n2, nc, p):
    """zeta (S12 eq 9) of two equal grains, and (r2 n2 - r1 n1).n_c."""
    arm = n1.minus(n2)
    along = arm.dot(nc)
    return arm.minus(nc.times(along)).times(p.r), -along * p.r


@ti.func
def displacement_unequal(n1, n2, nc, p):
    """The same of grains of radii r1, r2."""
    arm = n1.times(p.r1).minus(n2.times(p.r2))
    along = arm.dot(nc)
    return arm.minus(nc.times(along)), -along


@ti.func
def displacement_wall(x, n1, foot, nw, p):
    """zeta on a wall (S12 eq 24)."""
    arm = x.plus(n1.times(p.r)).minus(foot)
    return arm.minus(nw.times(arm.dot(nw)))


@ti.func
def correct(zeta, n1, n2, p):
    """c1, c2: pointer changes c zeta that put |zeta| back to zeta_crit (Wada et al. 2007); the
    energy lost."""
    length, inverse, over = limit(zeta, p.zeta_crit)
    share = 0.5 * over * p.inv_r
    lost = p.k_s * (1.0 - over) * over * length * length
    return -share * restoring(n1, zeta, inverse), share * restoring(n2, zeta, inverse), lost


@ti.func
def correct_unequal(zeta, n1, n2, p):
    """The same of grains of radii r1, r2: n_i moves by alpha_i (zeta - zeta_c)/(r1 + r2), so that
    r1 dn1 - r2 dn2 is the excess while rolling, R (dn1 + dn2), sees nothing of it."""
    length, inverse, over = limit(zeta, p.zeta_crit)
    share = over * p.inv_touch
    lost = p.k_s * (1.0 - over) * over * length * length
    return -share * restoring(n1, zeta, inverse), share * restoring(n2, zeta, inverse), lost


@ti.func
def correct_wall(zeta, p):
    """c: shift c zeta of `foot` that puts |zeta| back to zeta_crit (S12 eq 25); the energy lost."""
    length, _, over = limit(zeta, p.zeta_crit)
    return over, p.k_s * (1.0 - over) * over * length * length


@ti.func
def energy(zeta, p):
    """U = 1/2 k_s zeta^2."""
    return 0.5 * p.k_s * zeta.dot(zeta)


@ti.func
def push(lever, inv_distance, p):
    """Force on grain 1 -> push zeta (S12 eq 13), lever = (r2 n2 - r1 n1).n_c."""
    return -p.k_s * lever * inv_distance


@ti.func
def pull(p):
    """A1 = pull zeta, A2 = -pull zeta."""
    return p.r * p.k_s


@ti.func
def pull_unequal(p):
    """A1 = pull1 zeta, A2 = -pull2 zeta."""
    return p.r1 * p.k_s, p.r2 * p.k_s
