"""Datasets of xarray that are made and read without dask and pint.

xarray imports both, half a second each, to ask whether an array is one of theirs: where a variable
is made from a plain array, in arithmetic, and where an entry is selected by its label. What every
run does at its end, to read its records and to measure its numbers, asks neither.
"""

from collections.abc import Collection, Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from xarray.indexes import PandasIndex

# attributes of variables that mean to xarray what they mean here; `coordinates` lists coordinates
_PLAIN = {"units", "long_name", "comment", "contact_history", "sample_dimension", "coordinates",
          "_FillValue"}  # fmt: skip
# units of which xarray makes times, as of those `since` a date
_TIMES = {"days", "hours", "minutes", "seconds", "milliseconds", "microseconds", "nanoseconds"}


def is_plain(folder: Any) -> bool:
    """True for an open group whose numbers need no decoding: the conventions of `layout.define`."""
    return all(_is_plain(variable) for variable in folder.variables.values())


def _is_plain(variable: Any) -> bool:
    attributes = set(variable.ncattrs())
    if variable.dtype is not str and variable.dtype.kind not in "fiu":
        return False
    if "_FillValue" in attributes and not np.isnan(variable.getncattr("_FillValue")):
        return False
    units = str(getattr(variable, "units", ""))
    return attributes <= _PLAIN and units not in _TIMES and " since " not in units


def read_group(folder: Any) -> xr.Dataset:
    """The Dataset, in memory, of an open group that `is_plain`."""
    variables: dict[str, xr.Variable] = {}
    names: set[Hashable] = set()
    for name, stored in folder.variables.items():
        stored.set_auto_maskandscale(False)
        attrs = {n: stored.getncattr(n) for n in stored.ncattrs() if n != "_FillValue"}
        names |= set(attrs.pop("coordinates", "").split())
        values = stored[...]
        values = values.astype(str) if stored.dtype is str else np.asarray(values)
        variables[name] = _make_variable(stored.dimensions, values, attrs)
    return _make_dataset(variables, names, {n: folder.getncattr(n) for n in folder.ncattrs()})


def _make_variable(
    dims: Sequence[Hashable], values: NDArray[Any], attributes: Mapping[Any, Any]
) -> xr.Variable:
    return xr.Variable(dims, values, attributes, fastpath=True)


def _make_dataset(
    variables: Mapping[Any, xr.Variable],
    coordinate_names: Collection[Hashable],
    attributes: Mapping[Any, Any],
    indexes: Mapping[Any, Any] | None = None,
) -> xr.Dataset:
    """A Dataset of Variables; those that are named as their only dimension become its indexes."""
    coords = {n: v for n, v in variables.items() if n in coordinate_names or v.dims == (n,)}
    indexes = dict(indexes or {})
    for name, variable in coords.items():
        if variable.dims == (name,) and name not in indexes:
            values = variable.values
            labels = pd.Index(values, dtype=object if values.dtype.kind == "U" else values.dtype)
            indexes[name] = PandasIndex(labels, name, coord_dtype=values.dtype)
    for name, index in indexes.items():
        coords |= index.create_variables({name: coords[name]})
    data = {name: variable for name, variable in variables.items() if name not in coords}
    return xr.Dataset(data, xr.Coordinates(coords, indexes), attributes)


def take_record(data: xr.Dataset, dim: Hashable, number: int) -> xr.Dataset:
    """`data.isel({dim: number})` of a Dataset in memory, for the number of an entry."""
    variables: dict[Hashable, xr.Variable] = {}
    for name, variable in data.variables.items():
        if dim in variable.dims:
            axis = variable.dims.index(dim)
            dims = variable.dims[:axis] + variable.dims[axis + 1 :]
            values = np.asarray(np.take(variable.values, number, axis))
            variables[name] = _make_variable(dims, values, variable.attrs)
        else:
            variables[name] = variable
    indexes = {name: index for name, index in data.xindexes.items() if name != dim}
    return _make_dataset(variables, set(data.coords), data.attrs, indexes)


def take_records(data: xr.Dataset, dim: Hashable, numbers: NDArray[np.integer]) -> xr.Dataset:
    """`data.isel({dim: numbers})`, by a slice where the numbers (n,) follow each other."""
    follow = len(numbers) and np.array_equal(numbers, np.arange(len(numbers)) + numbers[0])
    records = slice(int(numbers[0]), int(numbers[0]) + len(numbers)) if follow else numbers
    return data.isel({dim: records})


def read_at(array: xr.DataArray, **labels: Any) -> NDArray[Any]:
    """`array.sel(labels).values` of a DataArray: the values at these labels of its dimensions.

    Raises KeyError without such a label.
    """
    indexes = array.indexes
    entries = (
        indexes[dim].get_loc(labels[dim]) if dim in labels else slice(None) for dim in array.dims
    )
    values: NDArray[Any] = array.values[tuple(entries)]
    return values
