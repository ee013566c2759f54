"""Records of a result that wait in memory until they are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dusttaichi.results.layout import ragged_groups

if TYPE_CHECKING:
    from dusttaichi.results.layout import Rows
    from dusttaichi.results.variables import Variable


class Batch(NamedTuple):
    """Records that go to disk at once.

    number, starts: of their piece; blocks: group -> name -> array; records: of each group before
    them; arguments: of pieces.write_piece.
    """

    number: int
    starts: dict[str, int]
    blocks: Rows
    records: dict[str, int]
    arguments: tuple[Path, tuple[Any, ...], dict[str, Any], Path]

    @property
    def file(self) -> Path:
        """Path of the piece."""
        return self.arguments[0]

    @property
    def rows(self) -> Rows:
        """Group -> name -> array: all records of the piece."""
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

    def append(self, group: str, record: Mapping[str, Any]) -> None:
        """Store one record, or a block of them, as `Writer.append` does. Raises ValueError."""
        expected = self._entries.get(group, {})
        if record.keys() != expected.keys():
            raise ValueError(f"{group} takes {sorted(expected)}, not {sorted(record)}")
        block, lengths = {}, set()
        for name, (kind, tail) in expected.items():
            data = np.array(record[name], dtype=kind)
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
        return sum(len(next(iter(block.values()))) for block in self._blocks[group])

    @property
    def nbytes(self) -> int:
        """Bytes of all records."""
        return sum(
            values.nbytes
            for blocks in self._blocks.values()
            for block in blocks
            for values in block.values()
        )

    def take(self) -> Rows:
        """Remove all records: group -> name -> array. Raises ValueError for wrong ragged rows."""
        records_by_group = {
            group: {name: _concatenate([b[name] for b in blocks]) for name in blocks[0]}
            for group, blocks in self._blocks.items()
            if blocks
        }
        for group, count in ragged_groups(self._layout).items():
            counted, rows = records_by_group.get(count.group, {}).get(count.name), self.rows(group)
            expected = 0 if counted is None else counted.sum()
            if expected != rows:
                raise ValueError(
                    f"{group} has {rows} rows since the last flush, {count.name} {expected}"
                )
        self._blocks = {group: [] for group in self._blocks}
        return records_by_group

    def put_back(self, records_by_group: Rows) -> None:
        """Put records that `take` removed before those that have come since."""
        for group, block in records_by_group.items():
            self._blocks[group].insert(0, block)


def _concatenate(blocks: list[NDArray[Any]]) -> NDArray[Any]:
    """The arrays one after another; a single array is not copied."""
    return blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
