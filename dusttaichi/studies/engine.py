"""One engine of studies: which runs, what of each, which more.

A study names points, which are changed scenes. `run` makes each by the `execute` of `dust run`, in
processes that stay or on a Dask cluster, and asks again with what was found until the study wants
no more. A run with a result is a point that is found: after an interruption the missing ones are
left.
"""

import os
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import xarray as xr

from dusttaichi import analysis, files
from dusttaichi.errors import DustError
from dusttaichi.files import CHECKPOINT, RESULT, run_files
from dusttaichi.processes import usable_cores
from dusttaichi.results.pieces import already_there
from dusttaichi.run import checkpoint
from dusttaichi.run.interrupts import noted_signals
from dusttaichi.scene import Scene
from dusttaichi.studies.jobs import Job, JobResult
from dusttaichi.studies.points import Point
from dusttaichi.studies.pool import idle_workers, open_pool
from dusttaichi.studies.settings import input_files
from dusttaichi.studies.store import cost_of, mode_of, store
from dusttaichi.studies.workers import INTERRUPTED, POLL


@dataclass(frozen=True)
class Found:
    """Result of a point.

    Attributes
    ----------
    point
    code
        0, that of a DustError (2: refused, 3: stopped by a guard), or 1: the process was lost.
    text
        Why it failed, or "".
    measured
        Numbers that the study measured of the run, None of a failed one.
    cost
        Processor time of its steps [s], if the study is timed.
    """

    point: Point
    code: int = 0
    text: str = ""
    measured: Any = None
    cost: float | None = None

    @property
    def ok(self) -> bool:
        """True where the run ended regularly."""
        return self.code == 0


class Study(Protocol):
    """Study: points of a scene, and numbers of their runs.

    Attributes
    ----------
    scene
        Scene before the changes of the points.
    directory
        Directory of the results.
    file
        File of the dataset.
    timed
        True where the processor time of the runs is wanted, by this code.
    """

    scene: Scene
    directory: Path
    file: Path
    timed: bool

    def points(self, found: Mapping[str, Found]) -> list[Point]:
        """Points that are wanted, given those found by their labels.

        The study ends where all of them are found.
        """

    def measure(self, run: analysis.Run) -> Any:
        """Numbers of a finished run that `dataset` needs."""

    def dataset(self, found: Mapping[str, Found]) -> xr.Dataset:
        """The dataset that is written at the end."""


@dataclass
class Progress:
    """Progress of a study: number of runs, of finished ones, and shares of the running ones.

    report: called with this object after each change, which may come from any thread.
    """

    total: int
    done: int
    report: Callable[["Progress"], None]
    running: dict[str, float] = field(default_factory=dict)  # label -> share

    def __post_init__(self):
        self._lock, self._ended = threading.Lock(), set()

    def more(self, total, done):
        """Add further runs, of which some are finished."""
        with self._lock:
            self.total, self.done = self.total + total, self.done + done
            self.report(self)

    def heard(self, label, share):
        """Set the share of a running job."""
        with self._lock:
            if label not in self._ended:  # a report of a cluster may come after the end of the run
                self.running[label] = share
                self.report(self)

    def ended(self, label, count):
        """Add the finished runs of a job that has ended."""
        with self._lock:
            self._ended.add(label)
            self.done += count
            self.running.pop(label, None)
            self.report(self)


def run(
    study,
    *,
    force=False,
    resume=False,
    scheduler=None,
    jobs=None,
    part=(1, 1),
    report=lambda progress: None,
    log=lambda text: None,
    **how,
):
    """Run a Study; returns label -> Found of all of its points, also of those that fail.

    jobs: runs at a time on this machine, at most; None: as many as its cores allow. scheduler:
    address of a Dask cluster, whose workers need no access to this disk. part: (k, n), only every
    n-th run, from the k-th on, counted from 1, so that several jobs can share a study. how: further
    arguments of `execute` for runs that are not finished. Raises DustError (existing results, no
    scheduler), KeyboardInterrupt (after all checkpoints are written).
    """
    found, whole = {}, part == (1, 1)
    progress = Progress(0, 0, report)
    how = {"scheduler": scheduler, "jobs": jobs, "log": log, "how": how}
    how |= {"timed": study.timed}
    # with parts, each run has its own lock
    with files.RunLock(study.directory) if whole else nullcontext(), idle_workers() as idle:
        how["idle"] = idle
        if whole and not force and not resume and study.file.exists():
            raise already_there(study.file, "with the missing runs")
        while points := [p for p in study.points(found) if p.label not in found]:
            chosen = {p.label: p for p in points[part[0] - 1 :: part[1]]}
            for label, result in _round(chosen, progress, force=force, resume=resume, **how):
                found[label] = _found(study, chosen[label], result)
            if not whole:
                break
    return found


def _found(study, point, result):
    """The Found of a point with this JobResult."""
    if result.code != 0:
        return Found(point, result.code, result.text)
    with analysis.open_run(point.directory) as run:
        measured = study.measure(run)
    return Found(point, measured=measured, cost=cost_of(point) if study.timed else None)


def _round(points, progress, *, force, resume, timed, log, **how):
    """(label, JobResult) of the points (label -> Point), of the finished ones first."""
    if not force and not resume:
        for path in (point.directory / RESULT for point in points.values()):
            if path.exists():
                raise already_there(path, "with the missing runs")
    modes = {n: mode_of(point, force, resume, timed=timed) for n, point in points.items()}
    left = {label: mode for label, mode in modes.items() if mode is not None}
    progress.more(len(points), len(points) - len(left))
    if len(left) < len(modes):
        log(f"{len(modes) - len(left)} of {len(modes)} runs are already finished")
    results = {label: JobResult(label, 0, "") for label in points}
    if left:
        results |= _do(points, left, progress, timed=timed, log=log, **how)
    return results.items()


def shares(scene, runs, cores):
    """(simultaneous runs, threads of each or "auto") for a number of runs and of cores.

    A GPU takes one run at a time.
    """
    threads = scene.numerics.threads
    if runs == 1 or scene.numerics.backend != "cpu":
        return 1, threads
    if threads == "auto":
        threads = max(1, cores // runs)
    return min(runs, max(1, cores // threads)), threads


def _do(points, left, progress, *, scheduler, jobs, idle, timed, log, how):
    """label -> JobResult of the runs in `left` (label -> mode), in the order of their ends."""
    scene = points[next(iter(left))].scene
    workers, threads = shares(scene, len(left), usable_cores())
    workers = min(workers, jobs or workers)
    remote, results = scheduler is not None, {}
    if remote and scene.numerics.threads == "auto":
        threads = 1  # a task takes one thread of a worker, whose cores are not known here

    def take(result):
        results[result.label] = result
        store(result, points[result.label].directory, timed=timed)
        progress.ended(result.label, int(result.code != INTERRUPTED))

    with (
        noted_signals() as signals,
        open_pool(scheduler, workers, progress.heard, idle) as pool,
    ):
        tasks = [
            _job(points[label], mode, threads=threads, remote=remote, timed=timed, how=how)
            for label, mode in left.items()
        ]
        futures = _submit(pool, tasks, points, remote)
        drain(
            pool, futures, take, signals, lambda: log("stopping: the runs write their checkpoints")
        )
    return results


def drain(pool, futures, take, signals, warn):
    """Call take(JobResult) at the end of each job; after a signal warn(), and stop the pool.

    futures: Future -> label of the job, emptied. signals: of `noted_signals`. Raises
    KeyboardInterrupt at the end where it was stopped.
    """
    stopping = False
    while futures:
        done, _ = wait(futures, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            take(_result_of(future, futures.pop(future)))
        if signals and not stopping:
            stopping = True
            warn()
            pool.stop()
    if stopping:
        raise KeyboardInterrupt


def _submit(pool, jobs, points, remote):
    """Future -> label of the run. Input files of several jobs are shared once."""
    futures, shared = {}, {}
    for job in jobs:
        paths = tuple(input_files(points[job.label].scene)) if remote else ()
        if paths not in shared:
            shared[paths] = pool.share({path: content_of(path) for path in paths})
        futures[pool.submit(job, shared[paths])] = job.label
    return futures


def _job(point, mode, *, threads, remote, **how):
    """The Job of a point. remote: with the files that it needs. how: `timed` and `how` of it."""
    scene = point.scene.with_value("numerics.threads", threads).to_yaml()
    if not remote:
        return Job(point.label, scene, mode, os.path.abspath(point.directory), **how)
    if mode == "resume":
        files = {name: content_of(point.directory / name) for name in run_files(point.directory)}
        return Job(point.label, scene, mode, None, files, **how)
    checkpoint.discard(point.directory / CHECKPOINT)
    return Job(point.label, scene, mode, None, **how)


def content_of(path):
    """Bytes of an input file of jobs. Raises DustError."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise DustError(f"{path} cannot be read: {error.strerror or error}.") from error


def _result_of(future, label):
    """JobResult of a finished Future, also of one whose worker was lost."""
    if future.cancelled():
        lost = "the cluster has cancelled it, its scheduler may have ended: continue with --resume"
        return JobResult(label, 1, lost)
    error = future.exception()
    return future.result() if error is None else JobResult(label, 1, str(error) or repr(error))
