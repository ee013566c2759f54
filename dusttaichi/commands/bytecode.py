"""Bytecode of modules, for Python that would compile their sources at every start."""

import os
import shutil
import sys
from importlib.util import find_spec

from dusttaichi.compute.cache import cache_folder
from dusttaichi.compute.processes import start_again

VARIABLE = "DUST_BYTECODE"  # "off": no bytecode is stored
_AGAIN = "DUST_STARTED_AGAIN"
SAMPLE = "typer"  # a package that every command imports


def keep_bytecode():
    """Let Python keep bytecode in the folder of caches where it has none and may write none.

    That is so in containers with PYTHONDONTWRITEBYTECODE, for a clone as for packages that came
    without bytecode, and in a folder that this user cannot write: compiling sources takes more than
    half of a command. Nothing is written beside the sources. Processes started from here do the
    same. DUST_BYTECODE=off switches it off.
    """
    if os.environ.get(VARIABLE, "").strip().lower() in ("off", "0", "no", "false"):
        return
    both = (find_spec(SAMPLE), __spec__)
    without = [spec for spec in both if spec.cached and not os.path.exists(spec.cached)]
    may_write = all(os.access(os.path.dirname(spec.origin), os.W_OK) for spec in without)
    if sys.pycache_prefix or not without or (may_write and not sys.dont_write_bytecode):
        return
    sys.pycache_prefix, sys.dont_write_bytecode = str(cache_folder() / "bytecode"), False
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def mend_bytecode(error):
    """After an error of Python as it read bytecode from this folder, start the command again.

    The folder is removed first, and written again. Other errors, and a second one, return.
    """
    folder, trace = str(cache_folder() / "bytecode"), error.__traceback__
    if sys.pycache_prefix != folder or _AGAIN in os.environ or os.name != "posix":
        return
    while trace.tb_next is not None:
        trace = trace.tb_next
    reader = "importlib._bootstrap_external" in trace.tb_frame.f_code.co_filename
    if not (reader and isinstance(error, (EOFError, ValueError, TypeError))):
        if not (isinstance(error, ImportError) and "Non-code object" in str(error)):
            return
    shutil.rmtree(folder, ignore_errors=True)
    os.environ[_AGAIN] = "1"
    start_again()
