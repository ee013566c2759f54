"""Clusters: the scripts of docs/studies/clusters.md; one that loses its worker and scheduler."""

import json
import os
import runpy
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import xarray as xr
from bits import assert_same_bits
from program import dust
from scenes import EXAMPLES, ROOT, extensions_forgotten, write_spring
from scenes import SPRING_TEXT as TINY

from dusttaichi.commands.options import part_of
from dusttaichi.errors import DustError
from dusttaichi.results.files import RESULT
from dusttaichi.running import execute
from dusttaichi.scene import load
from dusttaichi.studies import pool
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies.sweep_study import sweep

SCRIPT = EXAMPLES / "job_array.sh"
KEYS = ["--set", "stop.steps=50,60,70"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with tiny.yaml and its method, `dust` of this Python on the PATH."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    write_spring(tmp_path)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    monkeypatch.setenv("PATH", path)
    monkeypatch.chdir(tmp_path)
    with extensions_forgotten():
        yield tmp_path


def steps(folder):
    """Steps of the runs that have a result, and when their results were written."""
    counts = {}
    for path in sorted(folder.glob("runs/tiny-sweep/*/result.nc")):
        with xr.open_dataset(path) as series:
            counts[int(series.step[-1])] = path.stat().st_mtime_ns
    return counts


@pytest.mark.long  # four starts of the program
def test_a_job_array_does_the_sweep_in_parts(folder):
    script = ["bash", str(SCRIPT), "sweep", "tiny.yaml", *KEYS]
    for task, expected in ((1, [60]), (0, [50, 60, 70])):
        env = os.environ | array(task, 0, 1, parts=2)
        process = subprocess.run(script, env=env, capture_output=True, text=True)
        assert process.returncode == 0, process.stderr
        assert sorted(steps(folder)) == expected
    assert "when all are done" in process.stdout
    assert not (folder / "runs/tiny-sweep/sweep.nc").exists()
    steps_before = steps(folder)
    dust("sweep", "tiny.yaml", *KEYS, "--resume", "-q", "--no-figures")
    assert steps(folder) == steps_before  # gathered, and nothing computed again
    with xr.open_dataset(folder / "runs/tiny-sweep/sweep.nc") as data:
        assert set(data.status.values.ravel()) == {f"finished: {n} steps" for n in (50, 60, 70)}
    assert not (folder / "runs/tiny-sweep/sweep.png").exists()


@pytest.mark.long  # tests of ensembles send runs to Dask in every suite
def test_a_sweep_goes_to_the_workers_of_jobqueue(folder, cluster):
    example = runpy.run_path(str(EXAMPLES / "jobqueue.py"))
    words = "sweep", "tiny.yaml", ["stop.steps=50,60"], "-q", "--no-figures"
    code = example["study"](cluster, *words)
    assert code == 0 and sorted(steps(folder)) == [50, 60]
    assert (folder / "runs/tiny-sweep/sweep.nc").exists()


@pytest.mark.parametrize("text", ["0/2", "3/2", "1", "a/b", "1/0"])
def test_a_part_that_is_none(text):
    with pytest.raises(DustError, match="allowed: K/N with K from 1 to N"):
        part_of(text)
    assert part_of(None) == (1, 1) and part_of("2/8") == (2, 8)


STUB = """#!/bin/bash
echo "$@"
trap 'echo checkpoint; exit 130' TERM
[ -z "$WAITS" ] && exit 0
echo started >&2
while true; do sleep 0.02; done
"""


@pytest.fixture
def stub(tmp_path, monkeypatch):
    """A program `dust` that prints its arguments and, if it WAITS, the signal TERM."""
    (tmp_path / "dust").write_text(STUB)
    (tmp_path / "dust").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")


def array(task, first, last, parts=None):
    """Environment of a task of `sbatch --array=first-last`."""
    numbers = {"ID": task, "MIN": first, "MAX": last, "COUNT": last - first + 1}
    variables = {f"SLURM_ARRAY_TASK_{name}": str(number) for name, number in numbers.items()}
    return variables | ({} if parts is None else {"PARTS": str(parts)})


def part_of_task(*arguments, **options):
    words = ["bash", str(SCRIPT), "collide", "a b.yaml"]
    env = os.environ | array(*arguments, **options)
    process = subprocess.run(words, env=env, capture_output=True, text=True)
    return (
        process.stdout.partition("--part ")[2].split()[0]
        if process.returncode == 0
        else process.stderr
    )


def test_every_array_has_the_parts_of_the_study(stub):
    """Tasks from 0 or 1 on have all parts; one of them again, alone, has the same one."""
    for first in (0, 1):
        results = [part_of_task(task, first, first + 3) for task in range(first, first + 4)]
        assert sorted(results) == ["1/4", "2/4", "3/4", "4/4"]
        assert [part_of_task(task, task, task) for task in range(first, first + 4)] == results
    assert part_of_task(5, 0, 7, parts=8) == "6/8"
    assert "PARTS=8 sbatch" in part_of_task(5, 0, 7)  # two tasks would do the same part


def test_the_signal_before_the_time_limit_reaches_dust(stub):
    """SLURM sends it to the process of the script (B:), which therefore is that of dust."""
    assert "#SBATCH --signal=B:TERM@120\n" in SCRIPT.read_text()
    words = ["bash", str(SCRIPT), "collide", "a.yaml"]
    env = os.environ | array(0, 0, 3) | {"WAITS": "1"}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, env=env, **pipes) as process:
        assert process.stderr.readline() == "started\n"
        process.send_signal(signal.SIGTERM)
        assert process.wait(20) == 130
        assert "checkpoint" in process.stdout.read()


SCENE = TINY.replace("{steps: 10}", "{steps: 1000}")
SCENE += "output: {series: {steps: 10}, snapshots: {steps: 100}, checkpoint: 0.2 s}\n"
CHECKPOINT_TIMEOUT = 120.0  # s until a sweep without its scheduler has to have ended


class Cluster:
    """A scheduler and workers, each a process. A context manager."""

    def __init__(self, folder, workers=1):
        self._file = Path(folder) / "scheduler.json"
        self._file.unlink(missing_ok=True)
        self.scheduler = self._start("dask_scheduler", "--port", "0", "--host", "127.0.0.1")
        while not self._file.exists() or not self._file.read_text().strip():
            assert self.scheduler.poll() is None, "the scheduler does not start"
            time.sleep(0.05)
        self.address = json.loads(self._file.read_text())["address"]
        self.workers = []
        for _ in range(workers):
            self.add_worker()

    def add_worker(self):
        """One more worker, with one thread, which nobody starts again when it ends."""
        options = ("--no-nanny", "--nthreads", "1", "--death-timeout", "20")
        self.workers.append(self._start("dask_worker", *options))

    def kill_worker(self):
        """SIGKILL for the first of the workers."""
        worker = self.workers.pop(0)
        worker.send_signal(signal.SIGKILL)
        worker.wait()

    def kill_scheduler(self):
        """SIGKILL for the scheduler."""
        self.scheduler.send_signal(signal.SIGKILL)
        self.scheduler.wait()

    def _start(self, program, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.{program}", "--no-dashboard"]
        paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
        return subprocess.Popen(
            [*command, "--scheduler-file", str(self._file), *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            start_new_session=True,
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.mark.long  # half a minute; a crash on this machine: test_extremes
def test_what_is_lost_is_computed_again(tmp_path, monkeypatch, cluster):
    """A worker alone; after the scheduler the sweep ends with a message and continues elsewhere."""
    monkeypatch.setattr(pool, "CONNECT_TIMEOUT", "3 s")
    write_spring(tmp_path, seconds=0.002)
    (tmp_path / "scene.yaml").write_text(SCENE)
    with extensions_forgotten():
        plan = sweep(load(tmp_path / "scene.yaml"), ["start=0.5,1.0"], tmp_path / "sweep")
        results = losing(plan, tmp_path)
        assert sorted(result.code for result in results) == [0, 1], results
        assert all("--resume" in result.text for result in results if result.code)
        repeated_answers = engine.run(plan, scheduler=cluster.scheduler_address, resume=True)
        assert not any(result.code for result in repeated_answers.values()), repeated_answers
        for member in plan.members:
            uninterrupted = execute(member.scene, tmp_path / "whole" / member.directory.name)
            assert_same_bits(uninterrupted / RESULT, member.directory / RESULT)


def losing(plan, folder):
    """Results of the sweep, once a run has reported that it continues and all has been lost."""
    lost, finished = threading.Event(), threading.Event()
    with Cluster(folder) as cluster:

        def lose():
            cluster.kill_worker()
            time.sleep(0.5)
            cluster.add_worker()
            finished.wait(CHECKPOINT_TIMEOUT)
            cluster.kill_scheduler()

        def report(progress):
            if any(progress.running.values()) and not lost.is_set():
                lost.set()
                threading.Thread(target=lose, daemon=True).start()
            if progress.finished:
                finished.set()

        results = list(engine.run(plan, scheduler=cluster.address, report=report).values())
    assert lost.is_set(), "the sweep was at its end before anything was lost"
    return results
