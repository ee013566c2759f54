"""Atoms of LAMMPS and LIGGGHTS as grains: their ids, units without a scale, and image flags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.columns import Table, Units, state
from dusttaichi.samples.formats.names import find_quantity
from dusttaichi.samples.formats.text import Source, is_integer_column, is_text

Unwrapped = tuple[str, Sequence[NDArray[Any]]]  # what they follow from, columns x, y, z
FLAGS = (("ix", "iy", "iz"), ("nx", "ny", "nz"))  # numbers of edges from the image in the file
SAME = 1e-9  # relative difference of positions by rounding
SCALELESS = ("velocity", "spin")  # what units without a scale of time do not give


def grains_of(
    table: Table, source: Source, units: Units, unwrapped: Unwrapped | None = None
) -> dict[str, Any]:
    """Arrays in SI as columns.state.

    unwrapped: (what they follow from, columns) of positions that are not in the cell, or None.
    Where they differ from those of the table by more than one shift of all grains, the state has
    them as `unwrapped`, (N, 3) [m], and their origin as `unwrapped_by`. Raises DustError for an id
    that is there twice.
    """
    _check_ids(table, source)
    state_of_file = state(table, source, units)
    if not units.motion:
        for name in SCALELESS:
            values = state_of_file.pop(name, None)
            if values is not None and values.any():
                state_of_file["unread"].append(f"{name} (lj has no unit of time)")
    if unwrapped is None:
        return state_of_file
    flags = {name for names in FLAGS for name in names}
    state_of_file["unread"] = [
        name for name in state_of_file["unread"] if name.lower() not in flags
    ]
    columns_of_position = [table.meanings.index(("position", axis)) for axis in range(3)]
    values = list(table.values)
    for number, column in zip(columns_of_position, unwrapped[1], strict=True):
        values[number] = column
    positions = state(replace(table, values=values), replace(source, remarks=[]), units)["position"]
    shift = positions - state_of_file["position"]
    if np.ptp(shift, axis=0).max() > SAME * np.abs(positions).max():
        state_of_file |= {"unwrapped": positions, "unwrapped_by": unwrapped[0]}
    return state_of_file


def by_flags(
    names: Sequence[str], values: Sequence[NDArray[Any]], vectors: NDArray[np.float64]
) -> Unwrapped | None:
    """(Names of the flags, columns x, y, z at the images that they name), or None without them.

    names, values: columns with x, y, z in the cell. vectors: edges of the cell as rows (3, 3).
    """
    lower = [name.lower() for name in names]
    flags = next((f for f in FLAGS if all(name in lower for name in f)), None)
    if flags is None or not np.isfinite(vectors).all():
        return None
    turns = [values[lower.index(name)] for name in flags]
    x = [values[lower.index(axis)] for axis in "xyz"]
    if any(map(is_text, x)) or not all(map(is_integer_column, turns)):
        return None
    return " ".join(flags), list((np.column_stack(x) + np.column_stack(turns) @ vectors).T)


def _check_ids(table: Table, source: Source) -> None:
    """Raise DustError for an id that is there twice; 0 is that of atoms without ids."""
    for name, ids in zip(table.names, table.values, strict=True):
        if find_quantity(name) != ("id", None) or is_text(ids) or not ids.any():
            continue
        order = np.argsort(ids, kind="stable")
        twice = np.flatnonzero(np.diff(ids[order]) == 0)
        if len(twice):
            first, second = order[twice[0] : twice[0] + 2]
            raise source.fault(
                f"its {name} {ids[first]:g} is on lines {table.rows[first] + 1} and "
                f"{table.rows[second] + 1}; allowed: each id once (sample.columns with _ in place "
                f"of {name} reads all lines)."
            )
