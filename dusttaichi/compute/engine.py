"""The compiler, in one place: every other module takes `ti` from here, and none imports it.

It is Taichi, or Quadrants where DUST_COMPILER says so (see compute/compiler.py); its internals
are used in compute/taichi_internals.
"""

import os
import warnings
from contextlib import contextmanager
from importlib import import_module

from dusttaichi.compute import compiler
from dusttaichi.compute.taichi_internals import are_allowed
from dusttaichi.compute.taichi_internals.import_search import known_importer

VERSION = compiler.version()  # raises where it is not installed
PATCHED = ("1.7.3", "1.7.4")  # versions of Taichi whose internals were tested


@contextmanager
def _errors_alone(variable):
    """Context in which a compiler logs errors alone; in a notebook it would announce its output."""
    if variable in os.environ:
        yield
        return
    os.environ[variable] = "error"
    try:
        yield
    finally:
        del os.environ[variable]


with _errors_alone(f"{compiler.PREFIX[compiler.name()]}LOG_LEVEL"), known_importer():
    ti = import_module(compiler.name())
# of Quadrants, about lists as arguments: it examines their types at every call
warnings.filterwarnings("ignore", ".*Template mapper caching disabled")

_PROGRAM = "prog" if compiler.name() == "taichi" else "_prog"

__all__ = ["PATCHED", "VERSION", "drop_program", "program", "settings", "is_tested", "ti"]


def is_tested():
    """True for a compiler whose internals were tested and are not switched off."""
    return compiler.name() == "taichi" and VERSION in PATCHED and are_allowed()


def program():
    """The current program of the compiler, a new one after each start; None without one."""
    return getattr(ti.lang.impl.get_runtime(), _PROGRAM)


def drop_program():
    """Let the compiler forget its program, without ending it."""
    setattr(ti.lang.impl.get_runtime(), _PROGRAM, None)


def settings():
    """Settings of the running compiler: arch, cpu_max_num_threads, ...; they may be set."""
    return ti.lang.impl.current_cfg()
