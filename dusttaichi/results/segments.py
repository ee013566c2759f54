"""Files that continue a result during its run: the numbers of its records, and their description.

A segment is a file of arrays (stored_arrays.py) named `group/variable`, those of one name one after
the other. Its meta data are the table of variables, the dimensions and the global attributes;
static values are in result.nc alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.results import integrity, stored_arrays
from dusttaichi.results.files import remove, temporary_path, write_blocks
from dusttaichi.results.integrity import Header
from dusttaichi.results.layout import Contents, Rows, open_for_records
from dusttaichi.results.stored_arrays import Opened, StoredArray
from dusttaichi.results.variables import Variable

MAGIC = b"dusttaichi records 1\n"
_STORED = [f.name for f in fields(Variable) if f.name != "needs"]
_checked: dict[str, tuple[int, ...]] = {}  # path -> identity of the verified file


def write(path: Path, contents: tuple[Any, ...], attributes: Mapping[str, Any]) -> Path:
    """Write a segment for `path` beside it, to be moved there; returns its path. Raises OSError.

    contents: layout, dimensions, static values, which are omitted, and records.
    """
    layout, dimensions, _, rows = contents
    variables = [[getattr(v, name) for name in _STORED] for v in layout.values()]
    meta = {"variables": variables, "dimensions": dimensions, "attributes": dict(attributes)}
    arrays = (
        (f"{group}/{name}", values)
        for group, blocks in rows.items()
        for block in blocks
        for name, values in block.items()
    )
    temporary = temporary_path(path)
    try:
        write_blocks(
            temporary, stored_arrays.yield_blocks(MAGIC, arrays, stored_arrays.encode(meta))
        )
    except BaseException:
        remove(temporary)
        raise
    return temporary


class Segment:
    """An open segment.

    contents: its Contents, without static values.
    """

    def __init__(self, path: str | Path, opened: Opened) -> None:
        self._path, self._file, meta = path, opened.file, opened.meta
        self._arrays: dict[str, list[StoredArray]] = {}
        for stored in opened.listing:
            self._arrays.setdefault(stored.name, []).append(stored)
        variables = [_restore(entries) for entries in meta["variables"]]
        layout = {v.key: v for v in variables}
        sizes = {n: d if isinstance(d, int) else tuple(d) for n, d in meta["dimensions"].items()}
        records = dict.fromkeys((v.group for v in variables), 0)
        for v in variables:
            if v.grows:
                records[v.group] = sum(stored.shape[0] for stored in self._list(v.group, v.name))
        self.contents = Contents(layout, sizes, {}, meta["attributes"], records)

    def _list(self, group: str, name: str) -> list[StoredArray]:
        return self._arrays.get(f"{group}/{name}", [])

    def verify(self) -> None:
        """Read all numbers. Raises DamagedFile."""
        for v in self._growing(self.contents.records):
            for _ in self._yield_arrays(v.group, v.name, self.contents.records[v.group]):
                pass

    def read(self, group: str, name: str, low: int, high: int) -> NDArray[Any]:
        """Records `low` to before `high` of a variable, one at least."""
        blocks, first = [], 0
        with _translate_errors(self._path):
            for stored in self._list(group, name):
                begin, end = max(low - first, 0), min(high - first, stored.shape[0])
                if begin < end:
                    blocks.append(stored_arrays.read_rows(self._file, stored, begin, end))
                first += stored.shape[0]
        return blocks[0] if len(blocks) == 1 else np.concatenate(blocks)

    def read_records(self, counts: Mapping[str, int]) -> Rows:
        """The first `counts` records of each group. Raises DamagedFile."""
        rows: Rows = {}
        for v in self._growing(counts):
            blocks = list(self._yield_arrays(v.group, v.name, counts[v.group]))
            rows.setdefault(v.group, [{}])[0][v.name] = np.concatenate(blocks)
        return rows

    def copy_records(self, file: Any, counts: Mapping[str, int], starts: Mapping[str, int]) -> None:
        """The first `counts` records of each group to an open NetCDF file. Raises DamagedFile.

        starts: group -> number of their first record there.
        """
        file.set_auto_maskandscale(False)
        for v in self._growing(counts):
            target, begin = open_for_records(file, v.group, v.name), starts[v.group]
            for values in self._yield_arrays(v.group, v.name, counts[v.group]):
                target[begin : begin + len(values)] = values
                begin += len(values)

    def _growing(self, counts: Mapping[str, int]) -> Iterator[Variable]:
        """The variables of groups that have records."""
        return (v for v in self.contents.layout.values() if v.grows and counts.get(v.group, 0))

    def _yield_arrays(self, group: str, name: str, count: int) -> Iterator[NDArray[Any]]:
        """The first `count` records of a variable, in blocks; their checksums are compared."""
        for stored in self._list(group, name):
            if count > 0:
                with _translate_errors(self._path):
                    values = stored_arrays.read_array(self._file, stored)[:count]
                count -= len(values)
                yield values


def _restore(entries: list[Any]) -> Variable:
    stored = Variable(**dict(zip(_STORED, entries, strict=True)))
    return replace(stored, dims=tuple(stored.dims))


@contextmanager
def open_segment(path: str | Path) -> Iterator[Segment]:
    """A verified Segment that is open for reading.

    Raises OSError, as for a missing file; DustError without permission; DamagedFile.
    """
    real_path, identity = integrity.identify(path)
    with ExitStack() as stack:
        with _translate_errors(path):
            opened = stack.enter_context(stored_arrays.open_arrays(path, MAGIC))
            segment = Segment(path, opened)
        if _checked.get(real_path) != identity and integrity.reads_numbers():
            segment.verify()
            _checked[real_path] = identity
        yield segment


def check(path: str | Path) -> Header:
    """The Header of a segment, which is verified once in a process. Raises as `open_segment`."""
    contents = describe(path)
    return Header(contents.attributes, contents.records)


def describe(path: str | Path) -> Contents:
    """The Contents of a segment, without static values. Raises as `open_segment`."""
    with open_segment(path) as segment:
        return segment.contents


@contextmanager
def _translate_errors(path: str | Path) -> Iterator[None]:
    """Context in which a segment is opened or read; its errors are those of `open_segment`."""
    try:
        with integrity.translate_errors(path):
            yield
    except (ValueError, KeyError, TypeError) as error:
        raise integrity.build_damage_error(path) from error
