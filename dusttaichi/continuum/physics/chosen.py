"""The laws that a material has chosen, as functions of its numbers `m`.

On the host m says which laws those are. Kernels have them compiled under the same names
(`kernels.laws_of`). Where materials of a scene have several laws of a kind, all of them are
evaluated and that of the material is selected, so that a loop over particles has no branch.
"""

from functools import cache
from types import FunctionType, SimpleNamespace

from numpy import errstate, where

NEWTON_STEPS = 8
"""Steps to the density at zero pressure of an elasticity that has no solution of its own."""


def compressive_law(phi, m):
    """Compressive strength [Pa], positive, between the limits of the law."""
    return functions_of(m.laws).compressive(phi, m)


def tensile_law(phi, m):
    """Tensile strength [Pa], positive."""
    return functions_of(m.laws).tensile(phi, m)


def shear_law(phi, compressive, tensile, m):
    """Shear strength [Pa] at these two strengths, both positive."""
    return functions_of(m.laws).shear(phi, compressive, tensile, m)


def modulus_law(reference, m):
    """Bulk modulus [Pa] of the elastic path with that density at zero pressure [kg/m^3]."""
    return functions_of(m.laws).modulus(reference, m)


def exponent_law(reference, m):
    """Logarithmic slope of the bulk modulus."""
    return functions_of(m.laws).exponent(reference, m)


def reference_law(density, pressure, m):
    """Density at zero pressure [kg/m^3] of the elastic path through (density, pressure)."""
    return functions_of(m.laws).reference(density, pressure, m)


def solve_reference(density, pressure, m):
    """That density by Newton's method, for any elasticity.

    With reference = (1 - d) density, d is the smallest solution of K(reference) d/(1 - d) =
    pressure, whose left side has the slope K (1 - n d)/(1 - d)^2, n the exponent of K there.
    """
    strain = pressure / modulus_law(density, m)
    d = strain / (1.0 - (exponent_law(density, m) - 1.0) * strain)
    for _ in range(NEWTON_STEPS):
        reference = (1.0 - d) * density
        K = modulus_law(reference, m)
        excess = K * d / (1.0 - d) - pressure
        d -= excess * (1.0 - d) * (1.0 - d) / (K * (1.0 - exponent_law(reference, m) * d))
    return (1.0 - d) * density


# of two laws of a kind: the number of the later one, and what evaluates it and all earlier ones
NUMBER, later, earlier = 1.0, compressive_law, compressive_law


def _choose_compressive(phi, m):
    return where(m.compressive_choice == NUMBER, later(phi, m), earlier(phi, m))


def _choose_tensile(phi, m):
    return where(m.tensile_choice == NUMBER, later(phi, m), earlier(phi, m))


def _choose_shear(phi, c, t, m):
    return where(m.shear_choice == NUMBER, later(phi, c, t, m), earlier(phi, c, t, m))


def _choose_elastic(reference, m):
    return where(m.elasticity_choice == NUMBER, later(reference, m), earlier(reference, m))


def _choose_reference(rho, p, m):
    return where(m.elasticity_choice == NUMBER, later(rho, p, m), earlier(rho, p, m))


def _join(functions, choose):
    """The function that evaluates the laws of a kind and chooses by the numbers of the material."""
    joined = functions[0]
    for number, function in enumerate(functions[1:], 1):
        names = {"NUMBER": float(number), "later": function, "earlier": joined}
        joined = FunctionType(choose.__code__, {**choose.__globals__, **names}, choose.__name__)
    return joined


@cache
def functions_of(laws):
    """Functions of registry.DustLaws by the names of the functions above, on the host."""
    elastic = laws.elasticity
    solutions = [getattr(law, "reference_density", solve_reference) for law in elastic]
    joined = {
        "compressive": _join([law.strength for law in laws.compressive], _choose_compressive),
        "tensile": _join([law.strength for law in laws.tensile], _choose_tensile),
        "shear": _join([law.strength for law in laws.shear], _choose_shear),
        "modulus": _join([law.modulus for law in elastic], _choose_elastic),
        "exponent": _join([law.exponent for law in elastic], _choose_elastic),
        "reference": _join(solutions, _choose_reference),
    }
    if all(len(same) == 1 for same in laws):
        return SimpleNamespace(**joined)
    return SimpleNamespace(**{name: _quietly(function) for name, function in joined.items()})


def _quietly(function):
    """The function without warnings about laws that a material has not chosen."""

    def evaluate(*arguments):
        with errstate(all="ignore"):
            return function(*arguments)

    evaluate.plain = function
    return evaluate
