"""Points that are requests to a task instead of runs; their answers are rows of a file.

For computations without results of their own: collisions, cells of a map that may fail or hang.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dusttaichi.compute.version import __version__
from dusttaichi.scene import Scene
from dusttaichi.studies.jobs import Task
from dusttaichi.studies.result_store import CHECKPOINT, ResultStore
from dusttaichi.studies.study_types import Study
from dusttaichi.studies.workers import Answer

START_TIME = 2.0  # s of processor time that the start of a process takes


@dataclass(frozen=True)
class Request:
    """A point whose numbers are the answer of a task to a request; see jobs.Task.

    Points that need the same kernels should follow one another: a process makes some neighbours.

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
        A process that takes longer is killed.
    together
        Arguments of the task for several requests in one call, see jobs.Task.
    expected
        Order of magnitude of its time [s]; short ones do not start further processes. None: not
        known.
    """

    label: str
    task: str
    arguments: dict[str, Any]
    file: Path | None = None
    inputs: tuple[str, ...] = ()
    cores: int | None = 1
    seconds: float | None = None
    expected: float | None = None
    together: dict[str, Any] | None = None

    def find_answer(self, store: ResultStore) -> Answer | None:
        """The Answer in its file, None without one."""
        row = store.open_rows(self.file).rows_by_key.get(self.label)
        return None if row is None else Answer(values=row)

    def save_answer(self, answer: Answer, store: ResultStore) -> None:
        """Add the row of its Answer to its file. Raises DustError."""
        store.open_rows(self.file).add(self.label, answer)

    def choose_processes(self, count: int, cores: int, *, remote: bool) -> tuple[int, None]:
        """(processes for `count` of them on some cores, threads of each or None)."""
        largest = max(1, cores // (self.cores or cores))
        if self.expected is not None:
            largest = min(largest, max(1, math.ceil(count * self.expected / START_TIME)))
        return min(count, largest), None

    def to_task(self, threads: None, store: ResultStore, **_: Any) -> Task:
        """The Task, which continues the `checkpoint` of an interruption where there is one."""
        checkpoint = store.open_rows(self.file).unfinished.get(self.label)
        arguments = self.arguments | ({} if checkpoint is None else {CHECKPOINT: checkpoint})
        return Task(self.label, self.task, arguments, self.seconds, together=self.together)

    def measure_answer(self, study: Study, answer: Answer) -> tuple[dict[str, Any], None]:
        """(values of the answer, None for its cost)."""
        return answer.values, None


def count_cores(scene: Scene) -> int | None:
    """The `cores` of requests that simulate a scene."""
    if scene.numerics.backend != "cpu":
        return None
    threads = scene.numerics.threads
    return None if threads == "auto" else threads


def make_key(*contents: Any) -> str:
    """Key of a row: of this version and of all that decides its numbers, values of JSON."""
    text = json.dumps([__version__, *contents], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]
