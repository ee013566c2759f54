"""Runs and processes of the program do not depend on what surrounds them."""

import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import toy
from bits import assert_same_bits

import benchmarks
from dusttaichi.analysis import open_run
from dusttaichi.compute.processes import python_command
from dusttaichi.studies.workers import Worker

ROOT = Path(__file__).parents[2]
SCENE = """
name: bits
material: silicate_s12
interaction: {rolling: on}
sample: {kind: bcca, grains: 256, seed: 2}
boundary: {kind: box, size: fit, wall_speed: 1 m/s}
stop: {steps: 60}
output: {series: {steps: 10}, snapshots: {steps: 20}}
"""
WAYS = {
    "a narrow terminal in another locale": {
        "terminal": True, "COLUMNS": "20", "LINES": "5", "LANG": "C", "LC_ALL": "C", "threads": "4",
    },
    "a read-only home and foreign TI_*": {
        "HOME": "home", "XDG_CACHE_HOME": "home/cache",
        "TI_ARCH": "vulkan", "TI_DEBUG": "1", "TI_DEFAULT_FP": "f32",
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With the scene and its result `whole`."""
    folder = tmp_path_factory.mktemp("around")
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "home").mkdir(mode=0o500)
    assert start(folder, "whole").wait() == 0
    return folder


def start(folder, name, *, threads="1", without=(), options=None, **environment):
    """The process of `dust run` into the folder of that name."""
    words = ["run", folder / "scene.yaml", "-o", folder / name, "--threads", threads]
    known = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    known = {key: value for key, value in known.items() if key not in without}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "cwd": folder}
    command = [sys.executable, "-m", "dusttaichi", *map(str, words)]
    return subprocess.Popen(command, env=known, **(pipes | (options or {})))


@pytest.mark.long
@pytest.mark.parametrize("name", WAYS)
def test_the_same_bits(name, folder):
    way, run = dict(WAYS[name]), name.replace(" ", "_").replace("*", "")
    if way.pop("terminal", False):
        ours, theirs = pty.openpty()
        options = {"stdout": theirs, "stderr": theirs, "stdin": theirs}
        process = start(folder, run, **way, options=options)
        os.close(theirs)
        output = all_of(ours)
    else:
        process = start(folder, run, **way)
        output = process.stdout.read()
    assert process.wait() == 0 and b"Traceback" not in output, output
    assert_same_bits(folder / "whole/result.nc", folder / run / "result.nc")


def all_of(terminal):
    output = b""
    while True:
        try:
            output += (chunk := os.read(terminal, 4096))
        except OSError:  # the other side is closed
            return output
        if not chunk:
            return output


@pytest.mark.very_long
def test_several_that_compile_into_a_new_cache_at_once(folder):
    cache = {"XDG_CACHE_HOME": str(folder / "new cache")}
    runs = {f"at_once_{n}": start(folder, f"at_once_{n}", **cache) for n in range(3)}
    for name, process in runs.items():
        output = process.communicate()[0]
        assert process.returncode == 0, output
        assert_same_bits(folder / "whole/result.nc", folder / name / "result.nc")


@pytest.mark.very_long
@pytest.mark.skipif(os.getuid() != 0, reason="only root can be somebody else")
def test_another_user_without_a_home(folder):
    """As in a container: a number without a name, no HOME, a directory of somebody else's."""
    place = Path("/tmp") / f"{folder.parent.name}_{folder.name}"  # others may enter
    shutil.copytree(folder, place, ignore=shutil.ignore_patterns("*at_once*", "new cache", "home"))
    place.chmod(0o755)
    who = {"user": 54321, "group": 54321, "extra_groups": [], "cwd": "/"}
    options = {"without": ("HOME", "XDG_CACHE_HOME"), "how": who}
    try:
        for name in ("own", "foreign"):
            (place / name).mkdir()
        os.chown(place / "own", 54321, 54321)
        try:
            process = start(place, "own", **options)
        except PermissionError:
            pytest.skip("another user may not run this Python")
        output = process.communicate()[0]
        assert process.returncode == 0, output
        assert_same_bits(folder / "whole/result.nc", place / "own/result.nc")
        process = start(place, "foreign", **options)
        output = process.communicate()[0]
        assert process.returncode == 2 and b"permission" in output
    finally:
        shutil.rmtree(place)


NAMES = ("random", "json", "socket", "netCDF4", "numpy", "runpy", "dusttaichi", "benchmarks")
NAMES += ("tempfile",)


@pytest.fixture
def hostile(tmp_path, monkeypatch):
    """The current directory, in which any import leaves a mark and fails."""
    folder = tmp_path / "downloaded"
    folder.mkdir()
    for name in NAMES:
        (folder / f"{name}.py").write_text(
            f"open({str(tmp_path / 'mark')!r}, 'w').close()\nraise RuntimeError('imported')\n"
        )
    monkeypatch.chdir(folder)
    yield folder
    assert not (tmp_path / "mark").exists()


@pytest.mark.parametrize("inside", (False, True))
def test_a_worker(hostile, inside):
    request = {"scene": "x: 1", "directory": "run", "mode": "new"} | {"timed": False}
    request["execute_options"] = {}
    with Worker("dusttaichi.studies.jobs:run", folder=hostile if inside else None) as worker:
        answer = worker.call(request)
    assert answer.code == 2 and "material: it is missing" in answer.text


def test_processes_of_another_package_of_joinings_and_of_a_page(hostile, tmp_path, toys):
    """It is taken from where this process has it, and so are the modules below it."""
    assert benchmarks.__path__
    with Worker("benchmarks.task:answer", folder=hostile) as worker:
        answer = worker.call({"do": "no_such_command"})
    assert answer.text.endswith("'Benchmark' object has no attribute 'no_such_command'")
    toy.with_parts(True)
    toy.prepare()
    toy.go("plain", tmp_path / "run")
    assert not (tmp_path / "run" / "result.parts").exists()
    with open_run(tmp_path / "run") as run:
        assert run.status.startswith("finished")
    command = python_command("dusttaichi", "watch", "--help")
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
