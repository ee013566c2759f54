"""One engine of studies: which runs, what of each, which more.

A study names points: changed scenes (points.Point), or requests to a task (requests.Request). `run`
makes those by the `execute` of `dust run` and sends these, in processes that stay or on a Dask
cluster, and asks again with what was found until the study wants no more. A run with a result, and
a row of an answer, is a point that is found: after an interruption the missing ones are left.
"""

import os
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Protocol

import xarray as xr

from dusttaichi import analysis, files
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.files import CHECKPOINT, RESULT, run_files
from dusttaichi.processes import usable_cores
from dusttaichi.results.pieces import already_there
from dusttaichi.run import checkpoint
from dusttaichi.run.interrupts import noted_signals
from dusttaichi.scene import Scene
from dusttaichi.studies.jobs import Job, JobResult
from dusttaichi.studies.points import Point
from dusttaichi.studies.pool import open_pool
from dusttaichi.studies.requests import Request, Rows, batches
from dusttaichi.studies.settings import input_files
from dusttaichi.studies.store import cost_of, mode_of, stopped, store
from dusttaichi.studies.workers import INTERRUPTED, LOST, POLL, idle_workers


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
        Numbers that the study measured of the run, or the answer to a request; None if failed.
    cost
        Processor time of its steps [s], if the study is timed.
    """

    point: Point | Request
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
        Directory of the results, None of a study that writes none.
    file
        File of the dataset, or None.
    timed
        True where the processor time of the runs is wanted, by this code.
    """

    scene: Scene
    directory: Path | None
    file: Path | None
    timed: bool

    def points(self, found: Mapping[str, Found]) -> list[Point | Request]:
        """Points that are wanted, given those found by their labels.

        The study ends where all of them are found.
        """

    def measure(self, run: analysis.Run) -> Any:
        """Numbers of a finished run that `dataset` needs; of requests it is their answer."""

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
    found, rows, whole = {}, {}, part == (1, 1)
    progress = Progress(0, 0, report)
    how = {"scheduler": scheduler, "jobs": jobs, "log": log, "how": how}
    how |= {"timed": study.timed, "rows": rows}
    # with parts, each run has its own lock
    locked = whole and study.directory is not None
    with files.RunLock(study.directory) if locked else nullcontext(), idle_workers() as idle:
        how["idle"] = idle
        if locked and not force and not resume and study.file.exists():
            raise already_there(study.file, "with the missing runs")
        while points := [p for p in study.points(found) if p.label not in found]:
            chosen = {p.label: p for p in points[part[0] - 1 :: part[1]]}
            for file in {p.file for p in chosen.values() if isinstance(p, Request)} - set(rows):
                rows[file] = Rows(file, force=force, resume=resume)
            for label, result in _round(chosen, progress, force=force, resume=resume, **how):
                found[label] = _found(study, chosen[label], result)
            if not whole:
                break
    return found


def _found(study, point, result):
    """The Found of a point with this JobResult."""
    if result.code != 0:
        return Found(point, result.code, result.text)
    if isinstance(point, Request):
        return Found(point, measured=result.found)
    with analysis.open_run(point.directory) as run:
        measured = study.measure(run)
    return Found(point, measured=measured, cost=cost_of(point) if study.timed else None)


def _round(points, progress, *, force, resume, timed, log, rows, **how):
    """(label, JobResult) of the points (by label), of the finished ones first.

    rows: file -> its Rows.
    """
    left, results = {}, {}
    for label, point in points.items():
        found, mode = {}, "new"
        if isinstance(point, Request):
            found = rows[point.file].known.get(label)
            mode = "new" if found is None else None
        elif not force and not resume and (point.directory / RESULT).exists():
            raise already_there(point.directory / RESULT, "with the missing runs")
        else:
            mode = mode_of(point, force, resume, timed=timed)
        if mode is None:
            text = stopped(point) if timed and isinstance(point, Point) else ""
            code = GuardStop.exit_code if text else 0
            results[label] = JobResult(label, code, text, found=found)
        else:
            left[label] = mode
    progress.more(len(points), len(results))
    if results:
        log(f"{len(results)} of {len(points)} are already finished")
    if left:
        results |= _do(points, left, progress, timed=timed, log=log, rows=rows, **how)
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


def _do(points, left, progress, *, scheduler, jobs, idle, timed, log, rows, how):
    """label -> JobResult of the points in `left` (label -> mode), in the order of their ends."""
    remote, results, arrived = scheduler is not None, {}, SimpleQueue()
    workers, threads = _places([points[label] for label in left], remote)
    workers = min(workers, jobs or workers)

    def heard(label, share, answer=None):
        if answer is None:
            progress.heard(label, share)
        else:
            arrived.put(JobResult(label, **answer))

    def take(result):
        if result.label in results:  # has arrived before its batch
            return
        results[result.label], point = result, points[result.label]
        if isinstance(point, Request):
            rows[point.file].add(result)
        else:
            store(result, point.directory, timed=timed)
        progress.ended(result.label, int(result.code != INTERRUPTED))

    with noted_signals() as signals, open_pool(scheduler, workers, heard, idle) as pool:
        own = {"threads": threads, "remote": remote, "timed": timed, "how": how}
        runs = {n: mode for n, mode in left.items() if not isinstance(points[n], Request)}
        tasks = [_job(points[label], mode, **own) for label, mode in runs.items()]
        requests = [points[label] for label in left if label not in runs]
        tasks += batches(requests, workers, remote=remote)
        futures = _submit(pool, tasks, points, remote)
        stopping = "stopping: the runs write their checkpoints" if runs else "stopping"
        _drain(pool, futures, signals, arrived, take=take, warn=lambda: log(stopping))
    return results


def _places(points, remote):
    """(simultaneous jobs on this machine, threads of a run), by the first of some points."""
    first, cores = points[0], usable_cores()
    if isinstance(first, Request):
        return min(len(points), max(1, cores // (first.cores or cores))), None
    workers, threads = shares(first.scene, len(points), cores)
    if remote and first.scene.numerics.threads == "auto":
        threads = 1  # a task takes one thread of a worker, whose cores are not known here
    return workers, threads


def _drain(pool, futures, signals, arrived, *, take, warn):
    """Call take(JobResult) for each point as it ends; after a signal warn(), and stop the pool.

    futures: Future -> its job, emptied. signals: of `noted_signals`. arrived: queue of the
    JobResults of requests. Raises KeyboardInterrupt at the end where it was stopped.
    """
    stopping = False
    while futures:
        done, _ = wait(futures, timeout=POLL, return_when=FIRST_COMPLETED)
        with suppress(Empty):
            while True:
                take(arrived.get_nowait())
        for future in done:
            for result in _results_of(future, futures.pop(future)):
                take(result)
        if signals and not stopping:
            stopping = True
            warn()
            pool.stop()
    if stopping:
        raise KeyboardInterrupt


def _submit(pool, jobs, points, remote):
    """Future -> job. Input files of several jobs are shared once."""
    futures, shared = {}, {}
    for job in jobs:
        own = [points[label] for label in job.labels] if remote else []
        paths = tuple(dict.fromkeys(path for point in own for path in _inputs_of(point)))
        if paths not in shared:
            shared[paths] = pool.share({path: content_of(path) for path in paths})
        futures[pool.submit(job, shared[paths])] = job
    return futures


def _inputs_of(point):
    return point.inputs if isinstance(point, Request) else input_files(point.scene)


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


def _results_of(future, job):
    """JobResults of the points of a job with a finished Future, also of one that was lost."""
    if future.cancelled():
        text = "the cluster has cancelled it, its scheduler may have ended: continue with --resume"
    elif (error := future.exception()) is not None:
        text = str(error) or repr(error)
    else:
        return job.results(future.result())
    return [JobResult(label, LOST, text) for label in job.labels]
