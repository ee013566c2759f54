"""Compressive strength of Güttler et al. (2009), the inverse of a Fermi function of lg p.

Sigma(phi) = p_m ((phi_2 - phi_1)/(phi_2 - phi) - 1)^(Delta ln 10)      (G09 eq 10)
"""

from math import log as ln

from numpy import exp, log

from dusttaichi.physics.contact.effect_numbers import Constant

NUMBERS = {
    "p_m": Constant("Pa", "compressive strength half way between phi_1 and phi_2"),
    "power": Constant("1", "exponent of the compressive strength, Delta ln 10"),
}


def numbers(material, law_block):
    return {"p_m": law_block.p_m, "power": law_block.delta * ln(10.0)}


def limits(law_block):
    return law_block.phi_1, law_block.phi_2


def strength(phi, m):
    return m.p_m * exp(m.power * log((phi - m.phi_1) / (m.phi_2 - phi)))
