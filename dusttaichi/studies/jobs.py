"""Jobs in a worker process here or on a cluster, and the one that is a run."""

import tempfile
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import ClassVar

from dusttaichi.files import run_files
from dusttaichi.studies.workers import INTERRUPTED, LOST, Answer, Worker, taken

LEAST = 1.0  # core-seconds: the steps of shorter runs are repeated up to this total
LOOK = 0.5  # s between two checks whether to stop, on a cluster over its network
RETURNED = (".nc", ".bin", ".yaml", ".png")  # files of a run in a temporary directory


@dataclass(frozen=True)
class Job:
    """One run for a thread of this process or a worker of a Dask cluster.

    label: of the point. scene: text of its YAML. mode: "new", "force" (start again) or "resume".
    directory: of the run, or None for a temporary one, whose files come back with the result.
    files: name -> content of the files in it at the start. timed: repeat the steps of a short run,
    for its cost. how: further arguments of `execute`.
    """

    label: str
    scene: str
    mode: str
    directory: str | None
    files: dict[str, bytes] = field(default_factory=dict)
    timed: bool = False
    how: dict = field(default_factory=dict)

    task: ClassVar[str] = f"{__name__}:run"

    @property
    def labels(self):
        """Label of the point, as the only one."""
        return [self.label]

    def results(self, result):
        """JobResults of the points."""
        return [result]

    def do(self, link, inputs):
        """The JobResult.

        link: of a pool; has stopped(), true once all jobs have to stop, report(label, share), and,
        on this machine, `idle`, the list of idle Workers. inputs: relative path -> bytes of the
        input files of the scene, for a temporary directory.
        """
        if link.stopped():
            return JobResult(self.label, INTERRUPTED, "not started")
        if self.directory is not None:
            with taken(link.idle, self.task, link.stopped) as worker:
                answer = self._ask(worker, self.directory, link)
            return JobResult(self.label, answer.code, answer.text, found=answer.found)
        with laid_out(inputs) as here, tempfile.TemporaryDirectory(prefix="dusttaichi-") as folder:
            directory = Path(folder)
            _lay_out(self.files, directory)
            with Worker(self.task, folder=here) as worker:
                answer = self._ask(worker, directory, link)
            files = {name: (directory / name).read_bytes() for name in _returned(directory)}
        return JobResult(self.label, answer.code, answer.text, files, answer.found)

    def _ask(self, worker, directory, link):
        own = {"scene": self.scene, "mode": self.mode, "timed": self.timed, "how": self.how}
        return ask(worker, self.label, own | {"directory": str(directory)}, link)


@dataclass(frozen=True)
class JobResult:
    """Result of a job: exit code, message, files of a temporary directory.

    found: everything that the task has reported and returned; of requests see requests.Batch.
    """

    label: str
    code: int
    text: str
    files: dict[str, bytes] = field(default_factory=dict)
    found: dict = field(default_factory=dict)


def ask(worker, label, arguments, link, seconds=None):
    """The Answer of a Worker to a request, whose share is reported to the `link` (see Job.do).

    seconds: after which the process is killed, None: no limit.
    """
    worker.send(**arguments)
    reported, end = None, inf if seconds is None else time.monotonic() + seconds
    while not worker.answered(min(LOOK, max(0.0, end - time.monotonic()))):
        if time.monotonic() >= end:
            worker.kill()
            return Answer(LOST, f"no answer in {seconds:g} s", dict(worker.reports))
        share = worker.reports.get("share")
        if share != reported:
            reported = share
            link.report(label, share)
        if link.stopped():
            worker.stop()
    return worker.answer()


@contextmanager
def laid_out(inputs):
    """Temporary directory with input files (relative path -> bytes), valid for their paths."""
    with tempfile.TemporaryDirectory(prefix="dusttaichi-") as folder:
        yield _lay_out_inputs(inputs, Path(folder) / "inputs")


def _returned(directory):
    """Relative paths of the files for a continuation, and of results and figures."""
    beside = [p.name for p in directory.iterdir() if p.suffix in RETURNED and p.name[0] != "."]
    return {*beside, *run_files(directory)}


def _lay_out(files, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)


def _lay_out_inputs(inputs, folder):
    """Write the files; returns the directory of their relative paths, such as ../../a.csv."""
    up = max((Path(name).parts.count("..") for name in inputs), default=0)
    here = folder.joinpath(*["d"] * up)
    _lay_out(inputs, here)
    return here


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

    mode, timed, how: see Job. Reports the share that is done, and returns the `cost` of the steps.
    Raises the errors of `execute`.
    """
    from dusttaichi.run import execute
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
