"""The writer of the result file, which a kill or a full disk cannot harm."""

import time as clock
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.results import pieces
from dusttaichi.results.files import explain, parts_folder, write_whole
from dusttaichi.results.layout import (
    describe,
    ragged_groups,
    read_records,
    readable,
    yield_file_blocks,
)
from dusttaichi.results.variables import LABELS

PIECE = 8_000_000  # bytes from which a file is complete, and a new part begins


def _format_time():
    return clock.strftime("%Y-%m-%dT%H:%M:%SZ", clock.gmtime())


def _concatenate(blocks):
    """The arrays one after another; a single array is not copied."""
    return blocks[0] if len(blocks) == 1 else np.concatenate(blocks)


class Writer(AbstractContextManager):
    """Appends records to one result; the files on disk are valid at any moment.

    `append` stores records in memory. `flush` creates the file again in memory (HDF5 does not
    recover from a failed write) and replaces the old one by an atomic rename: after a kill or on a
    full disk the file of the last flush remains, and later records stay in memory for the next
    attempt. A file of PIECE bytes is complete, and a further one continues it (pieces.py), so that
    the cost of a flush is independent of the size of the result; `join` joins them into one file.
    Holds the lock of the run directory until `close`. Use `Writer.create` or `Writer.resume`. A
    context manager.
    """

    def __init__(self, path, lock, *, layout, sizes, static, attributes, records):
        self.path = Path(path)
        self._lock, self._owns_lock = lock, False
        self._layout, self._dimensions, self._static = layout, sizes, static
        self._sizes = {d: n if isinstance(n, int) else len(n) for d, n in sizes.items()}
        self._attributes, self._records = attributes, records
        self._note_entries()
        self._buffer = {group: [] for group in records}
        # the current piece: its number (0 is the result itself), its first records
        self._number, self._starts, self._identity = 0, dict.fromkeys(records, 0), ""
        self._size = 0  # of that piece [bytes]
        self._written = {}  # its records that are on disk, group -> name -> array
        self._alone = False  # there are no later parts, of a run that had progressed further
        self._changed = False
        self._last_time = None

    @classmethod
    def create(cls, path, variables, sizes, coords, attrs, *, force=False, lock=None) -> "Writer":
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
        with pieces.acquire_lock(path, lock) as lock_of_run:
            if path.exists() and not force:
                raise pieces.make_exists_error(path)
            layout = {v.key: v for v in variables}
            attributes = {"status": "running", "history": f"{_format_time()} started", **attrs}
            static = {k: np.asarray(coords[k]) for k, v in layout.items() if not v.grows}
            records = dict.fromkeys((v.group for v in layout.values()), 0)
            sizes = {**LABELS, **sizes}
            contents = {"layout": layout, "sizes": sizes, "static": static}
            contents |= {"attributes": attributes, "records": records}
            writer = cls(path, lock_of_run, **contents)
            writer._owns_lock, writer._identity = lock is None, pieces.new_identity()
            writer._changed = True
            writer.flush()
            pieces.remove_other_parts(path)
        return writer

    @classmethod
    def resume(cls, path, counts, *, lock=None) -> "Writer":
        """Continue the file at `path`; further records are dropped with the first flush.

        Parameters
        ----------
        path : path
        counts : dict
            Group -> records, see `counts()`.
        lock : RunLock, optional
            An acquired lock, which the caller releases.

        Raises
        ------
        DustError
            The file is missing, damaged or shorter than the counts, or another run has the lock.
        """
        path = Path(path)
        if not path.exists():
            raise DustError(f"There is no result to continue at {path}.")
        with pieces.acquire_lock(path, lock) as lock_of_run:
            writer = cls._from_pieces(path, lock_of_run, counts)
            writer._owns_lock = lock is None
        return writer

    @classmethod
    def _from_pieces(cls, path, lock, counts):
        """A Writer that continues the pieces of a result from `counts`."""
        with readable(path):  # damage is reported now, not at the end of the run
            files = pieces.pieces_of(path)
        short = [group for group, n in counts.items() if files[-1].ends.get(group, 0) < n]
        if short:
            raise DustError(
                f"{path} has fewer records of {', '.join(short)} than the checkpoint: they are not "
                "of the same run. Start again with --force."
            )
        while len(files) > 1 and all(n >= counts.get(g, 0) for g, n in files[-1].starts.items()):
            files.pop()  # it is later than the checkpoint
        layout, sizes, static, attributes, _ = describe(files[-1].path)
        attributes["history"] = f"{attributes.get('history', '')}\n{_format_time()} resumed"
        attributes = {k: v for k, v in attributes.items() if k not in pieces.OWN}
        records = {group: int(counts.get(group, 0)) for group in files[-1].ends}
        contents = {"layout": layout, "sizes": sizes, "static": static, "attributes": attributes}
        writer = cls(path, lock, **contents, records=records)
        writer._continue_from(len(files) - 1, files[-1].starts)
        writer.set_status("running")
        return writer

    def append(self, group, record):
        """Store one record of a group in memory.

        Parameters
        ----------
        group : str
            "series", "profiles", "snapshots"; for ragged groups ("contacts", "wall_contacts")
            always the rows of one snapshot, (rows,) or (rows, 3).
        record : dict
            Name -> number or array in the shape of the variable without its first dimension; a
            block of records includes the first dimension.

        Raises
        ------
        ValueError
            The record lacks a variable of the group.
        """
        expected = self._entries.get(group, {})
        if record.keys() != expected.keys():
            raise ValueError(f"{group} takes {sorted(expected)}, not {sorted(record)}")
        block, lengths = {}, set()
        for name, (dtype, tail) in expected.items():
            data = np.array(record[name], dtype=dtype)
            data = data[np.newaxis] if data.ndim == len(tail) else data
            if data.shape[1:] != tail:
                raise ValueError(f"{group}/{name} has shape {data.shape[1:]}, not {tail}")
            block[name] = data
            lengths.add(len(data))
        if len(lengths) != 1:
            raise ValueError(f"the arrays of {group} differ in their number of rows: {lengths}")
        self._buffer[group].append(block)
        self._changed = True

    @property
    def groups(self):
        """Names of the groups of the file."""
        return tuple(self._records)

    def add(self, variables, sizes=()):
        """Add groups of growing variables; in the file from the next flush.

        Parameters
        ----------
        variables : sequence of Variable
        sizes : dict
            As in `create`.
        """
        self.flush()
        self._layout |= {v.key: v for v in variables}
        self._dimensions |= dict(sizes)
        self._sizes |= dict(sizes)
        for group in dict.fromkeys(v.group for v in variables):
            self._records[group], self._starts[group], self._buffer[group] = 0, 0, []
        self._note_entries()
        self._changed = True

    def set_status(self, status):
        """State of the run, published by the next flush: "running", "finished: ..." etc."""
        self.set_attributes({"status": status})

    def set_attributes(self, attributes):
        """Change global attributes, published by the next flush."""
        self._attributes |= attributes
        self._changed = True

    @property
    def attributes(self):
        """The global attributes of the next flush."""
        return dict(self._attributes)

    def counts(self):
        """Records of each group, with those in memory, for a checkpoint."""
        return {g: n + self._rows_waiting(g) for g, n in self._records.items()}

    def flush(self):
        """Write everything to disk.

        Returns
        -------
        float
            Seconds that it took (0.0 without changes).

        Raises
        ------
        DustError
            The file cannot be written; nothing is lost then, and flush may be called again.
        """
        if not self._changed:
            return 0.0
        began = clock.perf_counter()
        counts, blocks = self.counts(), self._join_blocks()
        number, starts, rows = self._number, self._starts, self._written
        if self._size >= PIECE:
            number, starts, rows = number + 1, dict(self._records), {}
        rows = pieces.append_blocks(rows, blocks)
        file = self._file(number)
        try:
            if not self._alone:
                pieces.remove_parts(self.path, number)
            if number:
                file.parent.mkdir(exist_ok=True)
            self._write(rows, number, starts)
        except (OSError, RuntimeError) as error:
            reason = explain(error, self.path)
            raise DustError(self._failure(reason)) from error
        # harmless if interrupted after the rename: the same records are then written again
        self._records, self._buffer = counts, {group: [] for group in counts}
        self._number, self._starts, self._size = number, starts, file.stat().st_size
        self._written = rows if self._size < PIECE else {}
        self._alone, self._changed = True, False
        if "series" in blocks:
            self._last_time = blocks["series"]["time"][-1]
        return clock.perf_counter() - began

    def join(self):
        """Join all files on disk into one.

        Raises
        ------
        DustError
            The file cannot be written; nothing is lost then.
        """
        self.flush()
        if self._number:
            pieces.join(self.path, self._lock)
            self._continue_from(0, dict.fromkeys(self._records, 0))

    def close(self):
        """Flush and release the lock (also where the flush fails)."""
        try:
            self.flush()
        finally:
            if self._owns_lock:
                self._lock.release()

    def __exit__(self, *_):
        self.close()

    def _note_entries(self):
        """Set group -> name -> (type, shape of an entry) of all variables that grow."""
        self._entries = {}
        for v in (v for v in self._layout.values() if v.grows):
            entry = v.dtype, tuple(self._sizes[d] for d in v.dims[1:])
            self._entries.setdefault(v.group, {})[v.name] = entry

    def _rows_waiting(self, group):
        return sum(len(next(iter(block.values()))) for block in self._buffer[group])

    def _join_blocks(self):
        """Group -> name -> array of the records in memory. Checks the number of ragged rows."""
        blocks = {
            group: {name: _concatenate([b[name] for b in waiting]) for name in waiting[0]}
            for group, waiting in self._buffer.items()
            if waiting
        }
        for group, count in ragged_groups(self._layout).items():
            expected, rows = blocks.get(count.group, {}).get(count.name), self._rows_waiting(group)
            expected = 0 if expected is None else expected.sum()
            if expected != rows:
                raise ValueError(
                    f"{group} has {rows} rows since the last flush, {count.name} {expected}"
                )
        return blocks

    def _file(self, number):
        return parts_folder(self.path) / f"{number:06}.nc" if number else self.path

    def _continue_from(self, number, starts):
        """Make the piece of that number, which is on disk, the current one."""
        file = self._file(number)
        self._number, self._starts = number, dict(starts)
        self._identity, self._size = pieces.identity_of(self.path), file.stat().st_size
        counting = {group: n - self._starts[group] for group, n in self._records.items()}
        self._written = read_records(file, self._layout, counting) if self._size < PIECE else {}

    def _write(self, rows, number, starts):
        """Write a piece with these rows, group -> name -> array."""
        placement = pieces.place(self._identity, starts if number else None)
        attributes = self._attributes | {"date_modified": _format_time()} | placement
        contents = self._layout, self._dimensions, self._static
        write_whole(
            self._file(number),
            yield_file_blocks(*contents, rows, attributes, result_path=self.path),
        )

    def _failure(self, reason):
        waiting = sum(self._rows_waiting(group) for group in self._records)
        if not self.path.exists():
            return f"Could not write {self.path}: {reason}. There is no result."
        until = "" if self._last_time is None else f" (up to t = {self._last_time:.6g} s)"
        return (
            f"Could not write {self.path}: {reason}. The result of the last flush is "
            f"readable{until}; {waiting} records since then are not on disk. Remove the cause and "
            "continue with --resume."
        )
