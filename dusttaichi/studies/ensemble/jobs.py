"""One run as a task: in a worker process here, or in a temporary directory of a cluster."""

import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from dusttaichi.files import run_files
from dusttaichi.studies.workers import INTERRUPTED, Worker

TASK = "dusttaichi.studies.ensemble.task:run"
LOOK = 0.5  # s between two looks at whether to stop; a cluster is asked over its network
KEPT = (".nc", ".bin", ".yaml", ".png")  # files of a run that come back from a temporary directory


@dataclass(frozen=True)
class Job:
    """One run, as it is handed to a thread of this process or to a worker of a Dask cluster.

    number: of the member of the plan. scene: text of its YAML. mode: "new", "force" (start anew) or
    "resume". directory: where the run goes, or None for a temporary one, whose files come back with
    the result. files: name -> content of what lies there at first. error_bar: estimate the error of
    the time step at the end.
    """

    number: int
    scene: str
    mode: str
    directory: str | None
    files: dict[str, bytes] = field(default_factory=dict)
    error_bar: bool = False

    task: ClassVar[str] = TASK

    def request(self, directory):
        """What the task is called with."""
        return {
            "scene": self.scene,
            "directory": str(directory),
            "mode": self.mode,
            "error_bar": self.error_bar,
        }


@dataclass(frozen=True)
class JobResult:
    """How a run ended: the exit code, the message, the files of a temporary directory, and what the
    task has reported and returned."""

    number: int
    code: int
    text: str
    files: dict[str, bytes] = field(default_factory=dict)
    found: dict = field(default_factory=dict)


def perform(job, link, inputs):
    """Do a Job, or another with its number, task, request, directory and files (studies.collide);
    returns its JobResult.

    link: has stopped(), true once all runs are to stop, and report(number, share).
    inputs: relative path -> bytes of files that the scene reads, for a temporary directory.
    """
    if link.stopped():
        return JobResult(job.number, INTERRUPTED, "not started")
    if job.directory is not None:
        answer = _work(job, job.directory, None, link)
        return JobResult(job.number, answer.code, answer.text, found=answer.found)
    with tempfile.TemporaryDirectory(prefix="dusttaichi-") as folder:
        directory = Path(folder) / "result"
        _lay_out(job.files, directory)
        here = _lay_out_inputs(inputs, Path(folder) / "inputs")
        answer = _work(job, directory, here, link)
        files = {name: (directory / name).read_bytes() for name in _kept(directory)}
    return JobResult(job.number, answer.code, answer.text, files, answer.found)


def _kept(directory):
    """Relative paths of what comes back: what a run goes on from, and what it shows."""
    beside = [p.name for p in directory.iterdir() if p.suffix in KEPT and p.name[0] != "."]
    return {*beside, *run_files(directory)}


def _lay_out(files, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)


def _lay_out_inputs(inputs, folder):
    """Write the files; returns the directory that their paths, also ../../a.csv, start at."""
    up = max((Path(name).parts.count("..") for name in inputs), default=0)
    here = folder.joinpath(*["d"] * up)
    _lay_out(inputs, here)
    return here


def _work(job, directory, folder, link):
    """Do the run in a worker process that starts in `folder`; returns its Answer."""
    with Worker(job.task, folder=folder) as worker:
        worker.send(**job.request(directory))
        reported = None
        while not worker.answered(LOOK):
            share = worker.reports.get("share")
            if share != reported:
                reported = share
                link.report(job.number, share)
            if link.stopped():
                worker.stop()
        return worker.answer()
