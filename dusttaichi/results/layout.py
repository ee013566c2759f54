"""The NetCDF file that the table of variables describes: made, read back, and cut."""

import math

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.results.seal import DIGEST, SEALED, opened
from dusttaichi.results.variables import Variable, record_dimension

SOURCE = "Definition: "


def folder_of(file, group):
    return file if group == "series" else file[group]


def ragged_groups(layout):
    """Ragged groups -> the Variable that says how many of their rows belong to each record."""
    dimension = {record_dimension(v.group): v.group for v in layout.values()}
    return {dimension[v.counts]: v for v in layout.values() if v.counts}


def chunk_rows(variable, sizes, ragged):
    """Records a chunk: some 64 kB, so that appending touches few chunks and little is empty."""
    if ragged:
        return min(max(sizes.get("grain", 0), 256), 65536)
    row = 8 * math.prod(sizes[d] for d in variable.dims[1:])
    return min(max(65536 // row, 1), 512) if row else 512


def define(file, layout, dimensions, static, checked=True):
    """Dimensions, variables with their attributes, and what does not grow, in an empty file.

    dimensions: name -> length, or the names of the entries. checked: each chunk has a sum of its
    own, for files that become too large to be looked at whole (seal.py).
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
            _define_variable(folder, variable, sizes, group in ragged, checked)
    for key, values in static.items():
        file[key][:] = values


def _define_variable(folder, variable, sizes, ragged, checked):
    options = {"fletcher32": checked}  # a damaged chunk is noticed when it is read
    if variable.grows:
        rows = chunk_rows(variable, sizes, ragged)
        shape = (rows, *(sizes[d] for d in variable.dims[1:]))
        options["chunksizes"] = tuple(max(n, 1) for n in shape)
    fill = np.nan if variable.dtype in ("f8", "f4") else None
    new = folder.createVariable(
        variable.name, variable.dtype, variable.dims, fill_value=fill, **options
    )
    new.units, new.long_name = variable.units, variable.long_name
    if variable.source:
        new.comment = f"{SOURCE}{variable.source}"
    if variable.group != "series" and not ragged and variable.grows:
        own = (f"{record_dimension(variable.group)}_time", "step")
        if variable.name not in own:
            new.coordinates = " ".join((*own, *(["bin_height"] if "bin" in variable.dims else [])))
    if variable.counts:
        new.sample_dimension = variable.counts


def describe(path):
    """Layout, dimensions, static values, attributes and records of the file at `path`."""
    try:
        with opened(path) as file:
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
            attributes, records = attributes_of(file), record_counts(file)
    except (OSError, RuntimeError, KeyError, AttributeError) as error:
        raise DustError(f"{path} is not a result of dusttaichi that can be read: {error}.") from (
            error
        )
    return layout, sizes, static, attributes, records


def attributes_of(file):
    """Global attributes of an open file."""
    return {name: file.getncattr(name) for name in file.ncattrs()}


def write_attributes(file, attributes):
    """Set the global attributes of an open file, which is sealed once it is closed; values of None
    are left out."""
    for name, value in {**attributes, DIGEST: SEALED}.items():
        if isinstance(value, str):  # setncattr would limit them to 64 kB
            file.setncattr_string(name, value)
        elif value is not None:
            file.setncattr(name, value)


def record_counts(file):
    """Group of an open file -> how many records it has; groups that grow by no records left out."""
    groups = {"series": file, **file.groups}
    found = {g: folder.dimensions.get(record_dimension(g)) for g, folder in groups.items()}
    return {g: len(dimension) for g, dimension in found.items() if dimension is not None}


def _variables(group, folder):
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
        )


def copy_records(old, new, layout, records, starts=()):
    """The first `records` of each group from one open file to another, in blocks of some 64 MB.

    starts: group -> where they begin in the new file, at 0 by default.
    """
    for file in (old, new):
        file.set_auto_maskandscale(False)
    for variable in (v for v in layout.values() if v.grows):
        if (count := records.get(variable.group, 0)) == 0:
            continue  # the old file may not even have the group
        source = folder_of(old, variable.group)[variable.name]
        target = folder_of(new, variable.group)[variable.name]
        block = max(1, 64_000_000 // (8 * max(math.prod(source.shape[1:]), 1)))
        begin = dict(starts).get(variable.group, 0)
        for start in range(0, count, block):
            end = min(start + block, count)
            target[begin + start : begin + end] = source[start:end]
