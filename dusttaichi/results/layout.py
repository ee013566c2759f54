"""The NetCDF file of a table of variables: its definition, its records, copies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import netCDF4
import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results.files import WorkFile
from dusttaichi.results.integrity import (
    DIGEST,
    FILL,
    digest_of,
    open_result,
    read_block,
    record_counts,
    rows_of_block,
)
from dusttaichi.results.variables import Variable, record_dimension

Layout = Mapping[str, Variable]  # by key
# group -> its records in blocks, one after the other, name -> array each
Rows = dict[str, list[dict[str, NDArray[Any]]]]


class Contents(NamedTuple):
    """Contents of a file beside its records.

    layout: key -> Variable. sizes: name -> length of a dimension, or the names of its entries.
    static: key -> values that do not grow. attributes: the global ones. records: group -> number.
    """

    layout: dict[str, Variable]
    sizes: dict[str, Any]
    static: dict[str, Any]
    attributes: dict[str, Any]
    records: dict[str, int]


SOURCE = "Definition: "
CACHE, CACHED = 2**20, 101  # bytes of chunks that HDF5 has in memory, and their largest number
CHUNK = 8192  # largest number of entries of a chunk along an axis
OVERHEAD = 20_000_000  # bytes of a file beside its records: tables, partly filled chunks


def folder_of(file: Any, group: str) -> Any:
    return file if group == "series" else file[group]


def open_for_records(file: Any, group: str, name: str) -> Any:
    """A variable of an open file, with a small cache, to write records one after the other.

    By default HDF5 has up to 64 MB of each variable in memory until it closes the file.
    """
    variable = folder_of(file, group)[name]
    variable.set_var_chunk_cache(CACHE, CACHED, 1.0)
    return variable


def ragged_groups(layout: Layout) -> dict[str, Variable]:
    """Ragged groups -> the Variable with the number of rows of each record."""
    dimension = {record_dimension(v.group): v.group for v in layout.values()}
    return {dimension[v.counts]: v for v in layout.values() if v.counts}


def _chunks(variable: Variable, sizes: Mapping[str, Any], ragged: bool) -> tuple[int, ...]:
    """Shape of a chunk of some 64 kB, so that few are touched by an append and little is empty.

    At most CHUNK entries along an axis.
    """
    shape = [min(max(sizes[d], 1), CHUNK) for d in variable.dims[1:]]
    if ragged:
        return min(max(sizes.get("grain", 0), 256), CHUNK), *shape
    row = 8 * math.prod(sizes[d] for d in variable.dims[1:])
    return min(max(65536 // row, 1), 512) if row else 512, *shape


def define(
    file: Any, layout: Layout, dimensions: Mapping[str, Any], static: Mapping[str, Any]
) -> None:
    """Define dimensions, variables with attributes, and static values in an empty file.

    dimensions: name -> length, or the names of the entries.
    """
    growing = {record_dimension(v.group) for v in layout.values()}
    sizes = {}
    for name in sorted({d for v in layout.values() for d in v.dims} - growing):
        entries = dimensions[name]
        sizes[name] = entries if isinstance(entries, int) else len(entries)
        file.createDimension(name, sizes[name])
        if not isinstance(entries, int):
            labels = file.createVariable(name, str, (name,))
            labels.long_name = "name of the " + {"xyz": "axis"}.get(name, name)
            labels[:] = np.array(entries, dtype=object)
    ragged = ragged_groups(layout)
    for group in dict.fromkeys(v.group for v in layout.values()):
        folder = file if group == "series" else file.createGroup(group)
        folder.createDimension(record_dimension(group), None)
        for variable in (v for v in layout.values() if v.group == group):
            _define_variable(folder, variable, sizes, group in ragged)
    for key, values in static.items():
        file[key][:] = values


def _define_variable(
    folder: Any, variable: Variable, sizes: Mapping[str, Any], ragged: bool
) -> None:
    options: dict[str, Any] = {
        "fletcher32": True,
        "fill_value": FILL.get(variable.dtype),
    }  # integrity.py
    if variable.grows:
        options["chunksizes"] = _chunks(variable, sizes, ragged)
    netcdf_variable = folder.createVariable(variable.name, variable.dtype, variable.dims, **options)
    netcdf_variable.units, netcdf_variable.long_name = variable.units, variable.long_name
    if variable.history:
        netcdf_variable.contact_history = "moves with its grains"
    if variable.source:
        netcdf_variable.comment = f"{SOURCE}{variable.source}"
    if variable.group != "series" and not ragged and variable.grows:
        coordinate_names = (f"{record_dimension(variable.group)}_time", "step")
        if variable.name not in coordinate_names:
            netcdf_variable.coordinates = " ".join(
                (*coordinate_names, *(["bin_height"] if "bin" in variable.dims else []))
            )
    if variable.counts:
        netcdf_variable.sample_dimension = variable.counts


def yield_file_blocks(
    layout: Layout,
    dimensions: Mapping[str, Any],
    static: Mapping[str, Any],
    rows: Rows,
    attributes: Mapping[str, Any],
    *,
    result_path: str | Path,
) -> Iterator[memoryview]:
    """Yield the bytes of a file, made in memory, in blocks.

    rows: the records. layout, dimensions, static: as in `define`. result_path: as of WorkFile.
    Raises OSError or RuntimeError for lack of memory.
    """
    size = count_bytes(rows)
    size += sum(np.asarray(values).nbytes for values in static.values())
    with WorkFile(result_path, 2 * size + OVERHEAD) as work:
        with netCDF4.Dataset(work.path, "w", format="NETCDF4") as file:
            work.hide()
            define(file, layout, dimensions, static)
            write_attributes(file, attributes)
            write_rows(file, rows)
        yield from work.blocks()


def count_bytes(rows: Rows) -> int:
    """Bytes of all records."""
    return sum(a.nbytes for blocks in rows.values() for block in blocks for a in block.values())


def write_rows(file: Any, rows: Rows, starts: Mapping[str, int] | None = None) -> None:
    """Write records into an open file. starts: group -> number of the first one, 0 by default."""
    file.set_auto_maskandscale(False)
    for group, blocks in rows.items():
        first = (starts or {}).get(group, 0)
        for name in blocks[0] if blocks else ():
            variable, begin = open_for_records(file, group, name), first
            for block in blocks:
                end = begin + len(block[name])
                variable[begin:end] = block[name]
                begin = end


def read_records(path: str | Path, layout: Layout, counts: Mapping[str, int]) -> Rows:
    """The first `counts` records of each group of a file.

    Raises DustError where it cannot be read.
    """
    records: Rows = {}
    with readable(path), open_result(path) as file:
        file.set_auto_maskandscale(False)
        for variable in (v for v in layout.values() if v.grows and counts.get(v.group)):
            values = folder_of(file, variable.group)[variable.name][: counts[variable.group]]
            records.setdefault(variable.group, [{}])[0][variable.name] = values
    return records


def describe(path: str | Path) -> Contents:
    """Layout, dimensions, static values, attributes and records of the file at `path`.

    Raises DustError where it cannot be read.
    """
    with readable(path), open_result(path) as file:
        file.set_auto_mask(False)
        lengths = {n: len(d) for n, d in file.dimensions.items() if not d.isunlimited()}
        sizes = {n: tuple(file[n][:]) if n in file.variables else s for n, s in lengths.items()}
        present = {"series": file, **file.groups}
        layout = {
            v.key: v
            for group, folder in present.items()
            for v in _variables(group, folder)
            if group != "series" or v.name not in sizes
        }
        static = {k: file[k][:] for k, v in layout.items() if not v.grows}
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
        records = record_counts(file)
    return Contents(layout, sizes, static, attributes, records)


@contextmanager
def readable(path: str | Path) -> Iterator[None]:
    """Context in which a result is read; DustError where that fails."""
    try:
        yield
    except (OSError, RuntimeError, KeyError, ValueError, AttributeError) as error:
        raise DustError(
            f"{path} is not a result of dusttaichi that can be read: {error}."
        ) from error


def write_attributes(file: Any, attributes: Mapping[str, Any]) -> None:
    """Set the global attributes of an open file, and its digest."""
    for name, value in attributes.items():
        if isinstance(value, str):  # setncattr would limit them to 64 kB
            file.setncattr_string(name, value)
        else:
            file.setncattr(name, value)
    file.setncattr_string(DIGEST, digest_of(file))


def _variables(group: str, folder: Any) -> Iterator[Variable]:
    for name, variable in folder.variables.items():
        yield Variable(
            group,
            name,
            variable.dimensions,
            getattr(variable, "units", "1"),
            getattr(variable, "long_name", name),
            getattr(variable, "comment", "").removeprefix(SOURCE),
            "f8" if variable.dtype is str else variable.dtype.str[1:],
            counts=getattr(variable, "sample_dimension", ""),
            history=hasattr(variable, "contact_history"),
        )


def copy_records(
    source_file: Any, target_file: Any, layout: Layout, records: Mapping[str, int]
) -> None:
    """The first `records` of each group from one open file to a new one.

    Raises RuntimeError, DamagedFile.
    """
    path = source_file.filepath()
    for file in (source_file, target_file):
        file.set_auto_maskandscale(False)
    for variable in (v for v in layout.values() if v.grows):
        if (count := records.get(variable.group, 0)) == 0:
            continue  # the old file may not even have the group
        source = folder_of(source_file, variable.group)[variable.name]
        target = open_for_records(target_file, variable.group, variable.name)
        rows = rows_of_block(source)
        for start in range(0, count, rows):
            end = min(start + rows, count)
            target[start:end] = read_block(source, start, end, path)
