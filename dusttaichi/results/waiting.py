"""Records of a result that wait in memory until they are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results.files import advise_resuming, explain
from dusttaichi.results.layout import count_bytes, ragged_groups

if TYPE_CHECKING:
    from dusttaichi.results.layout import Rows
    from dusttaichi.results.variables import Variable


MERGED = 1_000_000  # bytes up to which blocks of records become one


class Batch(NamedTuple):
    """Records that go to disk at once.

    number, starts: of their piece; blocks: the records; records: of each group before them;
    arguments: of pieces.write_piece.
    """

    number: int
    starts: dict[str, int]
    blocks: Rows
    records: dict[str, int]
    arguments: tuple[Path, tuple[Any, ...], dict[str, Any], Path]

    @property
    def ends(self) -> dict[str, int]:
        """Records of each group with these."""
        return {g: n + count_rows(self.rows.get(g, [])) for g, n in self.starts.items()}

    @property
    def file(self) -> Path:
        """Path of the piece."""
        return self.arguments[0]

    @property
    def rows(self) -> Rows:
        """All records of the piece."""
        rows: Rows = self.arguments[1][-1]
        return rows


class WaitingRecords:
    """Records of groups of growing variables, in the order of `append`.

    layout: key -> Variable, which `declare` extends. sizes: name -> length of the dimensions.
    """

    def __init__(self, layout: dict[str, Variable], sizes: Mapping[str, int]) -> None:
        self._layout = layout
        self._blocks: dict[str, list[dict[str, NDArray[Any]]]] = {
            v.group: [] for v in layout.values()
        }
        # group -> name -> (type, shape of an entry)
        self._entries: dict[str, dict[str, tuple[str, tuple[int, ...]]]] = {}
        self.declare(layout.values(), sizes)

    def declare(self, variables: Iterable[Variable], sizes: Mapping[str, int]) -> None:
        """Add groups of variables, of which those that grow have records."""
        for v in variables:
            self._layout[v.key] = v
            self._blocks.setdefault(v.group, [])
            if v.grows:
                entry = v.dtype, tuple(sizes[d] for d in v.dims[1:])
                self._entries.setdefault(v.group, {})[v.name] = entry

    def append(self, group: str, record: Mapping[str, Any], *, copy: bool = True) -> None:
        """Store one record, or a block of them, as `Writer.append` does. Raises ValueError."""
        expected = self._entries.get(group, {})
        if record.keys() != expected.keys():
            raise ValueError(f"{group} takes {sorted(expected)}, not {sorted(record)}")
        block, lengths = {}, set()
        for name, (kind, tail) in expected.items():
            data = (np.array if copy else np.asarray)(record[name], dtype=kind)
            data = data[np.newaxis] if data.ndim == len(tail) else data
            if data.shape[1:] != tail:
                raise ValueError(f"{group}/{name} has shape {data.shape[1:]}, not {tail}")
            block[name] = data
            lengths.add(len(data))
        if len(lengths) != 1:
            raise ValueError(f"the arrays of {group} differ in their number of rows: {lengths}")
        self._blocks[group].append(block)

    def rows(self, group: str) -> int:
        """Number of records of a group."""
        return count_rows(self._blocks[group])

    @property
    def nbytes(self) -> int:
        """Bytes of all records."""
        return count_bytes(self._blocks)

    def take(self) -> Rows:
        """Remove all records. Raises ValueError for wrong ragged rows."""
        records_by_group = {g: merge(blocks) for g, blocks in self._blocks.items() if blocks}
        for group, count in ragged_groups(self._layout).items():
            counted, rows = records_by_group.get(count.group, []), self.rows(group)
            expected = sum(int(block[count.name].sum()) for block in counted)
            if expected != rows:
                raise ValueError(
                    f"{group} has {rows} rows since the last flush, {count.name} {expected}"
                )
        self._blocks = {group: [] for group in self._blocks}
        return records_by_group

    def put_back(self, records_by_group: Rows) -> None:
        """Put records that `take` removed before those that have come since."""
        for group, blocks in records_by_group.items():
            self._blocks[group][:0] = blocks


def append_blocks(rows: Rows, blocks: Rows) -> Rows:
    """Two sets of records one after the other."""
    joined = {group: merge([*rows.get(group, []), *added]) for group, added in blocks.items()}
    return rows | joined


def count_rows(blocks: list[dict[str, NDArray[Any]]]) -> int:
    """Number of records in blocks."""
    return sum(len(next(iter(block.values()))) for block in blocks)


def merge(blocks: list[dict[str, NDArray[Any]]]) -> list[dict[str, NDArray[Any]]]:
    """The same records in fewer blocks; large ones are not copied."""
    runs: list[list[dict[str, NDArray[Any]]]] = []  # of blocks that become one
    size = 0
    for block in blocks:
        added = count_bytes({"": [block]})
        if not runs or size + added > MERGED:
            runs.append([])
            size = 0
        runs[-1].append(block)
        size += added
    return [run[0] if len(run) == 1 else _concatenate(run) for run in runs]


def _concatenate(blocks: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def build_write_error(
    path: Path, error: BaseException, waiting: int, last_time: float | None
) -> DustError:
    """The DustError of a file of the result at `path` that could not be written.

    waiting: number of records that are in memory. last_time: of the last record on disk [s], or
    None.
    """
    reason = explain(error, path)
    if not path.exists():
        return DustError(f"Could not write {path}: {reason}. There is no result.")
    until = "" if last_time is None else f" (up to t = {last_time:.6g} s)"
    return DustError(
        f"Could not write {path}: {reason}. The result of the last flush is readable{until}; "
        f"{waiting} records since then are not on disk. Remove the cause and "
        f"{advise_resuming(path)}."
    )
