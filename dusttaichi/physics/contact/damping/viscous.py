"""Viscous damping: one kappa for all contacts, at any overlap (S12 eq 7)."""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import Constant

NUMBERS = {"kappa": Constant("kg/s", "damping constant of the normal motion")}


@ti.pyfunc
def numbers(c, block):
    """kappa as the scene says; of a softened contact in the same proportion to sqrt(k_n)."""
    return {"kappa": block.kappa * c.stiffness_scaling ** (1.0 / 3.0) + 0.0 * c.R}


@ti.pyfunc
def coefficient(motion, constants):
    """kappa, the same at any overlap."""
    return constants.kappa + 0.0 * motion.contact_radius
