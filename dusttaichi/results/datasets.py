"""Datasets of xarray that are made and read without dask and pint.

xarray imports both, half a second each, to ask whether an array is one of theirs: where a variable
is made from a plain array, in arithmetic, where entries are selected by an array or a label, and
where a file is opened. What every run does at its end, to read its records and to measure its
numbers, and the figures and the report of a compression ask neither.
"""

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from typing import Any, cast

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import NetCDF4DataStore
from xarray.core import indexing
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
    return read_variables(_describe_group(*cast(Any, NetCDF4DataStore)(folder).load()))


def open_groups(path: Any) -> tuple[dict[str, xr.Dataset], Callable[[], None]]:
    """Group -> its Dataset ("/" is the root), whose variables are read when used; and what closes.

    No groups where they are not all `is_plain`, as of another program.
    """
    store = cast(Any, NetCDF4DataStore).open(path)
    folders = {"/": store.ds, **store.ds.groups}
    is_nested = any(folder.groups for folder in store.ds.groups.values())
    if is_nested or not all(is_plain(folder) for folder in folders.values()):
        store.close()
        return {}, store.close
    manager, groups = store._manager, {}  # one open file for all groups, as xarray has it
    for name in folders:
        variables, attributes = cast(Any, NetCDF4DataStore)(manager, group=name).load()
        groups[name] = _describe_group(variables, attributes)
    return groups, store.close


def _describe_group(stored: Mapping[str, xr.Variable], attributes: Mapping[Any, Any]) -> xr.Dataset:
    """The Dataset of variables of a store, as `xr.open_dataset` has it."""
    variables: dict[str, xr.Variable] = {}
    names: set[Hashable] = set()
    cache: Any = indexing.MemoryCachedArray  # without types
    for name, variable in stored.items():
        attrs, encoding = dict(variable.attrs), variable.encoding
        encoding |= {key: attrs.pop(key) for key in ("_FillValue", "coordinates") if key in attrs}
        names |= set(encoding.get("coordinates", "").split())
        if variable.dtype.kind == "O":  # names of entries, a few
            data: Any = variable.values.astype(str)
            encoding = {"dtype": data.dtype}
        else:
            data = indexing.CopyOnWriteArray(cache(variable._data))
        variables[name] = _make_variable(variable.dims, data, attrs)
        variables[name].encoding = encoding
    return _make_dataset(variables, names, attributes)


def _make_variable(
    dims: Sequence[Hashable], values: Any, attributes: Mapping[Any, Any]
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
    """`data.isel({dim: number})` of a Dataset, for the number of an entry, which is read."""
    variables = {n: _take_entry(variable, dim, number) for n, variable in data.variables.items()}
    indexes = {name: index for name, index in data.xindexes.items() if name != dim}
    return _make_dataset(variables, set(data.coords), data.attrs, indexes)


def _take_entry(variable: xr.Variable, dim: Hashable, number: int) -> xr.Variable:
    if dim not in variable.dims:
        return variable
    if variable._in_memory:
        values = np.take(variable.values, number, variable.dims.index(dim))
    else:
        values = variable.isel({dim: number}).values
    dims = [name for name in variable.dims if name != dim]
    return _make_variable(dims, np.asarray(values), variable.attrs)


def take_records(data: xr.Dataset, dim: Hashable, numbers: NDArray[np.integer]) -> xr.Dataset:
    """`data.isel({dim: numbers})`, by a slice where the numbers (n,) have equal distances."""
    steps = np.unique(np.diff(numbers))
    if len(numbers) and len(steps) < 2 and (step := int(steps[0]) if len(steps) else 1) > 0:
        records = slice(int(numbers[0]), int(numbers[-1]) + 1, step)
        return data.isel({dim: records})
    return data.isel({dim: numbers})


def read_variables(
    data: xr.Dataset, read: Callable[[xr.Variable], NDArray[Any]] = lambda variable: variable.values
) -> xr.Dataset:
    """`data.load()` as another Dataset; read: values of a variable, (entries of its dimensions)."""
    variables = {n: _make_variable(v.dims, read(v), v.attrs) for n, v in data.variables.items()}
    return _make_dataset(variables, set(data.coords), data.attrs)


def add_variables(data: xr.Dataset, **added: tuple[tuple[str, ...], NDArray[Any]]) -> xr.Dataset:
    """`data.assign(added)`; added: name -> (dimensions, values)."""
    variables: dict[Hashable, xr.Variable] = dict(data.variables)
    variables |= {name: _make_variable(dims, values, {}) for name, (dims, values) in added.items()}
    return _make_dataset(variables, set(data.coords), data.attrs, data.xindexes)


def read_at(array: xr.DataArray, **labels: Any) -> NDArray[Any]:
    """`array.sel(labels).values` of a DataArray: the values at these labels of its dimensions.

    Raises KeyError without such a label.
    """
    indexes = array.indexes
    entries = (
        indexes[dim].get_loc(labels[dim]) if dim in labels else slice(None) for dim in array.dims
    )
    return array.values[tuple(entries)]
