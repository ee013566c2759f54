"""Files of arrays, which are written and read one by one, with checksums.

A magic line, the raw bytes of the arrays, each from a multiple of ALIGNED bytes on, and JSON: the
StoredArrays and `meta`; its length, and its CRC-32. An array of mostly equal numbers, as the spins
of a sample at rest, may be stored as that number, with the numbers and values of the others.
(safetensors has neither checksums nor metadata other than texts.)
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dusttaichi.results.plain import plain

ALIGNED = 8
ALL = -1  # exceptions of an array whose numbers are all stored
FEW = 0.125  # largest share of exceptions
PROBES = 1024  # numbers of an array that are compared first
_END = 8 + 4  # bytes of the length of the JSON and of its checksum
DAMAGED = "damaged, or of another type"


class StoredArray(NamedTuple):
    """An array in a file: its name, type and shape, `start` of its bytes, and their CRC-32.

    exceptions: number of entries that differ from the others, or ALL.
    """

    name: str
    dtype: str
    shape: list[int]
    exceptions: int
    start: int
    checksum: int

    @property
    def sizes(self) -> list[int]:
        """Bytes of its blocks: all numbers; or the commonest, the numbers of the others, these."""
        size = np.dtype(self.dtype).itemsize
        if self.exceptions == ALL:
            return [size * int(np.prod(self.shape, dtype=np.int64))]
        return [size, np.dtype(np.int64).itemsize * self.exceptions, size * self.exceptions]


class Opened(NamedTuple):
    """An open file, its StoredArrays and its meta data."""

    file: BinaryIO
    listing: list[StoredArray]
    meta: Any


def encode(meta: Any) -> str:
    """JSON of meta data. Raises TypeError where they have what JSON has not."""
    return json.dumps(plain(meta), default=_refuse)


def _refuse(value: Any) -> None:
    raise TypeError(f"meta data cannot hold a {type(value).__name__}")


def yield_blocks(
    magic: bytes,
    arrays: Iterable[tuple[str, NDArray[Any]]],
    meta: str,
    *,
    compact: bool = False,
) -> Iterator[bytes | memoryview]:
    """Yield the bytes of a file in blocks.

    Parameters
    ----------
    magic
        First line of the file.
    arrays
        (name, array) pairs, of any shape and plain type; each array may be freed before the next.
    meta
        From `encode`.
    compact
        Arrays of mostly equal numbers are stored as that number and the others.
    """
    yield magic
    start, listing = len(magic), []
    iterator = iter(arrays)
    while (pair := next(iterator, None)) is not None:
        name, array = pair
        shape, numbers = list(np.shape(array)), np.ascontiguousarray(array).reshape(-1)
        del pair, array  # freed before the next one
        if start % ALIGNED:
            padding = bytes(-start % ALIGNED)
            yield padding
            start += len(padding)
        exceptions, blocks = _compact(numbers) if compact else (ALL, [numbers])
        entry = StoredArray(name, numbers.dtype.str, shape, exceptions, start, 0)
        checksum = 0
        for block in blocks:
            view = block.view(np.uint8).data
            checksum = zlib.crc32(view, checksum)
            yield view
            start += len(view)
        listing.append(entry._replace(checksum=checksum))
        del numbers, blocks, block, view
    text = f'{{"arrays": {json.dumps(listing)}, "meta": {meta}}}'.encode()
    yield text
    yield len(text).to_bytes(8, "little") + zlib.crc32(text).to_bytes(4, "little")


def _compact(a: NDArray[Any]) -> tuple[int, list[NDArray[Any]]]:
    """(number of exceptions or ALL, the arrays that store the numbers (n,), bitwise).

    Those are `a` itself, or its most frequent number, the numbers of the others and these.
    """
    if len(a) < 2 or a.itemsize not in (1, 2, 4, 8):
        return ALL, [a]
    bits = a.view(f"u{a.itemsize}")
    values, counts = np.unique(bits[:: -(-len(a) // PROBES)], return_counts=True)
    if counts.max() < (1.0 - FEW) * counts.sum():
        return ALL, [a]
    commonest = values[[counts.argmax()]]
    exceptional = np.flatnonzero(bits != commonest)
    if len(exceptional) > FEW * len(a):
        return ALL, [a]
    return len(exceptional), [commonest.view(a.dtype), exceptional.astype(np.int64), a[exceptional]]


@contextmanager
def open_arrays(path: str | Path, magic: bytes) -> Iterator[Opened]:
    """An Opened file, for `read_array` and `read_rows`.

    Raises ValueError for another magic line or a damaged list; OSError.
    """
    with open(path, "rb", buffering=0) as file:
        size = os.fstat(file.fileno()).st_size
        if size < len(magic) + _END or file.read(len(magic)) != magic:
            raise ValueError(DAMAGED)
        file.seek(size - _END)
        end = file.read(_END)
        length = int.from_bytes(end[:8], "little")
        if length > size - _END - len(magic):
            raise ValueError(DAMAGED)
        file.seek(size - _END - length)
        text = _read_bytes(file, length).tobytes()
        if zlib.crc32(text) != int.from_bytes(end[8:], "little"):
            raise ValueError(DAMAGED)
        content = json.loads(text)
        listing = [StoredArray(*entry) for entry in content["arrays"]]
        yield Opened(file, listing, content["meta"])


def read_array(file: BinaryIO, stored: StoredArray) -> NDArray[Any]:
    """An array of an open file. Raises ValueError where it is damaged."""
    file.seek(stored.start)
    blocks = [_read_bytes(file, size) for size in stored.sizes]
    checksum = 0
    for block in blocks:
        checksum = zlib.crc32(block.data, checksum)
    if checksum != stored.checksum:
        raise ValueError(DAMAGED)
    if stored.exceptions == ALL:
        return blocks[0].view(stored.dtype).reshape(stored.shape)
    commonest, exceptional, values = blocks
    array = np.full(stored.shape, commonest.view(stored.dtype)[0])
    array.reshape(-1)[exceptional.view(np.int64)] = values.view(stored.dtype)
    return array


def read_rows(file: BinaryIO, stored: StoredArray, low: int, high: int) -> NDArray[Any]:
    """Rows `low` to before `high` of an array that is stored in full; no checksum is compared."""
    row = stored.sizes[0] // max(stored.shape[0], 1)
    file.seek(stored.start + low * row)
    values = _read_bytes(file, (high - low) * row)
    return values.view(stored.dtype).reshape(high - low, *stored.shape[1:])


def _read_bytes(file: BinaryIO, size: int) -> NDArray[np.uint8]:
    """The next bytes of a file, in memory of their own. Raises ValueError where it ends before."""
    buffer = np.empty(size, np.uint8)
    view = buffer.data
    while view:
        if not (count := file.readinto(view)):  # type: ignore[attr-defined]
            raise ValueError(DAMAGED)
        view = view[count:]
    return buffer
