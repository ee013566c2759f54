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
    both = (find_spec(SAMPLE), __spec__)
    without = [spec for spec in both if spec.cached and not os.path.exists(spec.cached)]
    may_write = all(os.access(os.path.dirname(spec.origin), os.W_OK) for spec in without)
    if sys.pycache_prefix or not without or (may_write and not sys.dont_write_bytecode):
        return
    sys.pycache_prefix, sys.dont_write_bytecode = str(cache_folder() / "bytecode"), False
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
