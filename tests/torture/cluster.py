"""A Dask cluster of real processes that loses a worker, all workers, its scheduler, in mid-run.

What was lost is computed again, and the results have the bits of runs on this machine; or the sweep
ends with a message and goes on with --resume on another cluster.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from bits import difference
from distributed import LocalCluster
from tally import ROOT

from dusttaichi.errors import DustError
from dusttaichi.files import RESULT
from dusttaichi.run import execute
from dusttaichi.scene import load
from dusttaichi.studies import engine
from dusttaichi.studies.sweep import sweep

HERE = Path(__file__).parent
SCENE = """
name: cluster
method: spring
extensions: [../slow.py]
boundary: {kind: open}
stop: {steps: 1000}
numerics: {time_step: 10 ns, threads: 1}
output: {series: {steps: 10}, snapshots: {steps: 100}, checkpoint: 0.2 s}
"""
SLOW = """
import time
from dataclasses import replace

from dusttaichi import method


class Slow(Spring):
    def advance(self, steps):
        super().advance(steps)
        time.sleep(0.002 * steps)


method.register(replace(METHOD, build=Slow))
"""  # behind the toy's own text: an extension of a scene that takes its time
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


def run(count, seed, tally):
    """All ways to lose something."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for lost in (a_worker, all_workers, the_scheduler):
            name = lost.__name__.replace("_", " ")
            if tally.left([name]):
                (folder / name).mkdir()
                tally.case("lost and complete", tried(lost, folder / name), name)


def tried(lost, folder):
    """What went wrong where something is lost in the middle of a sweep of two runs, or None."""
    # beside the folders of all cases: a scene's extension is one file
    (folder.parent / "slow.py").write_text((HERE.parent / "run" / "spring.py").read_text() + SLOW)
    (folder / "scene.yaml").write_text(SCENE)
    plan = sweep(load(folder / "scene.yaml"), ["start=0.5,1.0"], folder / "sweep")
    try:
        problem = lost(plan, folder)
    except DustError as error:
        return str(error)
    if problem:
        return problem
    for member in plan.members:
        whole = execute(member.scene, folder / "whole" / member.directory.name)
        if problem := difference(whole / RESULT, member.directory / RESULT):
            return problem[:300]
    return None


def a_worker(plan, folder):
    """One of two workers is killed: the other does its work again."""
    with Cluster(folder, workers=2) as cluster:
        return _failed(_sweep(plan, cluster, cluster.kill_worker))


def all_workers(plan, folder):
    """The only worker is killed, and some time later another one comes."""

    def gone_and_back():
        cluster.kill_worker()
        time.sleep(1.0)
        cluster.add_worker()

    with Cluster(folder) as cluster:
        return _failed(_sweep(plan, cluster, gone_and_back))


def the_scheduler(plan, folder):
    """The scheduler is killed: the sweep ends with a message, and goes on on another cluster."""
    with Cluster(folder) as cluster:
        began = time.monotonic()
        try:
            results = _sweep(plan, cluster, cluster.kill_scheduler)
            said = {result.text for result in results if result.code}
        except DustError as error:
            said = {str(error)}
        if time.monotonic() - began > PATIENCE:
            return f"the sweep ends {time.monotonic() - began:.0f} s after its scheduler"
    if not said:
        return "nothing is said"
    if not any("--resume" in text for text in said):
        return f"it is not said what to do: {said}"
    with Cluster(folder) as cluster:
        return _failed(engine.run(plan, scheduler=cluster.address, resume=True).values())


def everything(plan, folder):
    """All workers, and then the scheduler: in one go, for the test that runs often."""
    with Cluster(folder) as cluster:

        def lose():
            cluster.kill_worker()
            cluster.add_worker()
            until = time.monotonic() + PATIENCE
            while not done.wait(0.05) and time.monotonic() < until:
                pass
            cluster.kill_scheduler()

        done = threading.Event()
        results = _sweep(plan, cluster, lose, done)
    codes = [result.code for result in results if result is not None]
    if sorted(codes) != [0, 1]:
        return f"the worker or the scheduler were not missed: {results}"
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        return _failed(engine.run(plan, scheduler=cluster.scheduler_address, resume=True).values())


def _sweep(plan, cluster, lose, done=None):
    """Results of a sweep of which something is lost once a run has reported that it continues.

    done: an event that is set once a run has come to its end.
    """
    lost = threading.Event()

    def report(progress):
        if any(progress.running.values()) and not lost.is_set():
            lost.set()
            threading.Thread(target=lose, daemon=True).start()
        if progress.done and done is not None:
            done.set()

    results = list(engine.run(plan, scheduler=cluster.address, report=report).values())
    return results if lost.is_set() else [*results, None]


def _failed(results):
    """What is wrong with the results of runs that all have to succeed, or None."""
    if None in results:
        return "the sweep was at its end before anything was lost"
    return "; ".join(result.text for result in results if result.code) or None
