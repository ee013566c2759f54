"""Grain-by-grain simulation of porous dust with JKR contacts."""

import inspect
import os
from importlib import import_module

from dusttaichi.compute.cache import provide_home

__version__ = "0.1.0"

# Taichi greets on import; the output of a run belongs to the user
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
provide_home()

# Taichi asks of each function it decorates at import who imports it; that this is Python's own
# importer, and no module, is found only after all modules have been searched: half a second in all
inspect.modulesbyfile["<frozen importlib._bootstrap>"] = "importlib._bootstrap"

# What people need from Python, by name; imported when it is first asked for.
_NAMES = {
    "load": "dusttaichi.scene",
    "from_yaml": "dusttaichi.scene",
    "Scene": "dusttaichi.scene",
    "make_sample": "dusttaichi.method",
    "Sample": "dusttaichi.samples",
    "simulate": "dusttaichi.run.interface",
    "open_run": "dusttaichi.analysis",
    "DustError": "dusttaichi.errors",
}
_ROOMS = ("analysis", "export", "plots", "samples", "scene")

__all__ = ["__version__", *_NAMES, *_ROOMS]


def __getattr__(name):
    if name in _ROOMS:
        return import_module(f"{__name__}.{name}")
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_NAMES[name]), name)


def __dir__():
    return sorted({*globals(), *__all__})
