"""The NetCDF file that the table of variables describes: made, read back, and cut."""

import math

import netCDF4
import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.names import EXTRA_CHANNELS
from dusttaichi.results.variables import LABELS, RAGGED, RECORDS, VARIABLES


def folder_of(file, group):
    return file if group == "series" else file[group]


def chunk_rows(variable, sizes):
    """Records a chunk: some 64 kB, so that appending touches few chunks and little is empty."""
    if variable.group in RAGGED:
        return min(max(sizes.get("grain", 0), 256), 65536)
    row = 8 * math.prod(sizes[d] for d in variable.dims[1:])
    return min(max(65536 // row, 1), 512) if row else 512


def define(file, layout, sizes, static):
    """Dimensions, variables with their attributes, and what does not grow, in an empty file."""
    used = {d for v in layout.values() for d in v.dims} - set(RECORDS.values())
    for name in sorted(used):
        file.createDimension(name, sizes[name])
        if name in LABELS:
            labels = file.createVariable(name, str, (name,))
            labels.long_name = "name of the " + {"xyz": "axis"}.get(name, name)
            known = LABELS[name] + (EXTRA_CHANNELS if name == "channel" else ())
            labels[:] = np.array(known[: sizes[name]], dtype=object)
    for group in dict.fromkeys(v.group for v in layout.values()):
        folder = file if group == "series" else file.createGroup(group)
        folder.createDimension(RECORDS[group], None)
        for variable in (v for v in layout.values() if v.group == group):
            _define_variable(folder, variable, sizes)
    for key, values in static.items():
        file[key][:] = values


def _define_variable(folder, variable, sizes):
    options = {}
    if variable.grows:
        rows = chunk_rows(variable, sizes)
        shape = (rows, *(sizes[d] for d in variable.dims[1:]))
        options["chunksizes"] = tuple(max(n, 1) for n in shape)
        # only where a chunk is one whole record: a compressed chunk that a later flush fills
        # further moves, and leaves its old place unused
        if rows == 1:
            options |= {"compression": "zlib", "complevel": 1, "shuffle": True}
    fill = np.nan if variable.dtype == "f8" else None
    new = folder.createVariable(
        variable.name, variable.dtype, variable.dims, fill_value=fill, **options
    )
    new.units, new.long_name = variable.units, variable.long_name
    if variable.source:
        new.comment = f"Definition: {variable.source}"
    auxiliary = {"profiles": "profile_time step", "snapshots": "snapshot_time step"}
    names = auxiliary.get(variable.group, "")
    if names and variable.grows and variable.name not in names:
        new.coordinates = names + (" bin_height" if "bin" in variable.dims else "")
    if variable.name in RAGGED.values():
        new.sample_dimension = "contact" if variable.name == "contact_count" else "wall_contact"


def describe(path):
    """Layout, sizes, static values, attributes and records of the file at `path`."""
    try:
        with netCDF4.Dataset(path) as file:
            file.set_auto_mask(False)
            present = {g: folder_of(file, g) for g in RECORDS if g == "series" or g in file.groups}
            layout = {
                k: v
                for k, v in VARIABLES.items()
                if v.group in present and v.name in present[v.group].variables
            }
            sizes = {name: len(d) for name, d in file.dimensions.items() if not d.isunlimited()}
            static = {k: file[k][:] for k, v in layout.items() if not v.grows}
            attributes = {name: file.getncattr(name) for name in file.ncattrs()}
            records = {g: len(folder.dimensions[RECORDS[g]]) for g, folder in present.items()}
    except (OSError, RuntimeError, KeyError, AttributeError) as error:
        raise DustError(f"{path} is not a result of dusttaichi that can be read: {error}.") from (
            error
        )
    return layout, sizes, static, attributes, records


def copy_records(old, new, layout, records):
    """The first `records` of each group from one open file to another, in blocks of some 64 MB."""
    for file in (old, new):
        file.set_auto_maskandscale(False)
    for variable in (v for v in layout.values() if v.grows):
        source = folder_of(old, variable.group)[variable.name]
        target = folder_of(new, variable.group)[variable.name]
        count = records[variable.group]
        block = max(1, 64_000_000 // (8 * max(math.prod(source.shape[1:]), 1)))
        for start in range(0, count, block):
            target[start : min(start + block, count)] = source[start : min(start + block, count)]
