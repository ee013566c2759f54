"""Viscoelastic damping: kappa in proportion to the contact radius (Brilliantov et al. 2007)."""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import Constant

NUMBERS = {"kappa": Constant("kg/s", "damping constant of the normal motion where a = a0")}


@ti.pyfunc
def numbers(c, block):
    """kappa(a0) = (2 T/nu^2) E* a0.

    A softened contact has T s^(-1/3), so that kappa goes with sqrt(k_n), as s^(1/3).
    """
    time = block.time * c.stiffness_scaling ** (-1.0 / 3.0)
    return {"kappa": 2.0 * time / c.nu**2 * c.E_star * c.a0}


@ti.pyfunc
def coefficient(motion, constants):
    """kappa(a) = kappa(a0) a/a0."""
    return constants.kappa * motion.contact_radius
