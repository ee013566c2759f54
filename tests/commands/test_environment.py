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
    options = {"capture_output": True, "text": True, "env": environment}
    return subprocess.run(["sh", "-c", f"{DUST} {words}"], **options)


@posix
@pytest.mark.parametrize(
    "words, code, message",
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
def test_streams_that_cannot_be_written(words, code, message):
    process = shell(words)
    assert process.returncode == code, process.stderr
    assert message in process.stderr and "Traceback" not in process.stderr
    assert message or not process.stderr


@posix
def test_files_that_may_not_grow(tmp_path):
    """Where even temporary files cannot be made, the words of the system are the message."""
    text = "name: a\nmaterial: silicate_s12\nsample: {kind: chain, grains: 3}\n"
    (tmp_path / "a.yaml").write_text(text + "boundary: {kind: open}\nstop: {steps: 1}\n")
    process = subprocess.run(
        ["sh", "-c", f"ulimit -f 0; exec {DUST} run a.yaml -q"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert process.returncode == 2 and process.stderr.startswith("dust: "), process.stderr
    assert "Traceback" not in process.stderr


def test_settings_of_other_work(tmp_path):
    """No window system, no LaTeX, and no warning of a library is in the way of a figure."""
    synthetic.plates_run(tmp_path / "result.nc")
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    process = shell(
        f"plot {tmp_path}",
        MPLBACKEND="nonsense",
        PYTHONWARNINGS="error",
        MATPLOTLIBRC=str(tmp_path / "matplotlibrc"),
    )
    assert process.returncode == 0 and "Traceback" not in process.stderr, process.stderr
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


def _list_imports(words):
    process = python("-c", SHOW, *words.split())
    assert process.returncode == 0, process.stderr
    return json.loads(process.stderr.splitlines()[-1])


@pytest.mark.parametrize("words", ALLOWED)
def test_a_command_imports_what_it_needs(words):
    assert HEAVY & set(_list_imports(words)) == ALLOWED[words]


def test_figures_need_neither_dask_nor_pint(tmp_path):
    """xarray imports both for most of what it does."""
    synthetic.compression_run(tmp_path / "result.nc", points=20)
    assert not {"dask", "pint"} & set(_list_imports(f"plot {tmp_path}"))


def test_phases_of_a_run_add_up_to_its_time(tmp_path):
    """Its numbers, and their comparison, need no searches, fits or figures."""
    words = f"run smoke --set stop.steps=40 -q -v --no-figures -o {tmp_path / 'out'}".split()
    began = time.monotonic()
    process = python("-c", SHOW, *words)
    wall = time.monotonic() - began
    analysis = {"xarray", "pandas", "dusttaichi.analysis"}
    assert HEAVY & set(json.loads(process.stderr.splitlines()[-1])) == analysis | {"taichi"}
    assert HEAVY & set(_list_imports(f"compare {tmp_path / 'out'}")) == analysis
    rows = [line.partition(" s  ") for line in process.stderr.splitlines() if " s  " in line]
    named = [(phase.partition(":")[0], float(seconds)) for seconds, _, phase in rows]
    names = ["imports and scene", "sample", "grains", "steps", "output", "numbers", "total"]
    assert [name for name, _ in named] == names
    *durations, total = (seconds for _, seconds in named)
    assert sum(durations) == pytest.approx(total, abs=0.005 * len(named))  # two decimals each
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
    process = python("-c", code, env=environment)
    path = process.stdout.strip()
    assert path.startswith(str(tmp_path / "dusttaichi" / "bytecode")), process.stderr
    assert os.path.exists(path)
