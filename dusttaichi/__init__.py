"""Grain-by-grain simulation of porous dust with JKR contacts."""

import os
from importlib import import_module

from dusttaichi.compute.cache import provide_home

__version__ = "0.1.0"

# Taichi and Quadrants print a header on import; the output of a run is for the user
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")
provide_home()

# The Python interface by name; imported on first use.
_NAMES = {
    "load": "dusttaichi.scene",
    "from_yaml": "dusttaichi.scene",
    "Scene": "dusttaichi.scene",
    "make_sample": "dusttaichi.method",
    "Sample": "dusttaichi.samples",
    "simulate": "dusttaichi.running.interface",
    "run": "dusttaichi.studies.interface",
    "sweep": "dusttaichi.studies.interface",
    "collide": "dusttaichi.studies.interface",
    "study": "dusttaichi.studies.interface",
    "open_run": "dusttaichi.analysis",
    "DustError": "dusttaichi.errors",
    "ti": "dusttaichi.compute.engine",
}
_SUBPACKAGES = ("analysis", "export", "plots", "samples", "scene")

__all__ = ["__version__", *_NAMES, *_SUBPACKAGES]


def __getattr__(name):
    if name in _SUBPACKAGES:
        return import_module(f"{__name__}.{name}")
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_NAMES[name]), name)


def __dir__():
    return sorted({*globals(), *__all__})
