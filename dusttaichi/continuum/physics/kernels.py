"""The laws of the continuum as Taichi functions, compiled from the source that the host runs.

A formula of this subpackage is written with NumPy's `maximum`, `minimum`, `where`, `sqrt` and `exp`
by their bare names, and with other formulas of the subpackage. Here each is compiled with Taichi's
functions under these names, so that nothing is written twice. m: a struct of `material_type`, whose
values in order are `numbers.MaterialNumbers.from_material(material).values()`.
"""

from functools import cache
from inspect import getmembers, isfunction
from types import FunctionType, SimpleNamespace

import numpy as np

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.physics import (
    attraction,
    chosen,
    damage,
    deviator,
    elasticity,
    heat,
    path,
    strength,
)
from dusttaichi.continuum.physics.dust_laws import FUNCTIONS
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers, numbers_class


@cache
def material_type(laws):
    """Struct of the numbers of a material with DustLaws."""
    return ti.types.struct(**dict.fromkeys(numbers_class(laws).names(), ti.f64))


_NAMES = {
    "abs": abs,
    "cos": ti.cos,
    "exp": ti.exp,
    "log": ti.log,
    "maximum": ti.max,
    "minimum": ti.min,
    "sin": ti.sin,
    "sqrt": ti.sqrt,
    "tanh": ti.tanh,
    "where": ti.select,
}
_NUMPY = {id(getattr(np, name)): _NAMES[name] for name in FUNCTIONS}


def _compile(plain, names):
    """Taichi function of a plain one; names: Taichi functions by name, known to it beside."""
    compiled = dict(plain.__globals__)
    copy = FunctionType(plain.__code__, compiled, plain.__name__)
    copy.__doc__ = plain.__doc__
    for name in plain.__code__.co_names:
        value = compiled.get(name)
        if id(value) in _NUMPY:
            compiled[name] = _NUMPY[id(value)]
        elif name in names:
            compiled[name] = names[name]
        elif isfunction(value):
            compiled[name] = _compile(value, names)
    return ti.func(copy)


@cache
def laws_of(laws):
    """The Taichi functions of all formulas with DustLaws.

    For example laws_of(m.laws).compressive(phi, m), or pressure(density, reference, m).
    """
    names = {}
    for name, function in vars(chosen.functions_of(laws)).items():
        # modulus and exponent come before the solution that uses them
        names[f"{name}_law"] = _compile(getattr(function, "plain", function), names)
    formulas = {}
    for module in (strength, elasticity, path, deviator, attraction, damage, heat):
        for name, plain in getmembers(module, isfunction):
            if plain.__module__ == module.__name__:
                formulas[name] = _compile(plain, names)
    return SimpleNamespace(**formulas)


LAWS, MATERIAL = laws_of(MaterialNumbers.laws), material_type(MaterialNumbers.laws)
"""The Taichi functions with the built-in laws, and the struct of their numbers."""
