"""The laws of dust by kind and name: compressive, tensile and shear strength, elasticity.

A law is a module or an object with plain functions of numbers:

- ``NUMBERS``: name -> Constant, numbers of a material that it needs;
- ``numbers(material, own)``: their values as a dict, SI. material: the block `material` of the
  YAML, own: the block of the law in it;
- ``strength(phi, m)`` of a compressive and of a tensile law, both positive [Pa];
  ``strength(phi, compressive, tensile, m)`` of a shear law, the largest von Mises stress [Pa];
- ``limits(own)`` of a compressive law: the filling factors at which its strength vanishes and
  becomes infinite, or 0 and 1;
- ``modulus(reference, m)`` [Pa] of an elasticity, and ``exponent(reference, m)``, its logarithmic
  slope d ln K/d ln rho; ``reference_density(density, pressure, m)`` where it has a better solution
  than Newton's method (chosen.reference_density).

m: numbers.CommonNumbers with the NUMBERS of all laws of the material. The functions are called with
floats or NumPy arrays, and compiled for the kernels from the same source: they may use NumPy's
FUNCTIONS by their bare names, and other plain functions of their file.
"""

from inspect import isfunction
from types import ModuleType
from typing import NamedTuple

import numpy as np

from dusttaichi.continuum.physics.laws import (
    compressive_g09,
    elasticity_power,
    shear_product,
    tensile_exponential,
)
from dusttaichi.physics.registry import Registry

KINDS = {
    "compressive": ("strength", "limits"),
    "tensile": ("strength",),
    "shear": ("strength",),
    "elasticity": ("modulus", "exponent"),
}
"""Parts that a law of each kind has beside NUMBERS and numbers."""
FUNCTIONS = ("abs", "cos", "exp", "log", "maximum", "minimum", "sin", "sqrt", "tanh", "where")
COMPILED = ("strength", "modulus", "exponent", "reference_density")
"""Parts that kernels use."""

BUILT_IN = {
    ("compressive", "g09"): compressive_g09,
    ("tensile", "exponential"): tensile_exponential,
    ("shear", "product"): shear_product,
    ("elasticity", "power"): elasticity_power,
}
DEFAULT = dict(BUILT_IN.keys())  # kind -> name
LAWS = Registry("law of dust", BUILT_IN)
BLOCKS = Registry("block of the law of dust")


class DustLaws(NamedTuple):
    """Laws of the materials of a scene: of each kind those that occur, in a fixed order."""

    compressive: tuple
    tensile: tuple
    shear: tuple
    elasticity: tuple

    @property
    def all(self):
        """Every one of them, in the order of the kinds."""
        return [law for laws in self for law in laws]


def register(law_kind, name, law, block):
    """Add a law of dust under a name that the YAML may give: `material: {KIND: {law: NAME}}`.

    law: module or object as described above. block: a class derived from
    `dusttaichi.continuum.scene.DustLaw` with the keys of the law; that class itself if it has none
    of its own. A law that is registered again under its name replaces the former one; the built-in
    ones cannot be replaced. Raises ValueError for a kind that there is not, a built-in name, or a
    law that lacks a part or has one that cannot be compiled.
    """
    if law_kind not in KINDS:
        raise ValueError(f"kind = {law_kind!r}: one of {', '.join(KINDS)} is needed")
    if (law_kind, name) in BUILT_IN:
        raise ValueError(f"name = {name!r}: {law_kind} has a built-in law of that name")
    attributes = ("NUMBERS", "numbers", *KINDS[law_kind])
    if missing := [attribute for attribute in attributes if not hasattr(law, attribute)]:
        raise ValueError(f"the law {name!r} of {law_kind} lacks {', '.join(missing)}")
    for attribute in COMPILED:
        if hasattr(law, attribute):
            _refuse_uncompilable(
                f"{attribute} of the law {name!r} of {law_kind}", getattr(law, attribute)
            )
    LAWS.replace((law_kind, name), law)
    BLOCKS.replace((law_kind, name), block)


def _refuse_uncompilable(title, function):
    """Raise ValueError for a function that kernels cannot have."""
    if not isfunction(function) or function.__closure__:
        raise ValueError(f"{title}: a plain function is needed, such as a staticmethod of a class")
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, ModuleType):
            raise ValueError(
                f"{title} uses the module {name}; import the functions themselves, for example "
                "`from numpy import exp`"
            )
        if isfunction(value) and value.__module__ == function.__module__:
            _refuse_uncompilable(title, value)
        elif callable(value) and value not in [getattr(np, operation) for operation in FUNCTIONS]:
            raise ValueError(f"{title} calls {name}; of NumPy it may call {', '.join(FUNCTIONS)}")


def names(law_kind):
    """Names of the laws of a kind."""
    return tuple(name for registered_kind, name in LAWS if registered_kind == law_kind)


def block_of(law_kind, name):
    """Class of the YAML block of a registered law; None for a built-in one."""
    return BLOCKS.get((law_kind, name))


def law_name(material, law_kind):
    """Name of the law of a kind that a material block has."""
    return getattr(getattr(material, law_kind, None), "law", DEFAULT[law_kind])


def laws_of(materials):
    """DustLaws of material blocks."""
    by_kind = (
        dict.fromkeys(LAWS[law_kind, law_name(material, law_kind)] for material in materials)
        for law_kind in KINDS
    )
    return DustLaws(*map(tuple, by_kind))


def describe_conflict(laws, common):
    """Fault of DustLaws of which two have a number of one name, or a common number; or None."""
    owners = dict.fromkeys(common, "every material")
    titles = {id(law): f"the law {name} of {law_kind}" for (law_kind, name), law in LAWS.items()}
    for law in laws.all:
        for name in law.NUMBERS:
            if name in owners:
                return f"{titles[id(law)]} has a number {name}, as {owners[name]} has; rename it"
            owners[name] = titles[id(law)]
    return None
