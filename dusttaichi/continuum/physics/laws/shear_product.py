"""Shear strength from the two others, Y = C Sigma^a |T|^(1 - a) (G09 sections 4.1 and 5.1.2)."""

from numpy import exp, log

from dusttaichi.physics.contact.effect_numbers import Constant

WORDS = {"sqrt": (1.0, 0.5), "compressive": (1.0, 1.0), "tensile": (1.0, 0.0)}
"""C and a by the words of the YAML."""

NUMBERS = {
    "C": Constant("1", "factor of the shear strength"),
    "a": Constant("1", "exponent of the compressive strength in the shear strength"),
}


def numbers(material, law_block):
    return {"C": law_block.factor, "a": law_block.exponent}


def strength(phi, compressive, tensile, m):
    return m.C * tensile * exp(m.a * log(compressive / tensile))
