"""Choice of the compiler of the kernels: Taichi, or Quadrants, its successor, by DUST_COMPILER.

Neither is imported here (compute/engine.py does), so that reading results does not wait for it.
"""

import os
from importlib import metadata

from dusttaichi.errors import DustError

VARIABLE = "DUST_COMPILER"
PREFIX = {"taichi": "TI_", "quadrants": "QD_"}  # of the variables that a compiler itself heeds

KERNEL_FOLDER = "OFFLINE_CACHE_FILE_PATH"  # its variable for the folder of kernels, without PREFIX


def name() -> str:
    """Name of its package. Raises DustError for an unknown one."""
    text = os.environ.get(VARIABLE, "")
    compiler = text.strip().lower() or "taichi"
    if compiler not in PREFIX:
        raise DustError(f"{VARIABLE}={text}: no such compiler; allowed: {', '.join(PREFIX)}")
    return compiler


def version() -> str:
    """Version of its package. Raises DustError where it is not installed."""
    try:
        return metadata.version(name())
    except metadata.PackageNotFoundError:
        raise DustError(
            f"{VARIABLE}={name()}: it is not installed; `pip install 'dusttaichi[{name()}]'` "
            f"installs it, and without {VARIABLE} kernels are compiled by Taichi"
        ) from None


def label() -> str:
    """Name and version for the user."""
    return f"{name().capitalize()} {version()}"


def variable(of: str) -> str:
    """The environment variable of the compiler itself for a setting, such as OFFLINE_CACHE."""
    return PREFIX[name()] + of
