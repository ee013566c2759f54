"""One run as a job: in a worker process here, or in a temporary directory of a cluster."""

import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from dusttaichi.files import run_files
from dusttaichi.studies.workers import INTERRUPTED, Worker

LOOK = 0.5  # s between two checks whether to stop, on a cluster over its network
RETURNED = (".nc", ".bin", ".yaml", ".png")  # files of a run in a temporary directory


@dataclass(frozen=True)
class Job:
    """One run for a thread of this process or a worker of a Dask cluster.

    label: of the point. scene: text of its YAML. mode: "new", "force" (start again) or "resume".
    directory: of the run, or None for a temporary one, whose files come back with the result.
    files: name -> content of the files in it at the start. how: further arguments of `execute`.
    """

    label: str
    scene: str
    mode: str
    directory: str | None
    files: dict[str, bytes] = field(default_factory=dict)
    how: dict = field(default_factory=dict)

    task: ClassVar[str] = f"{__name__}:run"

    def request(self, directory):
        """Arguments of the task."""
        return {
            "scene": self.scene,
            "directory": str(directory),
            "mode": self.mode,
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


def run(parent, *, scene, directory, mode, how):
    """Task of a worker process: run a scene (text of its YAML) into a directory.

    mode, how: see Job. Reports the share that is done. Raises the errors of `execute`.
    """
    from dusttaichi.run import execute
    from dusttaichi.scene import from_yaml

    def report(progress):
        if progress.end and not progress.task:
            parent.progress(share=progress.step / progress.end)

    mode = {"force": mode == "force", "resume": mode == "resume"}
    execute(from_yaml(scene), directory, report=report, **mode, **how)
