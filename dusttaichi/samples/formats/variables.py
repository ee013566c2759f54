"""Columns of grains in the variables of a NetCDF file, whose dimensions follow from their names.

A variable has a dimension of grains, one of snapshots if the file has several, and a vector one of
its components, in any order: (grain, xyz), (xyz, grain), (time, grain). Dimensions of other names
are in the order (snapshot, grain, xyz), where the components are three.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.columns import Table, check_lengths
from dusttaichi.samples.formats.names import (
    COMPONENTS,
    DEVIATORS,
    DIMENSIONS,
    FULL_TENSOR,
    STEMS,
    TENSOR,
    TEXTS,
    find_quantity,
    heading,
    unit_factor,
)
from dusttaichi.samples.formats.text import Source
from dusttaichi.samples.sample import check_grains

if TYPE_CHECKING:
    import xarray as xr


SNAPSHOT, GRAIN, COMPONENT = "snapshot", "grain", "component"
_NAMES = {  # without an s of the plural and n_ in front
    SNAPSHOT: "snapshot time frame step timestep record iteration cycle t",
    GRAIN: "grain particle atom point node body id index n npart natom nparticle ngrain",
    COMPONENT: "xyz xz component comp axis dim dimension direction space spatial coord coordinate "
    "cartesian vector tensor three axes",
}
_MEANINGS = {name: axis for axis, names in _NAMES.items() for name in names.split()}
# of the others a dimension may be anything
REQUIRED = ("position", "velocity", "spin", "radius", "diameter", "material")
_EMPTY = ("", "none", "None")


@dataclass(frozen=True)
class Frame:
    """Variables of a file by name, and those that are read elsewhere."""

    variables: Mapping[str, xr.Variable]
    elsewhere: tuple[str, ...]
    source: Source


@dataclass(frozen=True)
class _Column:
    """A variable that is read: quantity, name, unit, and names of the components of a vector."""

    quantity: str
    name: str
    unit: float | None
    components: tuple[str, ...] = ()


def read_columns(frame: Frame) -> tuple[Table, list[str]]:
    """Columns of the snapshot, and the names of the variables that are not read.

    Raises DustError for shapes that are none of grains, texts in place of numbers, units of another
    dimension, and different numbers of grains.
    """
    names: list[str] = []
    values: list[NDArray[Any]] = []
    units: list[float | None] = []
    unread: list[str] = []
    first: tuple[str, NDArray[Any]] | None = None
    for name, variable in sorted(frame.variables.items(), key=_order):
        if name in frame.elsewhere or name in variable.dims:  # the latter are labels
            continue
        column = _column(name, variable, frame.source)
        count = None if first is None else len(first[1])
        array = None if column is None else _array(name, column, frame, count)
        if column is None or array is None:
            unread.append(name)
            continue
        first = first or (name, array)
        _check_length(name, variable, array, first, frame.source)
        if array.ndim > 1:
            names += column.components if array.shape[1] > 2 else column.components[::2]
        else:
            names.append(column.name)
        components = array.T if array.ndim > 1 else [array]
        values += list(components)
        units += [column.unit] * len(components)
    check_lengths(names, units, frame.source)
    return Table(names, values, units=units), unread


def _order(item: tuple[str, xr.Variable]) -> tuple[bool, bool]:
    """Key that sorts positions first, whose number of grains counts, and single numbers last."""
    name, variable = item
    meaning = (find_quantity(name) or ("",))[0]
    return variable.ndim == 0, "position" not in (_vector(name), meaning)


def _vector(name: str) -> str | None:
    """Quantity of the name of a vector or of the tensor, or None."""
    plain = name.strip().lower()
    return "deviator" if plain in DEVIATORS else STEMS.get(plain)


def _axis_of(dim: Hashable) -> str | None:
    """SNAPSHOT, GRAIN or COMPONENT by the name of a dimension, or None."""
    name = re.sub(r"^(?:num|number_of|no|n)_", "", str(dim).lower())
    return _MEANINGS.get(name) or _MEANINGS.get(name.rstrip("s"))


def _column(name: str, variable: xr.Variable, source: Source) -> _Column | None:
    """The _Column of a variable, None for one that is not read."""
    plain, unit = heading(name, source)
    meaning, vector = find_quantity(plain), _vector(plain)
    of_grain = [dim for dim in variable.dims if _axis_of(dim) != SNAPSHOT]
    if vector and meaning:  # r is a radius or a position
        vector = vector if len(of_grain) > 1 and 3 in variable.shape else None
    quantity = vector or (meaning and meaning[0])
    if quantity not in source.contents.quantities:
        return None
    if vector not in (None, "position") and variable.ndim < 2:
        return None
    text = variable.attrs.get("units")
    if text is not None and text not in _EMPTY and quantity in DIMENSIONS:
        origin = f"{source.name}, units of {name}"
        unit = unit_factor(str(text), quantity, origin, source.contents)
    components: tuple[str, ...] = ()
    if vector == "deviator":
        components = TENSOR if len(TENSOR) in variable.shape else FULL_TENSOR
    elif vector:
        components = COMPONENTS.get(vector) or tuple(f"{plain}_{axis}" for axis in "xyz")
    return _Column(quantity, plain, unit, components)


def _array(name: str, column: _Column, frame: Frame, count: int | None) -> NDArray[Any] | None:
    """Values (N,) or (N, components); None for a variable of another shape that may have one."""
    variable, source = frame.variables[name], frame.source
    quantity, size = column.quantity, len(column.components)
    if not variable.ndim and quantity not in TEXTS and count is not None:  # that of all grains
        return np.full(count, read_numbers(variable.values, name, source))
    axes = _axes(name, size, frame)
    if axes is None and size == 3 and source.contents.plane:
        axes = _axes(name, 2, frame)
    if axes is None and quantity not in REQUIRED:
        return None
    if axes is None:
        along = f" along {', '.join(map(str, variable.dims))}" if variable.ndim else ""
        shape = f"(grain, {size})" if size else "(grain,)"
        raise source.fault(
            f"{name} has the shape {variable.shape}{along}; allowed: {shape}, with or without a "
            "dimension for snapshots."
        )
    check_grains(variable.sizes[axes[GRAIN]], source.name)
    if SNAPSHOT in axes:
        snapshots = axes[SNAPSHOT]
        variable = variable.isel({snapshots: source.choose_number(variable.sizes[snapshots])})
    values = variable.transpose(*[axes[n] for n in (GRAIN, COMPONENT) if n in axes]).values
    if quantity in TEXTS and values.dtype.kind in "OSU":
        return np.array([_text(value) for value in values], dtype=object)
    return read_numbers(values, name, source)


def _is_labelled(dim: Hashable, frame: Frame) -> bool:
    """True for a dimension whose labels are names of axes."""
    labels = frame.variables.get(str(dim))
    if labels is None or labels.ndim != 1 or labels.size > 3 or labels.dtype.kind not in "OSU":
        return False
    return {_text(label).lower() for label in labels.values} <= set("xyz")


def _axes(name: str, size: int, frame: Frame) -> dict[str, Hashable] | None:
    """Dimensions of grains, snapshots and `size` components, or None where they are others.

    Adds a remark where either of two dimensions can be that of the components.
    """
    variable = frame.variables[name]
    expected_axes = [GRAIN, COMPONENT] if size else [GRAIN]
    if variable.ndim not in (len(expected_axes), len(expected_axes) + 1):
        return None
    expected_axes = (
        [SNAPSHOT, *expected_axes] if variable.ndim > len(expected_axes) else expected_axes
    )
    axes, unnamed_dimensions = {}, []
    for dim in variable.dims:
        axis = COMPONENT if _is_labelled(dim, frame) else _axis_of(dim)
        if axis == COMPONENT and variable.sizes[dim] != size:
            axis = None
        if axis is None or axis in axes:
            unnamed_dimensions.append(dim)
        elif axis in expected_axes:
            axes[axis] = dim
        else:
            return None
    if size and COMPONENT not in axes:
        fitting = [dim for dim in unnamed_dimensions if variable.sizes[dim] == size]
        if not fitting:
            return None
        if len(fitting) > 1:
            order = ", ".join(map(str, variable.dims))
            frame.source.remarks.append(f"its {name} ({order}) is read as (grain, xyz)")
        axes[COMPONENT] = fitting[-1]
        unnamed_dimensions.remove(fitting[-1])
    return axes | dict(
        zip([axis for axis in expected_axes if axis not in axes], unnamed_dimensions, strict=True)
    )


def _check_length(
    name: str,
    variable: xr.Variable,
    array: NDArray[Any],
    first: tuple[str, NDArray[Any]],
    source: Source,
) -> None:
    """Raise DustError for another number of grains than that of the first variable."""
    if len(array) != len(first[1]):
        size = f", {array.shape[1]}" if array.ndim > 1 else ","
        raise source.fault(
            f"{name} has the shape {variable.shape}; allowed: ({len(first[1])}{size}), as many "
            f"{source.contents.noun} as {first[0]} has."
        )


def read_numbers(values: Any, name: str, source: Source) -> NDArray[np.float64]:
    """Numbers of a variable. Raises DustError for texts."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise source.fault(f"{name} contains texts; allowed: numbers.") from None


def _text(value: object) -> str:
    return value.decode(errors="replace").strip() if isinstance(value, bytes) else str(value)
