"""Records of a result that wait in memory until they are written."""

from typing import NamedTuple

import numpy as np

from dusttaichi.results.layout import ragged_groups


class Batch(NamedTuple):
    """Records that go to disk at once.

    number, starts: of their piece; blocks: group -> name -> array; records: of each group before
    them; arguments: of pieces.write_piece.
    """

    number: int
    starts: dict
    blocks: dict
    records: dict
    arguments: tuple

    @property
    def file(self):
        """Path of the piece."""
        return self.arguments[0]

    @property
    def rows(self):
        """Group -> name -> array: all records of the piece."""
        return self.arguments[1][-1]


class WaitingRecords:
    """Records of groups of growing variables, in the order of `append`.

    layout: key -> Variable, which `declare` extends. sizes: name -> length of the dimensions.
    """

    def __init__(self, layout, sizes):
        self._layout = layout
        self._blocks = {v.group: [] for v in layout.values()}
        self._entries = {}  # group -> name -> (type, shape of an entry)
        self.declare(layout.values(), sizes)

    def declare(self, variables, sizes):
        """Add groups of variables, of which those that grow have records."""
        for v in variables:
            self._layout[v.key] = v
            self._blocks.setdefault(v.group, [])
            if v.grows:
                entry = v.dtype, tuple(sizes[d] for d in v.dims[1:])
                self._entries.setdefault(v.group, {})[v.name] = entry

    def append(self, group, record):
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

    def rows(self, group):
        """Number of records of a group."""
        return sum(len(next(iter(block.values()))) for block in self._blocks[group])

    @property
    def nbytes(self):
        """Bytes of all records."""
        return sum(
            values.nbytes
            for blocks in self._blocks.values()
            for block in blocks
            for values in block.values()
        )

    def take(self):
        """Remove all records: group -> name -> array. Raises ValueError for wrong ragged rows."""
        taken = {
            group: {name: _concatenate([b[name] for b in blocks]) for name in blocks[0]}
            for group, blocks in self._blocks.items()
            if blocks
        }
        for group, count in ragged_groups(self._layout).items():
            expected, rows = taken.get(count.group, {}).get(count.name), self.rows(group)
            expected = 0 if expected is None else expected.sum()
            if expected != rows:
                raise ValueError(
                    f"{group} has {rows} rows since the last flush, {count.name} {expected}"
                )
        self._blocks = {group: [] for group in self._blocks}
        return taken

    def put_back(self, taken):
        """Records that `take` removed, before those that have come since."""
        for group, block in taken.items():
            self._blocks[group].insert(0, block)


def _concatenate(blocks):
    """The arrays one after another; a single array is not copied."""
    return blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
