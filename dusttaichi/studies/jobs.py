"""Jobs of a study: requests to a task in a worker process, here or on a cluster; runs are some."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from dusttaichi.errors import DustError
from dusttaichi.results.files import run_files
from dusttaichi.studies.workers import (
    PROCESS_LOST,
    START_ALLOWANCE,
    Answer,
    Worker,
    borrow_worker,
    idle_workers,
)

if TYPE_CHECKING:
    from dusttaichi.studies.worker_main import Parent

SHORTEST_TIMED = 1.0  # core-seconds: the steps of shorter runs are repeated up to this total
RESULT_SUFFIXES = (".nc", ".bin", ".yaml", ".png")  # files of a run in a temporary directory
JOB_SIZE = 16  # requests of a job at most, which share a start on a cluster
BATCHED_JOB_SIZE = 2000  # the same of requests in one call, each answered when it is done
JOBS_PER_PROCESS = 2  # jobs of each process at least, of which the last ones even out


# called with the label of the point, the completed fraction, and the keywords of its Answer or None
Report = Callable[[str, float | None, dict[str, Any] | None], None]


class Channel(Protocol):
    """Channel from a job to its study, of a pool."""

    def is_stopped(self) -> bool:
        """True once all jobs have to stop."""

    @property
    def report(self) -> Report:
        """Function that reports the completed fraction of a task, or the keywords of its Answer."""


@dataclass(frozen=True)
class Task:
    """A call of task(parent, **arguments) in a worker process.

    Attributes
    ----------
    label
        That of the point.
    task
        "module:function"; the function returns a dict of JSON or raises a DustError. It may state
        its fraction done by `parent.progress` (worker_main.Parent).
    arguments
        Values of JSON.
    seconds
        A process that takes longer is killed; its first request may take START_ALLOWANCE more.
    folder
        Files (name -> content) of a temporary directory that is the argument `directory`, and from
        which the results come back. None: without one.
    alone
        True where it is a job of its own.
    together
        Arguments of a call task(parent, calls=..., **together) for several tasks with the same,
        whose `arguments` and labels are `calls`, and which it answers by
        `parent.report(answered=...)` as each is done. None: a call for each.
    """

    label: str
    task: str
    arguments: dict[str, Any]
    seconds: float | None = None
    folder: dict[str, bytes] | None = None
    alone: bool = False
    together: dict[str, Any] | None = None


@dataclass(frozen=True)
class Job:
    """Tasks for a thread of this process or a worker of a Dask cluster, one after another.

    remote: they run in a temporary directory with their input files.
    """

    tasks: tuple[Task, ...]
    remote: bool = False

    @property
    def labels(self) -> list[str]:
        """Labels of the tasks."""
        return [task.label for task in self.tasks]

    def run(
        self, channel: Channel, inputs: Mapping[str, bytes], idle: list[Worker] | None = None
    ) -> dict[str, Answer]:
        """Answers of the tasks by their labels, fewer where all jobs have to stop.

        All but the last are reported, too, as soon as they come. A process that was lost is
        replaced, and the next task follows.

        inputs: relative path -> bytes of the input files, for a temporary directory. idle: idle
        Workers of this machine, of a job that is not remote.
        """
        answers: dict[str, Answer] = {}
        pending = list(self.tasks)
        size = 1 if self.tasks[0].together is None else len(self.tasks)  # tasks of a call
        with ExitStack() as stack:
            folder = stack.enter_context(_lay_out_inputs(inputs)) if self.remote else None
            if idle is None:
                idle = stack.enter_context(idle_workers())
            while pending and not channel.is_stopped():
                called = pending[:size]
                with borrow_worker(idle, called[0].task, channel.is_stopped, folder) as worker:
                    latest = _call_worker(worker, called, channel)
                lost = [label for label, answer in latest.items() if answer.code == PROCESS_LOST]
                if lost and size > 1:  # by which task is not known: one by one from now on
                    latest = {key: value for key, value in latest.items() if key not in lost}
                    size = 1
                answers |= latest
                pending = [task for task in pending if task.label not in latest]
                if not all(answer.startable for answer in latest.values()):
                    break
                for label, answer in latest.items() if pending else ():
                    channel.report(label, 1.0, asdict(answer))
        return answers


def _call_worker(worker: Worker, tasks: Sequence[Task], channel: Channel) -> dict[str, Answer]:
    """label -> Answer of a Worker to a Task, or to several in one call."""
    task = tasks[0]
    if task.together is None:
        return {task.label: _call_for_task(worker, task, channel)}
    answers = {}

    def receive(label: str, **answer: Any) -> None:
        answers[label] = Answer(**answer)
        channel.report(label, 1.0, answer)

    calls = [{"label": task.label, **task.arguments} for task in tasks]
    arguments = {"calls": calls, **task.together}
    end = worker.call(arguments, receive_answer=receive, stopped=channel.is_stopped)
    return {task.label: end for task in tasks} | answers


def _call_for_task(worker: Worker, task: Task, channel: Channel) -> Answer:
    """The Answer of a Worker to a Task."""
    limit = task.seconds
    if limit is not None:
        limit += START_ALLOWANCE * worker.fresh

    def report(fraction: float | None) -> None:
        channel.report(task.label, fraction, None)

    with nullcontext() if task.folder is None else _make_folder(task.folder) as folder:
        folder_argument = {} if folder is None else {"directory": str(folder)}
        arguments = task.arguments | folder_argument
        answer = worker.call(arguments, limit, report=report, stopped=channel.is_stopped)
        if folder is not None:
            files = {name: (folder / name).read_bytes() for name in _list_returned_files(folder)}
            answer = replace(answer, files=files)
    return answer


def group_into_jobs(tasks: Sequence[Task], workers: int, *, remote: bool) -> list[Job]:
    """Jobs of tasks for a number of processes, in their order.

    Large enough to share a start, and enough of them for all processes.
    """
    grouped = [task for task in tasks if not task.alone]
    largest = BATCHED_JOB_SIZE if grouped and grouped[0].together else JOB_SIZE
    size = max(1, min(largest, math.ceil(len(grouped) / (JOBS_PER_PROCESS * workers))))
    groups = [[task] for task in tasks if task.alone]
    groups += [grouped[first : first + size] for first in range(0, len(grouped), size)]
    return [Job(tuple(group), remote) for group in groups]


def read_content(path: str | Path) -> bytes:
    """Bytes of an input file of jobs. Raises DustError."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise DustError(f"{path} cannot be read: {error.strerror or error}.") from error


@contextmanager
def _lay_out_inputs(inputs: Mapping[str, bytes]) -> Iterator[Path]:
    """Temporary directory with input files; yields that of their relative paths (../../a.csv)."""
    up = max((Path(name).parts.count("..") for name in inputs), default=0)
    with _make_folder({}) as folder:
        start_folder = folder.joinpath("inputs", *["d"] * up)
        _write_files(inputs, start_folder)
        yield start_folder


@contextmanager
def _make_folder(files: Mapping[str, bytes]) -> Iterator[Path]:
    """Temporary directory with files (relative path -> bytes)."""
    with tempfile.TemporaryDirectory(prefix="dusttaichi-") as folder:
        _write_files(files, Path(folder))
        yield Path(folder)


def _write_files(files: Mapping[str, bytes], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)


def _list_returned_files(directory: Path) -> set[str]:
    """Relative paths of the files for a continuation, and of results and figures."""
    visible = [path for path in directory.iterdir() if not path.name.startswith(".")]
    results = [path.name for path in visible if path.suffix in RESULT_SUFFIXES]
    return {*results, *run_files(directory)}


class Meter:
    """Processor time of the steps of a simulation, of all threads of this process [s].

    Start, compilation, measurements and writing do not count. On a GPU it is wall time. A context
    manager around every segment of steps.
    """

    def __init__(self, backend: str) -> None:
        self._clock = time.process_time if backend == "cpu" else time.perf_counter
        self.cost = 0.0

    def begin(self, sim: Any) -> None:
        """Begin at the current step of a simulation."""
        self._sim, self._first, self._start = sim, sim.step, sim.state()

    def __enter__(self) -> None:
        self._began = self._clock()

    def __exit__(self, *_: object) -> None:
        self.cost += self._clock() - self._began

    def repeat(self) -> None:
        """Replace the cost of a run shorter than SHORTEST_TIMED by a mean of repetitions."""
        steps, cost, times = self._sim.step - self._first, 0.0, 0
        with suppress(KeyboardInterrupt):  # the repetitions so far are enough
            while cost < SHORTEST_TIMED:
                self._sim.restore(self._start)
                began = self._clock()
                self._sim.advance(steps)
                cost, times = cost + self._clock() - began, times + 1
        if times:
            self.cost = cost / times


def run(
    parent: Parent,
    *,
    scene: str,
    directory: str,
    mode: str,
    timed: bool,
    execute_options: dict[str, Any],
) -> dict[str, float]:
    """Task of a worker process: run a scene (text of its YAML) into a directory.

    mode: "new", "force" (start again) or "resume". timed: repeat the steps of a short run, for its
    cost. execute_options: further arguments of `execute`. Reports the fraction that is done, and
    returns the `cost` of the steps. Raises the errors of `execute`.
    """
    from dusttaichi.running import execute
    from dusttaichi.scene import from_yaml

    def report(progress: Any) -> None:
        if progress.end:
            parent.progress(share=progress.step / progress.end)

    loaded = from_yaml(scene)
    meter = Meter(getattr(loaded.numerics, "backend", "cpu"))
    options = execute_options | {"force": mode == "force", "resume": mode == "resume"}
    options |= {"report": report, "advancing": meter} | ({"ready": meter.begin} if timed else {})
    execute(loaded, directory, **options)
    if timed and meter.cost < SHORTEST_TIMED and not getattr(loaded, "stages", ()):
        meter.repeat()
    return {"cost": meter.cost}
