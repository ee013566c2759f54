"""Engine of studies: computes the points of a study until it lists no further ones.

Points are changed scenes (points.Point), which run by the `execute` of `dust run`, or requests to a
task (requests.Request), both in worker processes or on a Dask cluster. `run` lists the points again
with the results so far. A point with a stored result is finished, also after an interruption.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any

from dusttaichi.compute.processor import usable_cores
from dusttaichi.errors import StartError
from dusttaichi.results.pieces import make_exists_error
from dusttaichi.results.run_lock import RunLock
from dusttaichi.running.interrupts import noted_signals
from dusttaichi.running.progress import open_bar, show_study
from dusttaichi.studies.jobs import Job, group_into_jobs, read_content
from dusttaichi.studies.pool import Pool, open_pool
from dusttaichi.studies.result_store import ALL_POINTS, ResultStore
from dusttaichi.studies.study_types import PointResult, Study, StudyPoint
from dusttaichi.studies.workers import INTERRUPTED, PROCESS_LOST, Answer, Worker, idle_workers

POLL_INTERVAL = 0.2  # s between two checks of the signals
Futures = dict[Future[dict[str, Answer]], Job]
Answers = SimpleQueue[tuple[str, Answer]]  # with the label of each


@dataclass
class Progress:
    """Progress of a study: number of runs, of finished ones, and fractions of the running ones.

    report: called with this object after each change, which may come from any thread.
    """

    total: int
    finished: int
    report: Callable[[Progress], None]
    running: dict[str, float] = field(default_factory=dict)  # label -> fraction

    def __post_init__(self) -> None:
        self._lock = threading.Lock()
        self._finished_labels: set[str] = set()

    def add_runs(self, total: int, finished: int) -> None:
        """Add further runs, of which some are finished."""
        with self._lock:
            self.total, self.finished = self.total + total, self.finished + finished
            self.report(self)

    def set_fraction(self, label: str, fraction: float) -> None:
        """Set the completed fraction of a running job."""
        with self._lock:
            # a report of a cluster may come after the end of the run
            if label not in self._finished_labels:
                self.running[label] = fraction
                self.report(self)

    def finish_job(self, label: str, count: int) -> None:
        """Add the finished runs of a job that has ended."""
        with self._lock:
            self._finished_labels.add(label)
            self.finished += count
            self.running.pop(label, None)
            self.report(self)


def run(
    study: Study,
    *,
    force: bool = False,
    resume: bool = False,
    scheduler: str | None = None,
    jobs: int | None = None,
    part: tuple[int, int] = ALL_POINTS,
    report: Callable[[Progress], None] | None = None,
    log: Callable[[str], None] = lambda text: None,
    **execute_options: Any,
) -> dict[str, PointResult]:
    """Run a Study; returns label -> PointResult of all of its points, also of those that fail.

    jobs: runs at a time on this machine, at most; None: as many as its cores allow. scheduler:
    address of a Dask cluster, whose workers need no access to this disk. part: (k, n), only every
    n-th run, from the k-th on, counted from 1, so that several jobs can divide a study. report:
    called with the Progress; None: a bar shows it, in a notebook or on a terminal. execute_options:
    further arguments of `execute` for runs that are not finished. Raises DustError (existing
    results, no scheduler, and as soon as the backend of a run cannot start), KeyboardInterrupt
    (after all checkpoints are written).
    """
    if report is None:
        with open_bar() as bar:
            options: dict[str, Any] = {"force": force, "resume": resume, "scheduler": scheduler}
            options |= {"jobs": jobs, "part": part, "report": show_study(bar), "log": log}
            return run(study, **options, **execute_options)
    results: dict[str, PointResult] = {}
    is_complete = part == ALL_POINTS
    store = ResultStore(force=force, resume=resume, timed=study.timed, part=part)
    progress = Progress(0, 0, report)
    # with parts, each run has its own lock
    directory = study.directory if is_complete else None
    with nullcontext() if directory is None else RunLock(directory), idle_workers() as idle:
        if directory is not None and study.file is not None and not force and not resume:
            if study.file.exists():
                raise make_exists_error(study.file, "with the missing runs")
        runner = PointRunner(store, progress, scheduler, jobs, idle, log, execute_options)
        while points := [p for p in study.points(results) if p.label not in results]:
            selected = {p.label: p for p in points[part[0] - 1 :: part[1]]}
            for label, answer in runner.answer_points(selected).items():
                measured, cost = None, None
                if answer.code == 0:
                    measured, cost = selected[label].measure_answer(study, answer)
                results[label] = PointResult(
                    selected[label], answer.code, answer.text, measured, cost
                )
            if not is_complete:
                break
    return results


@dataclass(frozen=True)
class PointRunner:
    """Runs points, with the arguments of `run`. idle: list of idle Workers."""

    store: ResultStore
    progress: Progress
    scheduler: str | None
    jobs: int | None
    idle: list[Worker]
    log: Callable[[str], None]
    execute_options: dict[str, Any]

    def answer_points(self, points: dict[str, StudyPoint]) -> dict[str, Answer]:
        """label -> Answer of the points (by label), in their order."""
        stored = {label: point.find_answer(self.store) for label, point in points.items()}
        answers = {label: answer for label, answer in stored.items() if answer is not None}
        missing = {label: point for label, point in points.items() if label not in answers}
        self.progress.add_runs(len(points), len(answers))
        if answers:
            self.log(f"{len(answers)} of {len(points)} are already finished")
        answers |= self._run_points(missing) if missing else {}
        return {label: answers[label] for label in points}

    def _run_points(self, points: dict[str, StudyPoint]) -> dict[str, Answer]:
        """label -> Answer of points (by label), in the order of their ends."""
        remote = self.scheduler is not None
        answers: dict[str, Answer] = {}
        arrived: Answers = SimpleQueue()
        start_errors: list[str] = []
        first_point = next(iter(points.values()))
        workers, threads = first_point.choose_processes(len(points), usable_cores(), remote=remote)
        workers = min(workers, self.jobs or workers)

        def receive(label: str, fraction: float | None, answer: dict[str, Any] | None) -> None:
            if answer is not None:
                arrived.put((label, Answer(**answer)))
            elif fraction is not None:
                self.progress.set_fraction(label, fraction)

        def accept(label: str, answer: Answer) -> None:
            if label in answers:  # it may have arrived before its job
                return
            answers[label] = answer
            if answer.startable:
                points[label].save_answer(answer, self.store)
                self.progress.finish_job(label, int(answer.code != INTERRUPTED))
            else:
                start_errors.append(answer.text)
                pool.stop()  # the next ones could not start either

        with (
            noted_signals() as signals,
            open_pool(self.scheduler, workers, receive, self.idle) as pool,
        ):
            options: dict[str, Any] = {"remote": remote, "execute_options": self.execute_options}
            tasks = [point.to_task(threads, self.store, **options) for point in points.values()]
            futures = _submit_jobs(pool, group_into_jobs(tasks, workers, remote=remote), points)
            _collect_answers(pool, futures, signals, arrived, accept=accept, log=self.log)
        if start_errors:
            raise StartError(
                f"{start_errors[0]}. The study ends at the first run that cannot start."
            )
        return answers


def _collect_answers(
    pool: Pool,
    futures: Futures,
    signals: Sequence[Any],
    arrived: Answers,
    *,
    accept: Callable[[str, Answer], None],
    log: Callable[[str], None],
) -> None:
    """Call accept(label, Answer) for each point as it ends; after a signal stop the pool.

    futures: emptied. signals: of `noted_signals`. Raises KeyboardInterrupt at the end where it was
    stopped.
    """
    stopping = False
    while futures:
        finished_futures, _ = wait(futures, timeout=POLL_INTERVAL, return_when=FIRST_COMPLETED)
        with suppress(Empty):
            while True:
                accept(*arrived.get_nowait())
        for future in finished_futures:
            for label, answer in _read_answers(future, futures.pop(future)).items():
                accept(label, answer)
        if signals and not stopping:
            stopping = True
            log("stopping; runs write their checkpoints first")
            pool.stop()
    if stopping:
        raise KeyboardInterrupt


def _submit_jobs(pool: Pool, jobs: Sequence[Job], points: dict[str, StudyPoint]) -> Futures:
    """Future -> job. Input files of several jobs are sent once."""
    futures: Futures = {}
    inputs_by_paths: dict[tuple[str, ...], Any] = {}
    for job in jobs:
        remote_points = [points[label] for label in job.labels] if job.remote else []
        paths = tuple(dict.fromkeys(path for point in remote_points for path in point.inputs))
        if paths not in inputs_by_paths:
            inputs_by_paths[paths] = pool.send_inputs({path: read_content(path) for path in paths})
        futures[pool.submit(job, inputs_by_paths[paths])] = job
    return futures


def _read_answers(future: Future[dict[str, Answer]], job: Job) -> dict[str, Answer]:
    """label -> Answer of a job with a finished Future, also of one that was lost."""
    if future.cancelled():
        text = "the cluster has cancelled it, its scheduler may have ended: continue with --resume"
    elif (error := future.exception()) is not None:
        text = str(error) or repr(error)
    else:
        return future.result()
    return {label: Answer(PROCESS_LOST, text) for label in job.labels}
