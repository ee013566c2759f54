"""Bytecode of modules, for Python that would compile their sources at every start."""

import os
import sys
from importlib.util import find_spec

from dusttaichi.compute.cache import cache_folder

SAMPLE = "typer"  # a package that every command imports


def keep_bytecode():
    """Let Python keep bytecode in the folder of caches where it has none and may write none.

    That is so in containers with PYTHONDONTWRITEBYTECODE, for a clone as for packages that came
    without bytecode, and in a folder that this user cannot write: compiling sources takes more than
    half of a command. Nothing is written beside the sources. Processes started from here do the
    same.
    """
    specs = (find_spec(SAMPLE), __spec__)
    folders = {
        os.path.dirname(s.origin) for s in specs if s.cached and not os.path.exists(s.cached)
    }
    if sys.pycache_prefix or not without:
        return
    if not sys.dont_write_bytecode and all(
        os.access(os.path.dirname(spec.origin), os.W_OK) for spec in without
    ):
        return
    sys.pycache_prefix, sys.dont_write_bytecode = str(cache_folder() / "bytecode"), False
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
