"""Python processes of this program; they import nothing from the current directory."""

import sys
from pathlib import Path

import dusttaichi

# `python -m` and `python -c` search the current directory before the standard library, and a
# random.py there would run; -P, which prevents that, is an option since Python 3.11 only.
# dusttaichi is imported from its own file, whatever else is installed under that name.
_START = """
import sys
sys.path[:] = [folder for folder in sys.path if folder]
import importlib.util, runpy
_, package, module, *arguments = sys.argv
spec = importlib.util.spec_from_file_location("dusttaichi", package)
sys.modules["dusttaichi"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sys.modules["dusttaichi"])
sys.argv = [module, *arguments]
runpy.run_module(module, run_name="__main__", alter_sys=True)
"""


def python_command(module, *arguments):
    """The command that runs a module of this program as `python -m` does, with these arguments."""
    package = Path(dusttaichi.__file__).resolve()
    return [sys.executable, "-c", _START, str(package), module, *map(str, arguments)]
