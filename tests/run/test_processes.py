"""Processes of the program import nothing from the current directory."""

import subprocess

import pytest
import toy

import benchmarks
from dusttaichi.analysis import open_run
from dusttaichi.compute.processes import python_command
from dusttaichi.studies.workers import Worker

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
    request = {"scene": "x: 1", "directory": "run", "mode": "new"} | {"timed": False, "how": {}}
    with Worker("dusttaichi.studies.jobs:run", folder=hostile if inside else None) as one:
        answer = one.ask(request)
    assert answer.code == 2 and "material: it is missing" in answer.text


def test_a_worker_whose_task_is_of_another_package(hostile):
    """It is taken from where this process has it, and so are the modules below it."""
    assert benchmarks.__path__
    with Worker("benchmarks.task:answer", folder=hostile) as worker:
        answer = worker.ask({"do": "no_such_command"})
    assert answer.text.endswith("'Benchmark' object has no attribute 'no_such_command'")


def test_the_joining_of_parts(hostile, tmp_path, toys):
    toy.with_parts(True)
    toy.prepare()
    toy.go("plain", tmp_path / "run")
    assert not (tmp_path / "run" / "result.parts").exists()
    with open_run(tmp_path / "run") as run:
        assert run.status.startswith("finished")


def test_the_page_of_a_run(hostile):
    command = python_command("dusttaichi", "watch", "--help")
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
