"""The compiler, in one place: every other module takes `ti` from here, and none imports it.

It is Taichi, or Quadrants where DUST_COMPILER says so (see dusttaichi/compiler.py). The internals
of Taichi are patched here too (see compute/taichi_patches.py and compute/kernel_arguments.py), only
in versions that were tested, and never with `numerics.debug: true`.
"""

import warnings
from functools import cache
from importlib import import_module

from dusttaichi import compiler

VERSION = compiler.version()  # raises where it is not installed
PATCHED = ("1.7.3", "1.7.4")  # versions of Taichi whose internals were tested
ti = import_module(compiler.name())
# of Quadrants, about lists as arguments: it examines their types at every call
warnings.filterwarnings("ignore", ".*Template mapper caching disabled")

__all__ = ["PATCHED", "VERSION", "patch", "program", "rows", "settings", "tested", "ti"]


def tested():
    """True for a compiler whose internals were tested."""
    return compiler.name() == "taichi" and VERSION in PATCHED


def program():
    """The current program of the compiler, a new one after each start; None without one."""
    runtime = ti.lang.impl.get_runtime()
    return runtime._prog if hasattr(runtime, "_prog") else runtime.prog  # Quadrants, Taichi


def settings():
    """Settings of the running compiler: arch, cpu_max_num_threads, ...; they may be set."""
    return ti.lang.impl.current_cfg()


def patch(debug):
    """Patch the internals of a tested version; with debug, restore its own."""
    for holder, name, own, ours in _patches():
        setattr(holder, name, own if debug else ours)


@cache
def _patches():
    """Rows (module or class, name in it, Taichi's own object, replacement).

    None for a version that was not tested, and for Quadrants, whose internals are others.
    """
    if not tested():
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
        known = " and ".join(PATCHED)
        text = f"none: they are for Taichi {known}, and without them the first step takes longer"
    name = compiler.name().capitalize()
    return [("compiler", f"{name} {VERSION}"), ("patches of its internals", text)]
