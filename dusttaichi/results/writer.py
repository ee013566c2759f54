"""The writer of the result file, which a kill or a full disk cannot harm."""

from __future__ import annotations

import time as clock
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.results import files, pieces
from dusttaichi.results.layout import Contents, Rows
from dusttaichi.results.run_lock import acquire_lock
from dusttaichi.results.variables import LABELS, Variable
from dusttaichi.results.waiting import Batch, WaitingRecords, append_blocks, build_write_error

if TYPE_CHECKING:
    from dusttaichi.compute.background import Background
    from dusttaichi.results.run_lock import RunLock

PIECE = 8_000_000  # bytes from which a file is complete, and a new part begins
COPIED = 1_000_000_000  # bytes of files up to which the last records wait for their joining


def _format_time() -> str:
    return clock.strftime("%Y-%m-%dT%H:%M:%SZ", clock.gmtime())


class Writer(AbstractContextManager["Writer"]):
    """Appends records to one result; the files on disk are valid at any moment.

    `append` stores records in memory. `flush` writes the file again and replaces the old one by an
    atomic rename: after a kill or on a full disk the file of the last flush remains, and later
    records stay in memory for the next attempt. A file of PIECE bytes is complete, and a segment
    continues it (pieces.py), so that the cost of a flush is independent of the size of the result;
    `join` joins them into one file.
    Holds the lock of the run directory until `close`. Made by `create` or `resume`.

    Raises
    ------
    DustError
        By a method that cannot write: the records wait in memory until it is called again.
    """

    def __init__(self, path: Path, lock: RunLock, contents: Contents) -> None:
        self.path, self._lock, self._owns_lock = path, lock, False
        self._layout, self._dimensions, self._static, self._attributes, self._records = contents
        lengths = self._dimensions.items()
        self._sizes = {d: n if isinstance(n, int) else len(n) for d, n in lengths}
        self._waiting = WaitingRecords(self._layout, self._sizes)
        # the current piece: its number (0 is the result itself), its first records
        self._number, self._starts, self._identity = 0, dict.fromkeys(self._records, 0), ""
        self._size = 0  # of that piece [bytes]
        self._written: Rows = {}  # its records that are on disk
        self._alone = False  # there are no later parts, of a run that had progressed further
        self._changed = False
        self._last_time = None
        # the Batch that a Background writes, and that
        self._pending: tuple[Batch | None, Background] | None = None

    @classmethod
    def create(
        cls,
        path: str | Path,
        variables: Iterable[Variable],
        sizes: Mapping[str, Any],
        coords: Mapping[str, Any],
        attrs: Mapping[str, Any],
        *,
        force: bool = False,
        lock: RunLock | None = None,
    ) -> Writer:
        """A new result file with the given variables, on disk at once.

        Parameters
        ----------
        path : path
        variables : sequence of Variable
        sizes : dict
            Name -> number of entries of a dimension, or their names, in addition to LABELS.
        coords : dict
            Key -> values of a static variable.
        attrs : dict
            Global attributes, see `provenance`.
        force : bool
            Overwrite an existing file.
        lock : RunLock, optional
            An acquired lock, which the caller releases.

        Raises
        ------
        DustError
            The file exists and `force` is not set, another run has the lock, or the file cannot be
            written.
        """
        path = Path(path)
        with acquire_lock(path, lock) as lock_of_run:
            if path.exists() and not force:
                raise pieces.make_exists_error(path)
            layout = {v.key: v for v in variables}
            attributes = {"status": "running", "history": f"{_format_time()} started", **attrs}
            static = {k: np.asarray(coords[k]) for k, v in layout.items() if not v.grows}
            records = dict.fromkeys((v.group for v in layout.values()), 0)
            contents = Contents(layout, {**LABELS, **sizes}, static, attributes, records)
            writer = cls(path, lock_of_run, contents)
            writer._owns_lock, writer._identity = lock is None, pieces.new_identity()
            writer._changed = True
            writer.flush()
            files.remove_other_parts(path)
        return writer

    @classmethod
    def resume(
        cls, path: str | Path, counts: Mapping[str, int], *, lock: RunLock | None = None
    ) -> Writer:
        """Continue the file at `path`; further records are dropped with the first flush.

        Parameters
        ----------
        path
            The result file.
        counts
            Group -> records, see `counts()`.
        lock
            See `create`.

        Raises
        ------
        DustError
            The file is missing, damaged or shorter than the counts, or another run has the lock.
        """
        path = Path(path)
        if not path.exists():
            raise DustError(f"There is no result to continue at {path}.")
        with acquire_lock(path, lock) as lock_of_run:
            contents, last = pieces.describe_until(path, counts)
            history = f"{contents.attributes.get('history', '')}\n{_format_time()} resumed"
            writer = cls(path, lock_of_run, contents)
            writer._continue_from(last.number, last.starts)
            writer.set_attributes({"history": history, "status": "running"})
            writer._owns_lock = lock is None
        return writer

    def append(self, group: str, record: Mapping[str, Any], *, copy: bool = True) -> None:
        """Store one record of a group in memory.

        Parameters
        ----------
        group : str
            "series", "profiles", "snapshots"; for ragged groups ("contacts", "wall_contacts")
            always the rows of one snapshot, (rows,) or (rows, 3).
        record : dict
            Name -> number or array in the shape of the variable without its first dimension; a
            block of records includes the first dimension.
        copy : bool
            Without it, arrays of the type of the file are taken as they are, and must not change.

        Raises
        ------
        ValueError
            The record lacks a variable of the group.
        """
        self._waiting.append(group, record, copy=copy)
        self._changed = True

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups of the file."""
        return tuple(self._records)

    def add(self, variables: Sequence[Variable], sizes: Mapping[str, int] | None = None) -> None:
        """Add groups of growing variables; in the file from the next flush.

        Parameters
        ----------
        variables
            As in `create`.
        sizes
            As in `create`.
        """
        self.flush()
        self._dimensions |= sizes or {}
        self._sizes |= sizes or {}
        self._waiting.declare(variables, self._sizes)
        for group in dict.fromkeys(v.group for v in variables):
            self._records[group], self._starts[group] = 0, 0
        self._changed = True

    def set_status(self, status: str) -> None:
        """State of the run, published by the next flush: "running", "finished: ..." etc."""
        self.set_attributes({"status": status})

    def set_attributes(self, attributes: Mapping[str, Any]) -> None:
        """Change global attributes, published by the next flush."""
        self._attributes |= attributes
        self._changed = True

    @property
    def attributes(self) -> dict[str, Any]:
        """The global attributes of the next flush."""
        return dict(self._attributes)

    def counts(self) -> dict[str, int]:
        """Records of each group, with those in memory, for a checkpoint."""
        return {g: n + self._waiting.rows(g) for g, n in self._records.items()}

    @property
    def bytes_waiting(self) -> int:
        """Bytes of the records in memory that no one writes yet."""
        return self._waiting.nbytes

    def flush(self) -> float:
        """Write everything to disk; returns the seconds that it took (0.0 without changes)."""
        self.settle()
        if not self._changed:
            return 0.0
        began = clock.perf_counter()
        batch = self._take()
        try:
            files.prepare_folder(self.path, batch.number, self._alone)
            pieces.write_piece(*batch.arguments)
        except (OSError, RuntimeError) as error:
            raise self._put_back(batch, error) from error
        self._commit(batch)
        return clock.perf_counter() - began

    def begin_flush(self, background: Background, *calls: tuple[Any, ...]) -> None:
        """Begin to write everything by a Background, which `settle` and every `flush` wait for.

        Parameters
        ----------
        background
            Writes the file.
        *calls
            Further ones of the Background, after this one.
        """
        self.settle()
        if (batch := self._take() if self._changed else None) is not None:
            try:
                files.prepare_folder(self.path, batch.number, self._alone)
                calls = pieces.begin_piece(batch.arguments), *calls
            except OSError as error:
                raise self._put_back(batch, error) from error
        self._pending = batch, background
        background.start(*calls)

    def settle(self) -> float:
        """Wait for the file that a Background writes, if any; returns the seconds that it took."""
        if self._pending is None:
            return 0.0
        batch, background = self._pending
        error = background.wait()
        self._pending = None
        if batch is not None:
            if error is not None and background.done == 0:
                raise self._put_back(batch, error) from error
            self._commit(batch)
        if error is not None:  # of a further call
            raise error if isinstance(error, DustError) else DustError(f"{self.path}: {error}")
        return background.seconds

    def join(self, background: Background | None = None) -> None:
        """Join all files on disk into one, by a Background if it has begun."""
        if self.join_at_once(background):
            return
        self.flush()
        if self._number:
            identity = pieces.join(self.path, self._lock, background)
            self._continue_from(0, dict.fromkeys(self._records, 0), identity)

    def join_at_once(self, background: Background | None) -> bool:
        """Write everything and join all files by a Background without a file in between.

        False where it has not begun, or the files are large, so that a kill would lose much, or few
        records wait, or that has failed.
        """
        self.settle()
        can_join = background is not None and background.has_begun and self.bytes_waiting >= PIECE
        if not can_join or not (self._number or self._size >= PIECE):
            return False
        if sum(files.sizes_of(self.path)) > COPIED:
            return False
        batch = self._take()
        try:
            last = batch._replace(blocks={})
            identity = pieces.join(self.path, self._lock, background, last)
        except DustError as error:
            self._put_back(batch, error)
            return False
        self._note_time(batch)
        self._continue_from(0, dict.fromkeys(self._records, 0), identity)
        return True

    def close(self) -> None:
        """Flush and release the lock (also where the flush fails)."""
        try:
            self.flush()
        finally:
            if self._owns_lock:
                self._lock.release()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _continue_from(
        self, number: int, starts: Mapping[str, int], identity: str | None = None
    ) -> None:
        """Make the piece of that number on disk the current one; identity: of the result."""
        file = files.piece_path(self.path, number)
        self._number, self._starts, self._size = number, dict(starts), file.stat().st_size
        self._identity = identity or pieces.identity_of(self.path)
        counts = {group: n - self._starts[group] for group, n in self._records.items()}
        self._written = pieces.read_piece(file, self._layout, counts) if self._size < PIECE else {}

    def _take(self) -> Batch:
        """The records in memory as a Batch to be written; they are counted as written."""
        counts, blocks = self.counts(), self._waiting.take()
        number, starts, rows = self._number, self._starts, self._written
        if self._size >= PIECE:
            number, starts, rows = number + 1, dict(self._records), {}
        rows = append_blocks(rows, blocks)
        own = pieces.place(self._identity, starts if number else None)
        attributes = self._attributes | {"date_modified": _format_time()} | own
        contents = dict(self._layout), dict(self._dimensions), self._static, rows
        arguments = files.piece_path(self.path, number), contents, attributes, self.path
        batch = Batch(number, starts, blocks, self._records, arguments)
        self._records, self._changed = counts, False
        return batch

    def _commit(self, batch: Batch) -> None:
        """Note that a Batch is on disk."""
        self._number, self._starts = batch.number, batch.starts
        self._size = batch.file.stat().st_size
        self._written = batch.rows if self._size < PIECE else {}
        self._alone = True
        self._note_time(batch)

    def _note_time(self, batch: Batch) -> None:
        if "series" in batch.blocks:
            self._last_time = batch.blocks["series"][-1]["time"][-1]

    def _put_back(self, batch: Batch, error: BaseException) -> DustError:
        """Take the records of a Batch that could not be written into memory; the DustError."""
        self._records, self._changed = batch.records, True
        self._waiting.put_back(batch.blocks)
        waiting = sum(self._waiting.rows(group) for group in self._records)
        return build_write_error(self.path, error, waiting, self._last_time)
