"""Files of a run: the result and its checkpoint, and the times at which they are written."""

from __future__ import annotations

import time as real_time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dusttaichi.compute.background import Background
from dusttaichi.errors import DustError
from dusttaichi.results import files, outputs
from dusttaichi.results.files import CHECKPOINT
from dusttaichi.running import checkpoint
from dusttaichi.running.identity import input_files

if TYPE_CHECKING:
    from dusttaichi.results.run_lock import RunLock
    from dusttaichi.results.writer import Writer
    from dusttaichi.running.identity import Origin
    from dusttaichi.running.run_protocol import Run
    from dusttaichi.scene.scene import Scene


FLUSH_SHARE = 0.02  # share of the real time for writing
LEAST = 5.0  # s between two flushes
LARGE = 8_000_000  # bytes from which a file is written by a process of its own
LARGEST = 250_000_000  # bytes of records that wait at most while another file is written
SCENE = "scene.yaml"
MADE = "# Written by dusttaichi: the scene of this run, with every default."


class RunFiles(AbstractContextManager["RunFiles"]):
    """The files of a run directory, written by a Writer and by checkpoint.save.

    Large ones are written by a process of its own during the steps. every [s]: real time between
    two checkpoints. origin: the Origin of the run. lock: RunLock of the directory, or None. A
    context manager, which waits for the last file.
    """

    def __init__(
        self,
        directory: str | Path,
        writer: Writer,
        every: float,
        origin: Origin,
        *,
        lock: RunLock | None = None,
    ) -> None:
        self.directory, self.writer = Path(directory), writer
        self.every, self.origin = every, origin
        self.cost = 0.0
        self.saved = self.flushed = real_time.perf_counter()
        self._background = Background([] if lock is None else lock.descriptors)

    def flush(self) -> None:
        """Put all records on disk."""
        self.cost = self.writer.flush()
        self.flushed = real_time.perf_counter()

    def save(self, run: Run, last: Callable[[], object] | None = None) -> None:
        """Write the result, then the checkpoint, which is never ahead of the result.

        last: adds the last records of the run, which the result has and a continuation will not.
        """
        try:
            self._write_checkpoint(run)  # one array after another: the state is not copied
        finally:
            if last is not None:
                last()
            if last is None or not self.writer.join_at_once(self._background):
                self.flush()
        checkpoint.publish(self.directory / CHECKPOINT)
        self.saved = real_time.perf_counter()

    def join(self) -> None:
        """Put all records on disk, in one file."""
        self.writer.join(self._background)

    def write_if_due(self, run: Run) -> None:
        """Flush or write a checkpoint after some time; call it after the records of a step.

        Else a continued run would lack these records. Raises DustError, also that of an earlier
        call, whose records are in memory again.
        """
        if self._background.busy:
            if self.writer.bytes_waiting < LARGEST:
                return
        elif (seconds := self.writer.settle()) > 0.0:
            self.cost, self.flushed = seconds, real_time.perf_counter()
        current_time = real_time.perf_counter()
        if current_time - self.saved > self.every:
            self._begin_save(run)
        elif (
            current_time - self.flushed > max(LEAST, self.cost / FLUSH_SHARE)
            or self.writer.bytes_waiting > LARGEST
        ):
            self._begin_flush()

    def _begin_flush(self) -> None:
        if self.writer.bytes_waiting < LARGE:
            self.flush()
        else:
            self.writer.begin_flush(self._background)
            self.flushed = real_time.perf_counter()

    def _begin_save(self, run: Run) -> None:
        path = self.directory / CHECKPOINT
        if self._write_checkpoint(run) < LARGE:
            self.flush()
            checkpoint.publish(path)
        else:
            self.writer.begin_flush(self._background, (checkpoint.publish, path))
        self.saved = self.flushed = real_time.perf_counter()

    def _write_checkpoint(self, run: Run) -> int:
        """Write a checkpoint, which is not valid yet; returns its bytes. Raises DustError."""
        self.writer.settle()  # the former one may just be made valid
        state = run.sim.view_state()
        meta = {
            "scene": run.scene.to_yaml(),
            "inputs": self.origin.inputs,
            "extensions": run.scene.imported_texts,
            "code": self.origin.code,
            "numbers": state.numbers,
            "run": replace(run.state),  # as it is before the last records
            "counts": self.writer.counts(),
        }
        return checkpoint.write(self.directory / CHECKPOINT, state.arrays, meta)

    def close(self) -> None:
        """Wait for the last file, and end the process that writes."""
        try:
            self.writer.settle()
        finally:
            self._background.close()
            checkpoint.forget(self.directory / CHECKPOINT)

    def __exit__(self, *_: object) -> None:
        self.close()


def check_outputs(scene: Scene, directory: str | Path, force: bool) -> None:
    """Refuse files of a run that would replace its inputs or, without `force`, foreign files.

    Raises DustError.
    """
    directory = Path(directory)
    with outputs.writing(force=force, inputs=input_files(scene)):
        for name, mark in (files.RESULT, ""), (SCENE, MADE), (CHECKPOINT, "dusttaichi checkpoint"):
            outputs.check(directory / name, mark)
    scene_file = directory / SCENE
    if scene.path is not None and scene_file.exists() and not outputs.is_ours(scene_file, MADE):
        outputs.refuse_inputs(scene_file, [scene.path])


def write_scene(scene: Scene, directory: str | Path) -> None:
    """The resolved scene beside the result; it can be run again. Raises DustError."""
    path = Path(directory) / SCENE
    # its files are found from anywhere
    text = f"{MADE}\n{scene.to_yaml(absolute=True)}"
    try:
        files.write_whole(path, text.encode())
    except OSError as error:
        raise DustError(f"Cannot write {path}: {files.explain(error, path)}.") from error
