"""Jobs of a study: requests to a task in a worker process, here or on a cluster; runs are some."""

import math
import tempfile
import time
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from dusttaichi.errors import DustError
from dusttaichi.results.files import run_files
from dusttaichi.studies.workers import LOST, STARTING, Answer, idle_workers, taken

LEAST = 1.0  # core-seconds: the steps of shorter runs are repeated up to this total
RETURNED = (".nc", ".bin", ".yaml", ".png")  # files of a run in a temporary directory
TOGETHER = 16  # requests of a job at most, which share a start on a cluster
SIDE_BY_SIDE = 2000  # the same of requests that are made together, each answered when it is done
ROUNDS = 2  # jobs of each process at least, of which the last ones even out


@dataclass(frozen=True)
class Task:
    """A call of task(parent, **arguments) in a worker process.

    Attributes
    ----------
    label
        That of the point.
    task
        "module:function"; the function returns a dict of JSON or raises a DustError. It may state
        its share by `parent.progress` (child.Parent).
    arguments
        Values of JSON.
    seconds
        A process that takes longer is killed; its first request may take STARTING more.
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

    remote: they are made in a temporary directory with their input files.
    """

    tasks: tuple[Task, ...]
    remote: bool = False

    @property
    def labels(self) -> list[str]:
        """Labels of the tasks."""
        return [task.label for task in self.tasks]

    def do(self, link, inputs) -> dict[str, Answer]:
        """Answers of the tasks by their labels, fewer where all jobs have to stop.

        All but the last are reported, too, as soon as they are known. A process that was lost is
        replaced, and the next task follows.

        link: of a pool; has stopped(), true once all jobs have to stop, report(label, share,
        keywords of the Answer or None), and, on this machine, `idle`, the list of idle Workers.
        inputs: relative path -> bytes of the input files, for a temporary directory.
        """
        answers, pending, size = {}, list(self.tasks), self._together
        with ExitStack() as stack:
            folder = stack.enter_context(_laid_out(inputs)) if self.remote else None
            idle = stack.enter_context(idle_workers()) if self.remote else link.idle
            while pending and not link.stopped():
                now = pending[:size]
                with taken(idle, now[0].task, link.stopped, folder) as worker:
                    found = _asked(worker, now, link)
                lost = any(answer.code == LOST for answer in found.values())
                if lost and size > 1:  # it is not known through which: one by one from here on
                    found = {label: own for label, own in found.items() if own.code != LOST}
                    size = 1
                answers |= found
                pending = [task for task in pending if task.label not in found]
                if not all(answer.startable for answer in found.values()):
                    break
                for label, answer in found.items() if pending else ():
                    link.report(label, 1.0, asdict(answer))
        return answers

    @property
    def _together(self):
        """Number of tasks of a call."""
        return 1 if self.tasks[0].together is None else len(self.tasks)


def _asked(worker, tasks, link):
    """label -> Answer of a Worker to a Task, or to several that are done together."""
    task = tasks[0]
    if task.together is None:
        return {task.label: _asked_alone(worker, task, link)}
    answers = {}

    def answered(label, **answer):
        answers[label] = Answer(**answer)
        link.report(label, 1.0, answer)

    calls = [{"label": task.label, **task.arguments} for task in tasks]
    how = {"answered": answered, "stopped": link.stopped}
    end = worker.ask({"calls": calls, **task.together}, **how)
    return {task.label: end for task in tasks} | answers


def _asked_alone(worker, task, link):
    """The Answer of a Worker to a Task."""
    limit = task.seconds
    if limit is not None:
        limit += STARTING * worker.fresh

    def report(share):
        link.report(task.label, share, None)

    with nullcontext() if task.folder is None else _folder(task.folder) as folder:
        folder_argument = {} if folder is None else {"directory": str(folder)}
        arguments = task.arguments | folder_argument
        answer = worker.ask(arguments, limit, report=report, stopped=link.stopped)
        if folder is not None:
            contents = {name: (folder / name).read_bytes() for name in _returned(folder)}
            answer = replace(answer, files=contents)
    return answer


def jobs_of(tasks, workers, *, remote):
    """Jobs of tasks for a number of processes, in their order.

    Large enough to share a start, and enough of them for all processes.
    """
    alone = [task for task in tasks if task.alone]
    grouped = [task for task in tasks if not task.alone]
    most = SIDE_BY_SIDE if grouped and grouped[0].together else TOGETHER
    size = max(1, min(most, math.ceil(len(grouped) / (ROUNDS * workers))))
    batches = [grouped[first : first + size] for first in range(0, len(grouped), size)]
    return [Job(tuple(batch), remote) for batch in (*([task] for task in alone), *batches)]


def content_of(path):
    """Bytes of an input file of jobs. Raises DustError."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise DustError(f"{path} cannot be read: {error.strerror or error}.") from error


@contextmanager
def _laid_out(inputs):
    """Temporary directory with input files; yields that of their relative paths (../../a.csv)."""
    up = max((Path(name).parts.count("..") for name in inputs), default=0)
    with _folder({}) as folder:
        start_folder = folder.joinpath("inputs", *["d"] * up)
        _write(inputs, start_folder)
        yield start_folder


@contextmanager
def _folder(files):
    """Temporary directory with files (relative path -> bytes)."""
    with tempfile.TemporaryDirectory(prefix="dusttaichi-") as folder:
        _write(files, Path(folder))
        yield Path(folder)


def _write(files, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)


def _returned(directory):
    """Relative paths of the files for a continuation, and of results and figures."""
    results = [p.name for p in directory.iterdir() if p.suffix in RETURNED and p.name[0] != "."]
    return {*results, *run_files(directory)}


class Meter:
    """Processor time of the steps of a simulation, of all threads of this process [s].

    Start, compilation, measurements and writing do not count. On a GPU it is wall time. A context
    manager around every segment of steps.
    """

    def __init__(self, backend):
        self._clock = time.process_time if backend == "cpu" else time.perf_counter
        self.cost = 0.0

    def begin(self, sim):
        """Begin at the current step of a simulation."""
        self._sim, self._first, self._start = sim, sim.step, sim.state()

    def __enter__(self):
        self._began = self._clock()

    def __exit__(self, *_):
        self.cost += self._clock() - self._began

    def repeat(self):
        """Replace the cost of a run shorter than LEAST by the mean of several repetitions."""
        steps, cost, times = self._sim.step - self._first, 0.0, 0
        with suppress(KeyboardInterrupt):  # the repetitions so far are enough
            while cost < LEAST:
                self._sim.restore(self._start)
                began = self._clock()
                self._sim.advance(steps)
                cost, times = cost + self._clock() - began, times + 1
        if times:
            self.cost = cost / times


def run(parent, *, scene, directory, mode, timed, how):
    """Task of a worker process: run a scene (text of its YAML) into a directory.

    mode: "new", "force" (start again) or "resume". timed: repeat the steps of a short run, for its
    cost. how: further arguments of `execute`. Reports the share that is done, and returns the
    `cost` of the steps. Raises the errors of `execute`.
    """
    from dusttaichi.running import execute
    from dusttaichi.scene import from_yaml

    def report(progress):
        if progress.end:
            parent.progress(share=progress.step / progress.end)

    mode = {"force": mode == "force", "resume": mode == "resume"}
    scene = from_yaml(scene)
    meter = Meter(getattr(scene.numerics, "backend", "cpu"))
    hooks = {"report": report, "advancing": meter} | ({"ready": meter.begin} if timed else {})
    execute(scene, directory, **hooks, **mode, **how)
    if timed and meter.cost < LEAST and not getattr(scene, "stages", ()):
        meter.repeat()
    return {"cost": meter.cost}
