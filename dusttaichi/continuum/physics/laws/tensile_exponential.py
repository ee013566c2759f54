"""Tensile strength that grows exponentially, 10^(a + b phi) Pa (G09 eq 8: a = 2.8, b = 1.48)."""

from math import log as ln

from numpy import exp

from dusttaichi.physics.contact.effect_numbers import Constant

NUMBERS = {
    "T_0": Constant("Pa", "tensile strength at filling factor 0"),
    "T_rate": Constant("1", "growth of ln |T| with the filling factor"),
}


def numbers(material, law_block):
    return {"T_0": 10.0**law_block.a, "T_rate": law_block.b * ln(10.0)}


def strength(phi, m):
    return m.T_0 * exp(m.T_rate * phi)
