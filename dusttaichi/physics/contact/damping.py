"""Damping of the normal motion: F = -kappa u n_c on grain 1, u = (v1 - v2).n_c (S12 eq 7).

`viscous` and `scaled` have a constant kappa; `viscoelastic` (Brilliantov et al. 2007) has kappa
proportional to the contact radius of the moment, a = a0 s^2. See `constants.damping_coefficient`.
"""

import taichi as ti


@ti.func
def constant(s, p):
    """kappa, the same at any overlap."""
    return p.kappa + 0.0 * s


@ti.func
def viscoelastic(s, p):
    """kappa(a) = kappa(a0) a/a0."""
    return p.kappa * s * s


COEFFICIENT = {"viscous": constant, "scaled": constant, "viscoelastic": viscoelastic}
