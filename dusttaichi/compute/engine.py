"""The compiler, in one place: every other module takes `ti` from here, and none imports Taichi.

Its internals are patched here too (see compute/taichi_patches.py and compute/kernel_arguments.py),
only in the versions that the patches were tested with, and never with `numerics.debug: true`.
"""

from functools import cache

import taichi as ti

PATCHED = ("1.7.3", "1.7.4")  # versions of Taichi that the patches were tested with
VERSION = ".".join(map(str, ti.__version__))

__all__ = ["PATCHED", "VERSION", "patch", "program", "rows", "settings", "ti"]


def program():
    """The current program of Taichi, a new one after each start."""
    return ti.lang.impl.get_runtime().prog


def settings():
    """Settings of the running Taichi: arch, cpu_max_num_threads, ...; they may be set."""
    return ti.lang.impl.current_cfg()


def patch(debug):
    """Patch the internals of a tested version; with debug, restore its own."""
    for holder, name, own, ours in _patches():
        setattr(holder, name, own if debug else ours)


@cache
def _patches():
    """Rows (module or class, name in it, Taichi's own object, replacement).

    None for a version that was not tested.
    """
    if VERSION not in PATCHED:
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
        tested = " and ".join(PATCHED)
        text = f"none: they are for Taichi {tested}, and without them the first step takes longer"
    return [("compiler", f"Taichi {VERSION}"), ("patches of its internals", text)]
