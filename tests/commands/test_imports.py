"""What a command imports, by the modules of its process, and where their bytecode is kept."""

import json
import os
import time

import pytest
from program import python

# Each takes 0.1 to 1.5 s to import.
HEAVY = {
    "taichi", "xarray", "pandas", "scipy.sparse", "scipy.spatial", "scipy.ndimage",
    "scipy.optimize", "matplotlib", "pint", "dask",
    "dusttaichi.analysis", "dusttaichi.plots",
}  # fmt: skip
ALLOWED = {
    "--help": set(),
    "--version": set(),
    "run --help": set(),
    "schema": set(),
    "new": set(),
    "check smoke": {"taichi"},
    "check smoke --json": {"taichi"},
}
SHOW = """
import atexit, json, sys
atexit.register(lambda: print("\\n" + json.dumps(list(sys.modules)), file=sys.stderr))
from dusttaichi.commands.app import main
main()
"""


def _imported(words):
    done = python("-c", SHOW, *words.split())
    assert done.returncode == 0, done.stderr
    return json.loads(done.stderr.splitlines()[-1])


@pytest.mark.parametrize("words", ALLOWED)
def test_a_command_imports_what_it_needs(words):
    assert HEAVY & set(_imported(words)) == ALLOWED[words]


def test_phases_of_a_run_add_up_to_its_time(tmp_path):
    """Its numbers, and their comparison, need no searches, fits, arrays of dask or figures."""
    words = f"run smoke --set stop.steps=40 -q -v --no-figures -o {tmp_path / 'out'}".split()
    began = time.monotonic()
    done = python("-c", SHOW, *words)
    wall = time.monotonic() - began
    analysis = {"xarray", "pandas", "dusttaichi.analysis"}
    assert HEAVY & set(json.loads(done.stderr.splitlines()[-1])) == analysis | {"taichi"}
    assert HEAVY & set(_imported(f"compare {tmp_path / 'out'}")) == analysis
    rows = [line.partition(" s  ") for line in done.stderr.splitlines() if " s  " in line]
    named = [(what.partition(":")[0], float(seconds)) for seconds, _, what in rows]
    names = ["imports and scene", "sample", "grains", "steps", "output", "numbers", "in all"]
    assert [name for name, _ in named] == names
    *parts, total = (seconds for _, seconds in named)
    assert sum(parts) == pytest.approx(total, abs=0.005 * len(named))  # two decimals each
    assert total <= wall + 0.02  # the system counts the start in hundredths


@pytest.mark.parametrize("module", ["typer", "dusttaichi.commands.bytecode"])
def test_bytecode_is_kept_where_python_may_not_write_it(module, tmp_path):
    """Compiled modules are in the folder of caches, where a package or this one came without."""
    code = (
        f"import sys; from importlib import util; spec = util.find_spec({module!r}); "
        "from dusttaichi.commands import bytecode; there = spec.cached; "
        "bytecode.os.path.exists = lambda path: path != there; bytecode.keep_bytecode(); "
        "from dusttaichi.physics import geometry; print(geometry.__cached__)"
    )
    kept = {n: v for n, v in os.environ.items() if n != "PYTHONPYCACHEPREFIX"}
    environment = kept | {"PYTHONDONTWRITEBYTECODE": "1", "XDG_CACHE_HOME": str(tmp_path)}
    done = python("-c", code, env=environment)
    path = done.stdout.strip()
    assert path.startswith(str(tmp_path / "dusttaichi" / "bytecode")), done.stderr
    assert os.path.exists(path)
