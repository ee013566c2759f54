"""Import of Taichi without its search for the modules that call it."""

import inspect
from contextlib import contextmanager

from dusttaichi.compute.taichi_internals import are_allowed

_FILE, _MODULE = "<frozen importlib._bootstrap>", "importlib._bootstrap"


@contextmanager
def known_importer():
    """Context in which `inspect` knows the module of Python's importer, for the import of Taichi.

    For each function that Taichi decorates it looks for the module of the caller, which is the
    importer; `inspect` does not find that, and goes through all modules each time.
    """
    if not are_allowed() or _FILE in inspect.modulesbyfile:
        yield
        return
    inspect.modulesbyfile[_FILE] = _MODULE
    try:
        yield
    finally:
        inspect.modulesbyfile.pop(_FILE, None)
