"""The laws of the continuum as Taichi functions, compiled from the source that the host runs.

A formula of this subpackage is written with NumPy's `maximum`, `minimum`, `where`, `sqrt` and `exp`
by their bare names, and with other formulas of the subpackage. Here each is compiled with Taichi's
functions under these names, so that nothing is written twice. m: a struct of `MATERIAL`, whose
values in order are `numbers.MaterialNumbers.of(material).values()`.
"""

from inspect import getmembers, isfunction
from types import FunctionType, SimpleNamespace

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.physics import attraction, damage, deviator, elasticity, path, strength
from dusttaichi.continuum.physics.numbers import NUMBERS

MATERIAL = ti.types.struct(**dict.fromkeys(NUMBERS, ti.f64))


@ti.func
def _unit(matrix):
    return ti.Matrix.identity(ti.f64, matrix.n)


_NAMES = {
    "maximum": ti.max,
    "minimum": ti.min,
    "where": ti.select,
    "sqrt": ti.sqrt,
    "exp": ti.exp,
    "log": ti.log,
    "unit": _unit,
}


def _compiled(*modules):
    """Taichi functions of all formulas of the modules, by name; each knows the others."""
    laws, known = {}, []
    for module in modules:
        for name, plain in getmembers(module, isfunction):
            if plain.__module__ != module.__name__:
                continue
            known.append(dict(plain.__globals__))
            copy = FunctionType(plain.__code__, known[-1], name)
            copy.__doc__ = plain.__doc__
            laws[name] = ti.func(copy)
    for names in known:
        names.update({**_NAMES, **laws})
    return SimpleNamespace(**laws)


LAWS = _compiled(strength, elasticity, path, deviator, attraction, damage)
"""The Taichi functions: LAWS.compressive(phi, m), LAWS.pressure(density, reference, m), ..."""
