"""Points that are no runs: requests to a task, whose answers are rows of a file.

For what writes no results of its own: collisions of a map, or cells that may also fail or hang.
"""

import hashlib
import json
import math
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dusttaichi.errors import DustError
from dusttaichi.results import files
from dusttaichi.results.pieces import make_exists_error
from dusttaichi.results.provenance import __version__
from dusttaichi.studies.jobs import Task
from dusttaichi.studies.workers import INTERRUPTED, Answer

UNFINISHED = ".unfinished"  # suffix of the file of checkpoints beside that of the rows
WHOLE = 1, 1  # the part that is all of a study
CHECKPOINT = "checkpoint"  # of an interrupted task: in its answer, and an argument of the next one
START = 2.0  # s of processor time that the start of a process takes


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

    def find_answer(self, shelf):
        """The Answer in its file, None without one."""
        row = shelf.rows(self.file).known.get(self.label)
        return None if row is None else Answer(found=row)

    def store(self, answer, shelf):
        """Add the row of its Answer to its file. Raises DustError."""
        shelf.rows(self.file).add(self.label, answer)

    def choose_processes(self, count, cores, *, remote):
        """(processes for `count` of them on some cores, threads of each or None)."""
        most = max(1, cores // (self.cores or cores))
        if self.expected is not None:
            most = min(most, max(1, math.ceil(count * self.expected / START)))
        return min(count, most), None

    def to_task(self, _, shelf, **__):
        """The Task, which continues the `checkpoint` of an interruption where there is one."""
        checkpoint = shelf.rows(self.file).unfinished.get(self.label)
        arguments = self.arguments | ({} if checkpoint is None else {CHECKPOINT: checkpoint})
        return Task(self.label, self.task, arguments, self.seconds, together=self.together)

    def measure_answer(self, study, answer):
        """(what it has found, None for its cost)."""
        return answer.found, None


def cores_of(scene) -> int | None:
    """The `cores` of requests that simulate a scene."""
    return scene.numerics.threads if scene.numerics.backend == "cpu" else None


def key_of(*parts: Any) -> str:
    """Key of a row: of this version and of all that decides its numbers, values of JSON."""
    text = json.dumps([__version__, *parts], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


class Rows:
    """Answers in a file, a line of JSON each: the row with its `key`, or with an `error`.

    path: None where they are not stored. Each part (k, n) of a study, which may run at the same
    time as others, has a file of its own beside it. known: key -> row of all these files, without
    those of failed requests, which are made again. unfinished: key -> checkpoint of requests that
    an interruption cut short; these are in files that end with UNFINISHED. Raises DustError where
    the file exists and neither force nor resume is wanted, or cannot be written.
    """

    def __init__(self, path, *, force, resume, part=WHOLE):
        self.path, self.known, self.unfinished = path, {}, {}
        if path is None:
            return
        parts = sorted(path.parent.glob(f"{path.stem}.*-of-*{path.suffix}"))
        if part != WHOLE:
            self.path = path.with_name("{}.{}-of-{}{}".format(path.stem, *part, path.suffix))
        written = [path, *parts] if part == WHOLE else [path, self.path]
        there = [file for file in written if file.exists()]
        if there and not force and not resume:
            raise make_exists_error(there[0], "with the missing ones")
        for other in [path, *parts] if resume and not force else ():
            self.known |= {} if other == self.path else _read(other)
        mine = _read(self.path) if resume and not force else {}
        self.known |= mine
        rows = self.known if part == WHOLE else mine
        self._write("".join(_line(key, row) for key, row in rows.items()))
        for other in parts if force and part == WHOLE else ():
            files.remove(other)
        for other in {path, *parts, self.path} if resume and not force else ():
            for key, row in _read(other.with_suffix(UNFINISHED)).items():
                self.unfinished |= {} if key in self.known else {key: row[CHECKPOINT]}
        ended = {path, *parts} if part == WHOLE else {self.path}
        self._checkpoint_files = [file.with_suffix(UNFINISHED) for file in ended]
        self._remove_checkpoints()

    def _remove_checkpoints(self):
        """Remove the files of the checkpoints once nothing is unfinished."""
        for file in () if self.unfinished else self._checkpoint_files:
            files.remove(file)

    def _write(self, text):
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            files.write_whole(self.path, text.encode())
        except OSError as error:
            raise self._unwritable(error) from error

    def _unwritable(self, error):
        return DustError(f"Cannot write {self.path}: {files.explain(error, self.path)}.")

    def add(self, key, answer):
        """Add the line of an Answer, whole on the disk when this returns. Raises DustError.

        One that was interrupted has a line among the unfinished ones where it has a checkpoint.
        """
        if self.path is None:
            return
        if answer.code == INTERRUPTED:
            if CHECKPOINT in answer.found:
                row = {CHECKPOINT: answer.found[CHECKPOINT]}
                self._append(self.path.with_suffix(UNFINISHED), key, row)
            return
        row = {"error": answer.text, "code": answer.code} if answer.code else answer.found
        self._append(self.path, key, row)
        if self.unfinished.pop(key, None) is not None:
            self._remove_checkpoints()

    def _append(self, path, key, row):
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(_line(key, row))
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise self._unwritable(error) from error


def _read(path):
    """key -> row of the lines of a file that have numbers, {} without a file."""
    rows = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        with suppress(ValueError, KeyError, TypeError):  # the last may have been cut off
            row = json.loads(line)
            if "error" not in row:
                rows[row.pop("key")] = row
    return rows


def _line(key, row):
    return json.dumps({"key": key, **row}) + "\n"
