"""One engine of studies: which runs, what of each, which more.

A study names points: changed scenes (points.Point), or requests to a task (requests.Request). `run`
makes those by the `execute` of `dust run` and sends these, in processes that stay or on a Dask
cluster, and asks again with these results until the study wants no more. A run with a result, and
a row of an answer, is a finished point: after an interruption the missing ones are left.
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Protocol

import xarray as xr

from dusttaichi import analysis
from dusttaichi.compute.processor import usable_cores
from dusttaichi.errors import StartError
from dusttaichi.results.pieces import make_exists_error
from dusttaichi.results.run_lock import RunLock
from dusttaichi.running.interrupts import noted_signals
from dusttaichi.running.progress import open_bar, show_study
from dusttaichi.scene import Scene
from dusttaichi.studies.jobs import Task, content_of, jobs_of
from dusttaichi.studies.pool import open_pool
from dusttaichi.studies.requests import WHOLE, Rows
from dusttaichi.studies.workers import INTERRUPTED, LOST, Answer, idle_workers

POLL = 0.2  # s between two checks of the signals


class StudyPoint(Protocol):
    """A point that a study wants: a run (points.Point) or a request (requests.Request).

    Attributes
    ----------
    label
        Its name, other than that of any other point of the study.
    inputs
        Paths of the files that it reads, relative to the current directory.
    """

    label: str
    inputs: Sequence[str]

    def find_answer(self, shelf: "Shelf") -> Answer | None:
        """Its Answer where it is finished; raises DustError where that must not be overwritten."""

    def store(self, answer: Answer, shelf: "Shelf") -> None:
        """Keep an Answer that came. Raises DustError."""

    def choose_processes(self, count: int, cores: int, *, remote: bool) -> tuple[int, Any]:
        """(processes for `count` points like this on some cores, threads of each)."""

    def to_task(self, threads: Any, shelf: "Shelf", *, remote: bool, how: dict) -> Task:
        """The task for a worker process."""

    def measure_answer(self, study: "Study", answer: Answer) -> tuple[Any, float | None]:
        """(numbers for the study, cost [s] if it is timed) of a finished one."""


class Shelf:
    """Finished points of a study, as far as they are stored.

    force: they are made again; resume: the missing ones are; else there must be none. timed: costs
    are wanted. part: (k, n) of the study that is made. modes: label -> mode of each run that has
    been looked for.
    """

    def __init__(self, *, force, resume, timed, part=WHOLE):
        self.force, self.resume, self.timed, self._part = force, resume, timed, part
        self.modes, self._rows = {}, {}

    def rows(self, file):
        """The Rows of a file, or of None."""
        if file not in self._rows:
            how = {"force": self.force, "resume": self.resume, "part": self._part}
            self._rows[file] = Rows(file, **how)
        return self._rows[file]


@dataclass(frozen=True)
class PointResult:
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

    point: StudyPoint
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

    def points(self, results: Mapping[str, PointResult]) -> list[StudyPoint]:
        """Points that are wanted, given those found by their labels.

        The study ends where all of them are found.
        """

    def measure(self, run: analysis.Run) -> Any:
        """Numbers of a finished run that `dataset` needs; of requests it is their answer."""

    def dataset(self, results: Mapping[str, PointResult]) -> xr.Dataset:
        """The dataset that is written at the end."""


class StagedStudy:
    """Study whose points come in stages, each made from the results of those before.

    `stages` is a generator: it yields the points of a stage, and continues once `results`, label ->
    PointResult, has all of them; a stage without missing points runs nothing.
    """

    _stages, _stage = None, ()

    def stages(self):
        """Generator of the lists of points."""
        raise NotImplementedError

    def points(self, results):
        """Missing points of the present stage; none after the last one."""
        self.results = results
        self._stages = self._stages or self.stages()
        while self._stage is not None:
            if missing := [point for point in self._stage if point.label not in results]:
                return missing
            self._stage = next(self._stages, None)
        return []


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

    def add_runs(self, total, done):
        """Add further runs, of which some are finished."""
        with self._lock:
            self.total, self.done = self.total + total, self.done + done
            self.report(self)

    def set_share(self, label, share):
        """Set the share of a running job."""
        with self._lock:
            if label not in self._ended:  # a report of a cluster may come after the end of the run
                self.running[label] = share
                self.report(self)

    def finish_job(self, label, count):
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
    part=WHOLE,
    report=None,
    log=lambda text: None,
    **how,
):
    """Run a Study; returns label -> PointResult of all of its points, also of those that fail.

    jobs: runs at a time on this machine, at most; None: as many as its cores allow. scheduler:
    address of a Dask cluster, whose workers need no access to this disk. part: (k, n), only every
    n-th run, from the k-th on, counted from 1, so that several jobs can share a study. report:
    called with the Progress; None: a bar shows it, in a notebook or on a terminal. how: further
    arguments of `execute` for runs that are not finished. Raises DustError (existing results, no
    scheduler, and as soon as the backend of a run cannot start), KeyboardInterrupt (after all
    checkpoints are written).
    """
    if report is None:
        with open_bar() as bar:
            how |= {"force": force, "resume": resume, "scheduler": scheduler, "jobs": jobs}
            return run(study, part=part, report=show_study(bar), log=log, **how)
    results, is_complete = {}, part == WHOLE
    shelf = Shelf(force=force, resume=resume, timed=study.timed, part=part)
    progress = Progress(0, 0, report)
    how = {"scheduler": scheduler, "jobs": jobs, "log": log, "how": how}
    # with parts, each run has its own lock
    locked = is_complete and study.directory is not None
    with RunLock(study.directory) if locked else nullcontext(), idle_workers() as idle:
        if locked and not force and not resume and study.file.exists():
            raise make_exists_error(study.file, "with the missing runs")
        while points := [p for p in study.points(results) if p.label not in results]:
            chosen = {p.label: p for p in points[part[0] - 1 :: part[1]]}
            for label, answer in _run_round(chosen, progress, shelf, idle=idle, **how).items():
                numbers = None, None
                if answer.code == 0:
                    numbers = chosen[label].measure_answer(study, answer)
                results[label] = PointResult(chosen[label], answer.code, answer.text, *numbers)
            if not is_complete:
                break
    return results


def _run_round(points, progress, shelf, *, log, **how):
    """label -> Answer of the points (by label), in their order."""
    answers = {label: point.find_answer(shelf) for label, point in points.items()}
    missing = {label: points[label] for label, answer in answers.items() if answer is None}
    answers = {label: answer for label, answer in answers.items() if answer is not None}
    progress.add_runs(len(points), len(answers))
    if answers:
        log(f"{len(answers)} of {len(points)} are already finished")
    answers |= _run_points(missing, progress, shelf, log=log, **how) if missing else {}
    return {label: answers[label] for label in points}


def _run_points(points, progress, shelf, *, scheduler, jobs, idle, log, how):
    """label -> Answer of points (by label), in the order of their ends."""
    remote, answers, arrived = scheduler is not None, {}, SimpleQueue()
    reasons = []  # why runs could not start
    workers, threads = next(iter(points.values())).choose_processes(
        len(points), usable_cores(), remote=remote
    )
    workers = min(workers, jobs or workers)

    def receive(label, share, answer):
        if answer is None:
            progress.set_share(label, share)
        else:
            arrived.put((label, Answer(**answer)))

    def take(label, answer):
        if label in answers:  # it may have arrived before its job
            return
        answers[label] = answer
        if answer.startable:
            points[label].store(answer, shelf)
            progress.finish_job(label, int(answer.code != INTERRUPTED))
        else:
            reasons.append(answer.text)
            pool.stop()  # the next ones could not start either

    with noted_signals() as signals, open_pool(scheduler, workers, receive, idle) as pool:
        tasks = [point.to_task(threads, shelf, remote=remote, how=how) for point in points.values()]
        jobs = jobs_of(tasks, workers, remote=remote)
        futures = _submit(pool, jobs, points, remote)
        _drain(pool, futures, signals, arrived, take=take, log=log)
    if reasons:
        raise StartError(f"{reasons[0]}. The study ends at the first run that cannot start.")
    return answers


def _drain(pool, futures, signals, arrived, *, take, log):
    """Call take(label, Answer) for each point as it ends; after a signal stop the pool.

    futures: Future -> its job, emptied. signals: of `noted_signals`. arrived: queue of (label,
    Answer). Raises KeyboardInterrupt at the end where it was stopped.
    """
    stopping = False
    while futures:
        done, _ = wait(futures, timeout=POLL, return_when=FIRST_COMPLETED)
        with suppress(Empty):
            while True:
                take(*arrived.get_nowait())
        for future in done:
            for label, answer in _answers_of(future, futures.pop(future)).items():
                take(label, answer)
        if signals and not stopping:
            stopping = True
            log("stopping; runs write their checkpoints first")
            pool.stop()
    if stopping:
        raise KeyboardInterrupt


def _submit(pool, jobs, points, remote):
    """Future -> job. Input files of several jobs are shared once."""
    futures, shared = {}, {}
    for job in jobs:
        remote_points = [points[label] for label in job.labels] if remote else []
        paths = tuple(dict.fromkeys(path for point in remote_points for path in point.inputs))
        if paths not in shared:
            shared[paths] = pool.share({path: content_of(path) for path in paths})
        futures[pool.submit(job, shared[paths])] = job
    return futures


def _answers_of(future, job):
    """label -> Answer of a job with a finished Future, also of one that was lost."""
    if future.cancelled():
        text = "the cluster has cancelled it, its scheduler may have ended: continue with --resume"
    elif (error := future.exception()) is not None:
        text = str(error) or repr(error)
    else:
        return future.result()
    return {label: Answer(LOST, text) for label in job.labels}
