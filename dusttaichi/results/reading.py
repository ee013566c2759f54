"""A result as one xr.DataTree, also of a running run with several files."""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray, NetCDF4DataStore
from xarray.core import indexing

from dusttaichi.results import datasets, locks
from dusttaichi.results.files import is_segment
from dusttaichi.results.integrity import open_result, refusal
from dusttaichi.results.layout import define, describe, folder_of, write_attributes
from dusttaichi.results.pieces import OWN, pieces_of
from dusttaichi.results.segments import describe as describe_segment
from dusttaichi.results.segments import open_segment
from dusttaichi.results.variables import record_dimension

if TYPE_CHECKING:
    from dusttaichi.results.pieces import Piece


Read = TypeVar("Read")  # what a function reads of a result
ATTEMPTS = 3  # while a run joins its parts
SMALL = 64  # largest number of entries of a record for which a variable is read at once


def open_tree(path: str | Path) -> xr.DataTree:
    """The result at `path`, whose large variables are read when used.

    Raises as `integrity.open_netcdf`; RuntimeError, ValueError or KeyError for other contents.
    """
    return _retry_reading(_open, path)


def load_groups(path: str | Path, *names: str) -> dict[str, xr.Dataset]:
    """The groups of the result at `path` that it has, by name ("series" is the root), in memory.

    Raises as `open_tree`.
    """
    return _retry_reading(_load, path, names)


def load_variable(path: str | Path, group: str, name: str) -> NDArray[Any]:
    """Values of a variable of a group that grows, of all its records; empty without the group.

    Raises as `open_tree`.
    """
    return _retry_reading(_load_variable, path, group, name)


def _retry_reading(read: Callable[..., Read], path: str | Path, *arguments: Any) -> Read:
    """Read a result by a function, also where its parts are just being joined."""
    for _ in range(ATTEMPTS):
        try:
            return read(path, *arguments)
        except FileNotFoundError:
            if not Path(path).exists():
                raise
    return read(path, *arguments)


def _load(path: str | Path, names: Iterable[str]) -> dict[str, xr.Dataset]:
    """Groups of a result; FileNotFoundError where its parts have just been joined."""
    with open_result(path) as file:
        if len(pieces_of(path)) == 1:
            folders = {"series": file, **file.groups}
            return {name: _load_group(folders[name]) for name in names if name in folders}
    with _open(path) as tree:
        nodes = {"series": tree, **tree.children}
        return {n: nodes[n].to_dataset(inherit=False).load() for n in names if n in nodes}


def _load_variable(path: str | Path, group: str, name: str) -> NDArray[Any]:
    blocks = [np.zeros(0)]
    for piece in pieces_of(path):
        count = piece.ends.get(group, 0) - piece.starts.get(group, 0)
        if count > 0:
            with _open_piece(piece.path) as read:
                blocks.append(read(group, name, 0, count))
    return np.concatenate(blocks[1:] or blocks)


@contextmanager
def _open_piece(path: Path) -> Iterator[Callable[..., NDArray[Any]]]:
    """A function that reads a file of a result: of a group, of a variable, records from, to.

    Further arguments: entries of the further axes.
    """
    if is_segment(path):
        with open_segment(path) as segment:
            yield lambda group, name, low, high, *entries: segment.read(group, name, low, high)[
                (slice(None), *entries)
            ]
        return
    with open_result(path) as file:
        file.set_auto_maskandscale(False)
        yield lambda group, name, low, high, *entries: folder_of(file, group)[name][
            (slice(low, high), *entries)
        ]


def _load_group(folder: Any) -> xr.Dataset:
    """The Dataset of an open group, in memory."""
    if datasets.is_plain(folder):
        return datasets.read_group(folder)
    return xr.open_dataset(cast(Any, NetCDF4DataStore)(folder)).load()  # of another program


def _open(path: str | Path) -> xr.DataTree:
    """The tree of a result; FileNotFoundError where its parts have just been joined."""
    pieces = pieces_of(path)
    if len(pieces) == 1:
        return _open_file(path)
    groups = _describe_groups(path, pieces[-1])
    joined_groups = {name: _whole(name, data, pieces) for name, data in groups.items()}
    joined_groups["/"].attrs = {k: v for k, v in joined_groups["/"].attrs.items() if k not in OWN}
    return xr.DataTree.from_dict(joined_groups)


def _describe_groups(path: str | Path, last: Piece) -> dict[str, xr.Dataset]:
    """Groups of a result by path, with the attributes of its last segment, without records."""
    layout, sizes, _, attributes, _ = describe_segment(last.path)
    with netCDF4.Dataset("segment", "w", format="NETCDF4", diskless=True) as file:
        define(file, layout, sizes, describe(path).static)
        write_attributes(file, attributes)
        folders = {"/": file} | {f"/{name}": folder for name, folder in file.groups.items()}
        return {name: datasets.read_group(folder) for name, folder in folders.items()}


def _open_file(path: str | Path) -> xr.DataTree:
    """The tree of a verified file, whose variables are read when used."""
    try:
        with locks.reading(path):
            groups, close = datasets.open_groups(path)
            if groups:
                tree: xr.DataTree = xr.DataTree.from_dict(groups)
                tree.set_close(close)
                return tree
            return xr.open_datatree(path, engine="netcdf4")
    except OSError as error:
        reason = refusal(error, path)
        if reason is None:
            raise
        raise reason from error


def _whole(path: str, last: xr.Dataset, pieces: Sequence[Piece]) -> xr.Dataset:
    """The Dataset of a group of all pieces, from that of the last one."""
    group = path.strip("/") or "series"
    grown = record_dimension(group)
    names = [str(name) for name, v in last.variables.items() if v.dims[:1] == (grown,)]
    read, lazy = _small(group, names, last, pieces), {}
    for name in names:
        last_variable = last.variables[name]
        data: Any = read.get(name)
        if data is None:
            data = indexing.LazilyIndexedArray(_Joined(pieces, f"{group}/{name}", last_variable))
        lazy[name] = xr.Variable(last_variable.dims, data, last_variable.attrs)
    variables = dict(last.variables) | lazy
    coords = {name: variables.pop(name) for name in last.coords}
    return xr.Dataset(variables, coords, last.attrs)


def _small(
    group: str, names: Iterable[str], last: xr.Dataset, pieces: Sequence[Piece]
) -> dict[str, NDArray[Any]]:
    """Name -> array of the variables with small records, joined over the pieces."""
    small = [n for n in names if math.prod(last.variables[n].shape[1:]) <= SMALL]
    arrays_by_name: dict[str, list[NDArray[Any]]] = {name: [] for name in small}
    for piece in pieces:
        if piece.ends.get(group, 0) == piece.starts.get(group, 0):
            continue
        with _open_piece(piece.path) as read:
            for name in small:
                count = piece.ends[group] - piece.starts[group]
                arrays_by_name[name].append(read(group, name, 0, count))
    return {name: np.concatenate(arrays) for name, arrays in arrays_by_name.items() if arrays}


class _Joined(BackendArray):
    """A variable of all pieces, joined along its first axis; read when indexed."""

    def __init__(self, pieces: Sequence[Piece], key: str, last: Any) -> None:
        group, name = key.rsplit("/", 1)
        self.group, self.name, self.joined = group, name, pieces[0].path
        self.pieces = [p for p in pieces if p.ends.get(group, 0) > p.starts.get(group, 0)]
        self.starts = [p.starts[group] for p in self.pieces]
        self.shape = (self.pieces[-1].ends[group] if self.pieces else 0, *last.shape[1:])
        self.dtype = last.dtype

    def __getitem__(self, key: Any) -> NDArray[Any]:
        basic = indexing.IndexingSupport.BASIC
        values: NDArray[Any] = indexing.explicit_indexing_adapter(
            key, self.shape, basic, self._read
        )
        return values

    def _read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        first, *entries = key
        if not isinstance(first, slice):
            row: NDArray[Any] = self._rows([int(first)], entries)[0]
            return row
        rows = range(*first.indices(self.shape[0]))
        return self._rows(rows, entries)

    def _rows(self, rows: Sequence[int], entries: Sequence[Any]) -> NDArray[Any]:
        """These rows, in rising or falling order, of the entries `rest`."""
        blocks, at = [], [bisect.bisect_right(self.starts, row) - 1 for row in rows]
        for number in dict.fromkeys(at):
            piece_rows = [
                row - self.starts[number] for row, n in zip(rows, at, strict=True) if n == number
            ]
            low, high = min(piece_rows), max(piece_rows) + 1
            block = self._block(number, low, high, entries)
            blocks.append(block[np.array(piece_rows) - low])
        if blocks:
            return np.concatenate(blocks)
        return np.empty((0, *np.empty(self.shape[1:])[tuple(entries)].shape), self.dtype)

    def _block(self, number: int, low: int, high: int, entries: Sequence[Any]) -> NDArray[Any]:
        """Rows of a piece; of the joined file if the parts have been joined since."""
        path = self.pieces[number].path
        if not path.exists():
            path, first = self.joined, self.starts[number]
            low, high = low + first, high + first
        with _open_piece(path) as read:
            return read(self.group, self.name, low, high, *entries)
