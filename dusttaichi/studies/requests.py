"""Points that are no runs: requests to a task, whose answers are rows of a file.

For what writes no results of its own: collisions of a map, or cells that may also fail or hang.
"""

import hashlib
import json
import math
import os
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dusttaichi import __version__, files
from dusttaichi.errors import DustError
from dusttaichi.results.pieces import already_there
from dusttaichi.studies.jobs import JobResult, ask, laid_out
from dusttaichi.studies.workers import INTERRUPTED, STARTING, idle_workers, taken

TOGETHER = 16  # requests of a job at most, which share a start on a cluster
ROUNDS = 2  # jobs of each process at least, of which the last ones even out


@dataclass(frozen=True)
class Request:
    """A point whose numbers are the answer of a task to a request.

    A process that stays calls task(parent, **arguments), which returns a dict of JSON or raises a
    DustError; it may state its share by `parent.progress` (child.Parent). Points that need the same
    kernels should follow one another: a process makes some neighbours.

    Attributes
    ----------
    label
        Key of its row, which no other result has, also none of another scene or version.
    task
        "module:function".
    arguments
        Values of JSON.
    file
        File of the rows, a line of JSON each as soon as it is known. None: they are not stored.
    inputs
        Paths of files that the task reads, relative to the current directory.
    cores
        How many it takes; None: it has the machine for itself, as on a GPU.
    seconds
        A process that takes longer is killed; its first request may take STARTING more.
    """

    label: str
    task: str
    arguments: dict[str, Any]
    file: Path | None = None
    inputs: tuple[str, ...] = ()
    cores: int | None = 1
    seconds: float | None = None


@dataclass(frozen=True)
class Batch:
    """Job of several requests to one task, one after another; see jobs.Job.

    remote: they are made in a temporary directory.
    """

    label: str
    requests: tuple[Request, ...]
    remote: bool = False

    @property
    def labels(self):
        """Labels of the requests."""
        return [request.label for request in self.requests]

    def results(self, result):
        """JobResults of the requests, as far as they ended."""
        return [JobResult(label, **answer) for label, answer in result.found.items()]

    def do(self, link, inputs):
        """The JobResult, in `found` label -> keywords of the JobResult of each request.

        They are reported, too, as soon as they are known. A process that was lost is replaced, and
        the next request follows.
        """
        answers = {}
        with ExitStack() as stack:
            if self.remote:
                folder = stack.enter_context(laid_out(inputs))
                idle = stack.enter_context(idle_workers())
            else:
                folder, idle = None, link.idle
            for request in self.requests:
                if link.stopped():
                    break
                with taken(idle, request.task, link.stopped, folder) as worker:
                    limit = request.seconds
                    if limit is not None:
                        limit += STARTING * worker.fresh
                    answer = ask(worker, request.label, request.arguments, link, limit)
                answers[request.label] = asdict(answer)
                link.report(request.label, 1.0, asdict(answer))
        return JobResult(self.label, 0, "", found=answers)


def batches(requests, workers, *, remote):
    """Batches of requests for a number of processes, in their order.

    Large enough to share a start, and enough of them for all processes.
    """
    size = max(1, min(TOGETHER, math.ceil(len(requests) / (ROUNDS * workers))))
    return [
        Batch(f"batch {first // size + 1}", tuple(requests[first : first + size]), remote)
        for first in range(0, len(requests), size)
    ]


def key_of(*parts: Any) -> str:
    """Key of a row: of this version and of all that decides its numbers, values of JSON."""
    text = json.dumps([__version__, *parts], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


class Rows:
    """Answers in a file, a line of JSON each: the row with its `key`, or with an `error`.

    path: None where they are not stored. known: key -> row without those of failed requests, which
    are made again. Raises DustError where the file exists and neither force nor resume is wanted.
    """

    def __init__(self, path, *, force, resume):
        self.path, self.known = path, {}
        if path is None:
            return
        if path.exists() and not force and not resume:
            raise already_there(path, "with the missing ones")
        if resume and not force and path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                with suppress(ValueError, KeyError, TypeError):  # the last may have been cut off
                    row = json.loads(line)
                    if "error" not in row:
                        self.known[row.pop("key")] = row
        whole = "".join(_line(key, row) for key, row in self.known.items())
        files.write_whole(path, whole.encode())

    def add(self, result):
        """Add the line of a JobResult, whole on the disk when this returns. Raises DustError."""
        if self.path is None or result.code == INTERRUPTED:
            return
        row = {"error": result.text, "code": result.code} if result.code else result.found
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(_line(result.label, row))
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            why = files.explain(error, self.path)
            raise DustError(f"Cannot write {self.path}: {why}.") from error


def _line(key, row):
    return json.dumps({"key": key, **row}) + "\n"
