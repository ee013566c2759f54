"""A Dask cluster of real processes that loses its worker, and then its scheduler, in mid-run."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from bits import assert_same_bits
from scenes import ROOT, extensions_forgotten, write_spring

from dusttaichi.results.files import RESULT
from dusttaichi.run import execute
from dusttaichi.scene import load
from dusttaichi.studies import engine, pool
from dusttaichi.studies.sweep import sweep

SCENE = """
name: cluster
method: spring
extensions: [spring.py]
boundary: {kind: open}
stop: {steps: 1000}
numerics: {time_step: 10 ns, threads: 1}
output: {series: {steps: 10}, snapshots: {steps: 100}, checkpoint: 0.2 s}
"""
SLOW = """
import time
from dataclasses import replace


class Slow(Spring):
    def advance(self, steps):
        super().advance(steps)
        time.sleep(0.002 * steps)


method.register(replace(METHOD, build=Slow))
"""  # an extension of a scene that takes its time
PATIENCE = 120.0  # s until a sweep without its scheduler has to have ended


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
        how = ("--no-nanny", "--nthreads", "1", "--death-timeout", "20")
        self.workers.append(self._start("dask_worker", *how))

    def kill_worker(self):
        """SIGKILL for the first of the workers."""
        worker = self.workers.pop(0)
        worker.send_signal(signal.SIGKILL)
        worker.wait()

    def kill_scheduler(self):
        """SIGKILL for the scheduler."""
        self.scheduler.send_signal(signal.SIGKILL)
        self.scheduler.wait()

    def _start(self, program, *how):
        command = [sys.executable, "-m", f"distributed.cli.{program}", "--no-dashboard"]
        paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
        return subprocess.Popen(
            [*command, "--scheduler-file", str(self._file), *how],
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
    monkeypatch.setattr(pool, "CONNECT", "3 s")
    write_spring(tmp_path, SLOW)
    (tmp_path / "scene.yaml").write_text(SCENE)
    with extensions_forgotten():
        plan = sweep(load(tmp_path / "scene.yaml"), ["start=0.5,1.0"], tmp_path / "sweep")
        results = losing(plan, tmp_path)
        assert sorted(result.code for result in results) == [0, 1], results
        assert all("--resume" in result.text for result in results if result.code)
        again = engine.run(plan, scheduler=cluster.scheduler_address, resume=True)
        assert not any(result.code for result in again.values()), again
        for member in plan.members:
            whole = execute(member.scene, tmp_path / "whole" / member.directory.name)
            assert_same_bits(whole / RESULT, member.directory / RESULT)


def losing(plan, folder):
    """Results of the sweep, once a run has reported that it continues and all has been lost."""
    lost, done = threading.Event(), threading.Event()
    with Cluster(folder) as cluster:

        def lose():
            cluster.kill_worker()
            time.sleep(0.5)
            cluster.add_worker()
            done.wait(PATIENCE)
            cluster.kill_scheduler()

        def report(progress):
            if any(progress.running.values()) and not lost.is_set():
                lost.set()
                threading.Thread(target=lose, daemon=True).start()
            if progress.done:
                done.set()

        results = list(engine.run(plan, scheduler=cluster.address, report=report).values())
    assert lost.is_set(), "the sweep was at its end before anything was lost"
    return results
