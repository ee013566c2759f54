"""Scaled damping: kappa = k_n' m0/t_c, from mass and time scale of equal grains (T19 eq 5)."""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.damping.viscous import NUMBERS, coefficient

__all__ = ["NUMBERS", "coefficient", "numbers"]

collision_time = ti.pyfunc(constants.collision_time)


@ti.pyfunc
def numbers(c, block):
    """kappa of m0 and t_c of the contact's equal grains; t_c goes with 1/sqrt(k_n) by itself."""
    t_c = collision_time(c.size, c.density, c.gamma, c.E_star)
    return {"kappa": block.coefficient * c.m0 / t_c}
