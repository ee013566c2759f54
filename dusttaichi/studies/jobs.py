"""One run as a job: in a worker process here, or in a temporary directory of a cluster."""

import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from dusttaichi.files import run_files
from dusttaichi.studies.workers import INTERRUPTED, Worker

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

    def request(self, directory):
        """Arguments of the task."""
        return {
            "scene": self.scene,
            "directory": str(directory),
            "mode": self.mode,
            "timed": self.timed,
            "how": self.how,
        }


@dataclass(frozen=True)
class JobResult:
    """Result of a run: exit code, message, files of a temporary directory.

    found: everything that the task has reported and returned.
    """

    label: str
    code: int
    text: str
    files: dict[str, bytes] = field(default_factory=dict)
    found: dict = field(default_factory=dict)


def perform(job, link, inputs):
    """The JobResult of a Job, or of another with the same attributes (studies.collide).

    link: has stopped(), true once all runs have to stop, report(label, share), and, for runs in
    their own directory, worker(task), a context with a Worker. inputs: relative path -> bytes of
    the input files of the scene, for a temporary directory.
    """
    if link.stopped():
        return JobResult(job.label, INTERRUPTED, "not started")
    if job.directory is not None:
        with link.worker(job.task) as worker:
            answer = _work(job, job.directory, worker, link)
        return JobResult(job.label, answer.code, answer.text, found=answer.found)
    with tempfile.TemporaryDirectory(prefix="dusttaichi-") as folder:
        directory = Path(folder) / "result"
        _lay_out(job.files, directory)
        here = _lay_out_inputs(inputs, Path(folder) / "inputs")
        with Worker(job.task, folder=here) as worker:
            answer = _work(job, directory, worker, link)
        files = {name: (directory / name).read_bytes() for name in _returned(directory)}
    return JobResult(job.label, answer.code, answer.text, files, answer.found)


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


def _work(job, directory, worker, link):
    """Run a job in a worker process; returns its Answer."""
    worker.send(**job.request(directory))
    reported = None
    while not worker.answered(LOOK):
        share = worker.reports.get("share")
        if share != reported:
            reported = share
            link.report(job.label, share)
        if link.stopped():
            worker.stop()
    return worker.answer()


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
