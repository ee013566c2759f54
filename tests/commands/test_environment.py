"""Streams that are closed or full, and variables of other work: no traceback, and the right exit
code."""

import json
import os
import subprocess
import sys
import time

import pytest
import synthetic
from program import python

DUST = f'"{sys.executable}" -m dusttaichi'
posix = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")


def shell(words, **variables):
    environment = {**os.environ, **variables}
    how = {"capture_output": True, "text": True, "env": environment}
    return subprocess.run(["sh", "-c", f"{DUST} {words}"], **how)


@posix
@pytest.mark.parametrize(
    "words, code, said",
    [
        ("schema >&-", 0, ""),
        ("schema >&- 2>&- <&-", 0, ""),
        ("schema >/dev/full", 2, "the output could not be printed: No space left on device"),
        ("--help >/dev/full", 2, "the output could not be printed: No space left on device"),
        ("schema | head -1 >/dev/null", 0, ""),
        ("check nothing.yaml 2>&-", 2, ""),
        ("check nothing.yaml 2>/dev/full", 2, ""),
    ],
)
def test_streams_that_cannot_be_written(words, code, said):
    done = shell(words)
    assert done.returncode == code, done.stderr
    assert said in done.stderr and "Traceback" not in done.stderr
    assert said or not done.stderr


@posix
def test_files_that_may_not_grow(tmp_path):
    """Where even temporary files cannot be made, the words of the system are the message."""
    text = "name: a\nmaterial: silicate_s12\nsample: {kind: chain, grains: 3}\n"
    (tmp_path / "a.yaml").write_text(text + "boundary: {kind: open}\nstop: {steps: 1}\n")
    done = subprocess.run(
        ["sh", "-c", f"ulimit -f 0; exec {DUST} run a.yaml -q"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and done.stderr.startswith("dust: "), done.stderr
    assert "Traceback" not in done.stderr


def test_settings_of_other_work(tmp_path):
    """No window system, no LaTeX, and no warning of a library is in the way of a figure."""
    synthetic.plates_run(tmp_path / "result.nc")
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    done = shell(
        f"plot {tmp_path}",
        MPLBACKEND="nonsense",
        PYTHONWARNINGS="error",
        MATPLOTLIBRC=str(tmp_path / "matplotlibrc"),
    )
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    assert (tmp_path / "ledger.png").exists()


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
    """Its numbers, and their comparison, need no searches, fits or figures."""
    words = f"run smoke --set stop.steps=40 -q -v --no-figures -o {tmp_path / 'out'}".split()
    began = time.monotonic()
    done = python("-c", SHOW, *words)
    wall = time.monotonic() - began
    analysis = {"xarray", "pandas", "dusttaichi.analysis"}
    # xarray imports pint and dask, and dask scipy.sparse, where they are installed
    heavy = HEAVY - {"pint", "dask", "scipy.sparse"}
    assert heavy & set(json.loads(done.stderr.splitlines()[-1])) == analysis | {"taichi"}
    assert heavy & set(_imported(f"compare {tmp_path / 'out'}")) == analysis
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
