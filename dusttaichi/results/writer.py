"""The writer of the result file, which a kill or a full disk cannot harm."""

import time as clock
from pathlib import Path

import netCDF4
import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.files import RunLock, clone, explain, replace_atomically, reserve
from dusttaichi.results.layout import (
    chunk_rows,
    copy_records,
    define,
    describe,
    folder_of,
    ragged_groups,
)
from dusttaichi.results.variables import LABELS


def _now():
    return clock.strftime("%Y-%m-%dT%H:%M:%SZ", clock.gmtime())


class Writer:
    """Appends records to one result file; what is on disk is whole at any moment.

    `append` keeps records in memory. `flush` makes a copy of the file, appends to the copy, and
    puts it in the place of the file by an atomic rename: a kill or a full disk leaves the file as
    it was at the last flush, and the records since then in memory, for the next flush to try
    again. The cost of a flush grows with the file, so the run loop spaces flushes by the seconds
    that `flush` returns. Holds the lock of the run directory until `close`.
    Use `Writer.create` or `Writer.resume`. A context manager.
    """

    def __init__(self, path, lock, *, layout, sizes, static, attributes, records):
        self.path = Path(path)
        self._lock, self._layout, self._dimensions, self._static = lock, layout, sizes, static
        self._sizes = {d: n if isinstance(n, int) else len(n) for d, n in sizes.items()}
        self._attributes, self._records = attributes, records
        self._buffer = {group: [] for group in records}
        self._base = "copy"  # what a flush starts from: "new" file, "cut" or "copy" of the old
        self._changed = False
        self._last_time = None

    @classmethod
    def create(cls, path, variables, sizes, coords, attrs, *, force=False, lock=None):
        """A new result file with the given Variables, on disk at once.

        sizes: name -> number of entries of a dimension, or their names; LABELS has some already.
        coords: values of variables that do not grow, by key.
        attrs: global attributes, see `provenance`. lock: a RunLock already held (it then stays
        the caller's to release). Raises DustError if the file exists and `force` is not set, if
        another run holds the directory, or if it cannot be written.
        """
        path = Path(path)
        own = lock is None
        lock = RunLock(path.parent) if own else lock
        try:
            if path.exists() and not force:
                raise DustError(
                    f"{path} exists already. Use --force to overwrite it, --resume to go on with "
                    "it, or choose another output directory."
                )
            layout = {v.key: v for v in variables}
            attributes = {"status": "running", "history": f"{_now()} started", **attrs}
            static = {k: np.asarray(coords[k]) for k, v in layout.items() if not v.grows}
            records = dict.fromkeys((v.group for v in layout.values()), 0)
            sizes = {**LABELS, **sizes}
            known = {"layout": layout, "sizes": sizes, "static": static}
            known |= {"attributes": attributes, "records": records}
            writer = cls(path, lock if own else None, **known)
            writer._base = "new"
            writer.flush()
        except BaseException:
            if own:
                lock.release()
            raise
        return writer

    @classmethod
    def resume(cls, path, counts, *, lock=None):
        """Go on with the file at `path` from `counts` (group -> records, as of `counts()`).

        What the file holds past the counts is dropped with the first flush. Raises DustError if
        the file is missing, damaged or shorter than the counts, or another run holds it.
        """
        path = Path(path)
        if not path.exists():
            raise DustError(f"There is no result to go on with at {path}.")
        own = lock is None
        lock = RunLock(path.parent) if own else lock
        try:
            layout, sizes, static, attributes, records = describe(path)
            short = [g for g in records if records[g] < counts.get(g, 0)]
            if short:
                raise DustError(
                    f"{path} holds fewer records of {', '.join(short)} than the checkpoint knows "
                    "of: they are not of the same run. Start anew with --force."
                )
            attributes["history"] = f"{attributes.get('history', '')}\n{_now()} resumed"
            kept = {group: int(counts.get(group, 0)) for group in records}
            known = {"layout": layout, "sizes": sizes, "static": static}
            known |= {"attributes": attributes, "records": kept}
            writer = cls(path, lock if own else None, **known)
            writer._base = "copy" if kept == records else "cut"
            writer.set_status("running")
        except BaseException:
            if own:
                lock.release()
            raise
        return writer

    def append(self, group, record):
        """Keep one record of `group` ("series", "profiles", "snapshots") in memory.

        record: name -> number or array in the shape of the variable without its first dimension;
        a block of records has the first dimension too. For the ragged groups ("contacts",
        "wall_contacts") always the rows of one snapshot, (rows,) or (rows, 3).
        Every variable of the group must be there. ValueError otherwise.
        """
        expected = {v.name: v for v in self._layout.values() if v.group == group and v.grows}
        if set(record) != set(expected):
            raise ValueError(f"{group} takes {sorted(expected)}, not {sorted(record)}")
        block, lengths = {}, set()
        for name, variable in expected.items():
            tail = tuple(self._sizes[d] for d in variable.dims[1:])
            data = np.array(record[name], dtype=variable.dtype)
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
        """Names of the groups that the file has."""
        return tuple(self._records)

    def add(self, variables, sizes=()):
        """Further groups, whose Variables all grow; in the file from the next flush on."""
        self.flush()
        self._layout |= {v.key: v for v in variables}
        self._dimensions |= dict(sizes)
        self._sizes |= dict(sizes)
        for group in dict.fromkeys(v.group for v in variables):
            self._records[group], self._buffer[group] = 0, []
        self._base, self._changed = "cut", True

    def set_status(self, status):
        """State of the run, published by the next flush: "running", "finished: ..." etc."""
        self.set_attributes({"status": status})

    def set_attributes(self, attributes):
        """Change global attributes, published by the next flush."""
        self._attributes |= attributes
        self._changed = True

    @property
    def attributes(self):
        """The global attributes, as the next flush publishes them."""
        return dict(self._attributes)

    def counts(self):
        """Records of each group, those in memory included: what a checkpoint keeps."""
        return {g: n + self._rows_waiting(g) for g, n in self._records.items()}

    @property
    def pending_bytes(self):
        """Size of what waits in memory for the next flush."""
        return sum(a.nbytes for b in self._buffer.values() for r in b for a in r.values())

    def flush(self):
        """Put everything on disk. Returns the seconds it took (0.0 if there was nothing to do).

        Raises DustError where it cannot be written; nothing is lost then, and flush may be
        called again.
        """
        if not self._changed and self._base == "copy":
            return 0.0
        began = clock.perf_counter()
        counts, blocks = self.counts(), self._joined()
        temporary = self.path.with_name(f".{self.path.name}.tmp")
        try:
            if self._base == "copy":
                clone(self.path, temporary)
            else:
                self._start_file(temporary)
            reserve(temporary, self._room(blocks))
            self._write(temporary, blocks)
            replace_atomically(temporary, self.path)
        except (OSError, RuntimeError) as error:
            reason = explain(error, self.path)
            temporary.unlink(missing_ok=True)
            raise DustError(self._failure(reason)) from error
        # a break between the rename and here is harmless: the same records are written to the
        # same places again
        self._records, self._buffer = counts, {group: [] for group in counts}
        self._base, self._changed = "copy", False
        if "series" in blocks:
            self._last_time = blocks["series"]["time"][-1]
        return clock.perf_counter() - began

    def close(self):
        """Flush and give the lock back (the lock also where the flush fails)."""
        try:
            self.flush()
        finally:
            if self._lock is not None:
                self._lock.release()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _rows_waiting(self, group):
        return sum(len(next(iter(block.values()))) for block in self._buffer[group])

    def _joined(self):
        """Group -> name -> one array of all that waits. Checks that ragged rows add up."""
        blocks = {
            group: {name: np.concatenate([b[name] for b in waiting]) for name in waiting[0]}
            for group, waiting in self._buffer.items()
            if waiting
        }
        for group, count in ragged_groups(self._layout).items():
            said = blocks.get(count.group, {}).get(count.name, np.zeros(0)).sum()
            if said != self._rows_waiting(group):
                raise ValueError(
                    f"{group} holds {self._rows_waiting(group)} rows since the "
                    f"last flush, {count.name} says {said}"
                )
        return blocks

    def _start_file(self, temporary):
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as new:
            define(new, self._layout, self._dimensions, self._static)
            if self._base == "cut":
                with netCDF4.Dataset(self.path) as old:
                    copy_records(old, new, self._layout, self._records)

    def _room(self, blocks):
        """Bytes that HDF5 may need for `blocks`: whole chunks, and some for its own tables."""
        room, ragged = 1_000_000, ragged_groups(self._layout)
        for variable in self._layout.values():
            data = blocks.get(variable.group, {}).get(variable.name, ())
            if len(data):
                row = data.nbytes // len(data)
                chunk = chunk_rows(variable, self._sizes, variable.group in ragged)
                room += data.nbytes + 2 * row * chunk
        return room

    def _write(self, temporary, blocks):
        with netCDF4.Dataset(temporary, "a") as file:
            file.set_auto_maskandscale(False)
            for name, value in {**self._attributes, "date_modified": _now()}.items():
                if isinstance(value, str):  # setncattr would limit them to 64 kB
                    file.setncattr_string(name, value)
                elif value is not None:
                    file.setncattr(name, value)
            for group, block in blocks.items():
                start, folder = self._records[group], folder_of(file, group)
                for name, data in block.items():
                    folder[name][start : start + len(data)] = data

    def _failure(self, reason):
        waiting = sum(self._rows_waiting(group) for group in self._records)
        if not self.path.exists():
            return f"Could not write {self.path}: {reason}. No result is kept there."
        until = "" if self._last_time is None else f" (up to t = {self._last_time:.6g} s)"
        return (
            f"Could not write {self.path}: {reason}. The result written before is kept and "
            f"readable{until}; {waiting} records since then are not on disk. "
            "Mend that and go on with --resume."
        )
