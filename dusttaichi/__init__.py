"""Grain-by-grain simulation of porous dust with JKR contacts."""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dusttaichi.compute.cache import provide_home
from dusttaichi.compute.version import __version__

if TYPE_CHECKING:  # for editors and type checkers; imported on first use, by __getattr__
    from dusttaichi import analysis, export, plots, samples, scene
    from dusttaichi.analysis import open_run
    from dusttaichi.compute.engine import ti
    from dusttaichi.errors import DustError
    from dusttaichi.method import make_sample
    from dusttaichi.running.interface import simulate
    from dusttaichi.samples import Sample
    from dusttaichi.scene import Scene, from_yaml, load
    from dusttaichi.studies.python_interface import collide, run, study, sweep

# Taichi and Quadrants print a header on import; the output of a run is for the user
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")
provide_home()

# The Python interface by name; imported on first use.
_HOMES = {
    "load": "dusttaichi.scene",
    "from_yaml": "dusttaichi.scene",
    "Scene": "dusttaichi.scene",
    "make_sample": "dusttaichi.method",
    "Sample": "dusttaichi.samples",
    "simulate": "dusttaichi.running.interface",
    "run": "dusttaichi.studies.python_interface",
    "sweep": "dusttaichi.studies.python_interface",
    "collide": "dusttaichi.studies.python_interface",
    "study": "dusttaichi.studies.python_interface",
    "open_run": "dusttaichi.analysis",
    "DustError": "dusttaichi.errors",
    "ti": "dusttaichi.compute.engine",
}

__all__ = [
    "DustError",
    "Sample",
    "Scene",
    "__version__",
    "analysis",
    "collide",
    "export",
    "from_yaml",
    "load",
    "make_sample",
    "open_run",
    "plots",
    "run",
    "samples",
    "scene",
    "simulate",
    "study",
    "sweep",
    "ti",
]


if not TYPE_CHECKING:  # for which a misspelt name is then an error

    def __getattr__(name: str) -> Any:
        if name in _HOMES:
            return getattr(import_module(_HOMES[name]), name)
        if name in __all__:
            return import_module(f"{__name__}.{name}")
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
