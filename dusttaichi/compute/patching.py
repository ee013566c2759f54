"""Patches of Taichi's internals: only of versions that were tested, never with `numerics.debug`."""

from functools import cache

from dusttaichi import compiler
from dusttaichi.compute import engine


def patch(debug):
    """Patch the internals of a tested version; with debug, restore its own."""
    for holder, name, own, ours in _patches():
        setattr(holder, name, own if debug else ours)


@cache
def _patches():
    """Rows (module or class, name in it, Taichi's own object, replacement).

    None for a version that was not tested, and for Quadrants, whose internals are others.
    """
    if not engine.tested():
        return []
    from dusttaichi.compute import kernel_arguments, taichi_patches

    found = [*taichi_patches.patches(), *kernel_arguments.patches()]
    return [(holder, name, getattr(holder, name), ours) for holder, name, ours in found]


def rows(debug):
    """Rows (name, value) about the compiler, for a scene with that `numerics.debug`."""
    if debug:
        text = "none, as numerics.debug is true: bounds are checked and fast math is off"
    elif _patches():
        text = "applied: kernels are read and called in less time"
    else:
        known = " and ".join(engine.PATCHED)
        text = f"none: they are for Taichi {known}, and without them the first step takes longer"
    name = compiler.name().capitalize()
    return [("compiler", f"{name} {engine.VERSION}"), ("patches of its internals", text)]
