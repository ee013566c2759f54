"""Cells and boxes of files as those of this program, which are tilted along x with z alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.scene import quantities

ROUNDING = 1e-6  # of an edge: files have six digits and more
POSSIBLE = "a cell here has its edges along x, y and z, and may be tilted along x with z (xz)"


def cell(
    vectors: ArrayLike, origin: ArrayLike, ends: Sequence[str] | None = None
) -> dict[str, Any]:
    """room, period and tilt of a cell, as samples.netcdf has them; no_cell: why there is none.

    vectors: its edges a, b, c as rows (3, 3) [m], zero along an axis without one. origin: its lower
    corner (3,) [m]. ends: a word such as pp, ff, fs or ss for each axis, None where they are not
    known.
    """
    vectors = np.array(vectors, float)
    edges, size = np.diag(vectors), np.abs(vectors).max()
    turned = np.abs(np.triu(vectors, 1)).max() > ROUNDING * size or (edges < 0).any()
    if turned:
        text = ", ".join(
            f"{name} = {_format_vector(v)}" for name, v in zip("abc", vectors, strict=True)
        )
        return {"no_cell": f"its cell has the edges {text}; {POSSIBLE}"}
    tilts = {"xy": vectors[1, 0], "xz": vectors[2, 0], "yz": vectors[2, 1]}
    along = {"xy": edges[0], "xz": edges[0], "yz": edges[1]}
    # a tilt by a whole edge is the same lattice as none
    odd = {
        name: tilt
        for name, tilt in tilts.items()
        if abs(tilt - along[name] * np.round(tilt / (along[name] or np.inf))) > ROUNDING * size
    }
    if set(odd) - {"xz"}:
        text = ", ".join(f"{name} = {quantities.format(t, 'length', digits=4)}"
                         for name, t in odd.items())  # fmt: skip
        return {"no_cell": f"its cell is tilted by {text}; {POSSIBLE}"}
    tilt = float(odd.get("xz", 0.0))
    low = np.array(origin, float) + [0.5 * tilt, 0.0, 0.0]  # sheared about its centre
    room = np.stack([low, low + edges], axis=1)
    room[edges == 0] = np.nan
    cell_state: dict[str, Any] = {"tilt": tilt} if tilt else {}
    for axis, word in enumerate(ends or ()):
        for side, letter in enumerate(word):
            if letter not in "pf":
                room[axis, side] = np.nan
    periodic = np.array([word == "pp" for word in ends or ("", "", "")]) & (edges > 0)
    if periodic.any():
        cell_state["period"] = np.where(periodic, edges, np.inf)
    return cell_state | {"room": room.ravel()}


def _format_vector(vector: Iterable[float]) -> str:
    return "(" + ", ".join(f"{1e6 * v:.4g}" for v in vector) + ") µm"


def edges_of(low: ArrayLike, high: ArrayLike, tilts: Sequence[float]) -> NDArray[np.float64]:
    """Edges a, b, c as rows (3, 3) from ends (3,) and the tilts xy, xz, yz."""
    vectors = np.diag(np.array(high, float) - low)
    vectors[1, 0], vectors[2, 0], vectors[2, 1] = tilts
    return vectors
