"""Processes of Python that this program starts; they import nothing from the current directory."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path

# Where every file is this program's, HDF5 needs no locks, which some disks do not have
# (results/locks.py). It reads the variable once, as it is imported.
HDF5_LOCKS = "HDF5_USE_FILE_LOCKING"

# `python -m` and `python -c` search the current directory before the standard library, and a
# random.py there would run; -P, which prevents that, is an option since Python 3.11 only.
# Packages are imported from their own files, whatever else is installed under their names.
_START = f"""
import os, sys
os.environ.setdefault({HDF5_LOCKS!r}, "FALSE")
sys.path[:] = [folder for folder in sys.path if folder]
import importlib.util, json, runpy
_, packages, module, *arguments = sys.argv
for name, file in json.loads(packages).items():
    spec = importlib.util.spec_from_file_location(name, file)
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
sys.argv = [module, *arguments]
runpy.run_module(module, run_name="__main__", alter_sys=True)
"""


def python_command(module: str, *arguments: object, also: Iterable[str] = ()) -> list[str]:
    """The command that runs a module of this program as `python -m` does, with these arguments.

    also: names of modules that the process imports later; where their packages are known in this
    process, it takes them from the same files.
    """
    names = dict.fromkeys(name.partition(".")[0] for name in ("dusttaichi", module, *also))
    packages = {name: file for name in names if (file := _file_of_package(name)) is not None}
    return [sys.executable, "-c", _START, json.dumps(packages), module, *map(str, arguments)]


def start_again() -> None:
    """Replace this process by one with the same command line."""
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def _file_of_package(name) -> str | None:
    package = sys.modules.get(name)
    file = getattr(package, "__file__", None)
    return str(Path(file).resolve()) if file and hasattr(package, "__path__") else None
