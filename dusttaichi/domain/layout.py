"""Walls and cell around a sample, by the boundary of the scene."""

import numpy as np

from dusttaichi import units
from dusttaichi.domain.cell import Cell, check_edges, check_images
from dusttaichi.domain.walls import make_box
from dusttaichi.errors import DustError
from dusttaichi.names import AXES, WALLS


def make_walls_and_cell(
    boundary, positions, radius, *, contact, overlap, period=None, room=None, tilt=0.0
):
    """(Box or None, Cell or None) around a sample at rest.

    positions (N, 3), radius, contact (distance of two grains in equilibrium contact), overlap (in
    equilibrium with a wall): um; each but the first one number, or (N,) for unequal grains. With
    `size: fit` the outermost grains are in equilibrium contact with their wall, or with each other
    across the faces. period (3,): edges of a periodic sample. room (6,): positions of the walls and
    faces of the run that a sample is taken from, NaN where there is none; tilt: shift of the image
    above its cell [um]. Raises DustError when the sample does not fit.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    axes = tuple(AXES.index(axis) for axis in boundary.periodic_axes)
    reach = np.reshape(radius - overlap, (-1, 1))
    room_low, room_high = (positions - reach).min(axis=0), (positions + reach).max(axis=0)
    size = room_high - room_low
    wanted = _wanted(boundary)
    if axes:
        if period is not None:
            needed = np.array(period)
        elif not np.ndim(radius):
            needed = high - low + contact
        else:
            # grains at the faces overlap at most as much as the deepest contact in equilibrium
            surface = radius[:, None]
            needed = (positions + surface).max(axis=0) - (positions - surface).min(axis=0)
            needed -= np.min(2.0 * radius - contact)
        size = np.where(np.isin(np.arange(3), axes), needed, size)
        if boundary.size == "cube":
            size = np.where(np.isin(np.arange(3), axes), size[list(axes)].max(), size)
    if wanted is not None:
        wanted = np.where(np.isnan(wanted), size, wanted)
        _check_size(boundary, wanted, size, axes)
        size = wanted
    if room is not None:
        room_low, room_high = _kept(room, room_low, room_high, axes)
        low, high, size = room_low, room_high, room_high - room_low
    _put_planes(boundary, room_low, room_high, size)
    box = make_box(boundary, room_low, room_high, size) if boundary.walls else None
    if not axes:
        return box, None
    periodic = np.isin(np.arange(3), axes)
    check_edges(size[list(axes)], axes, np.max(radius))
    centre = np.where(periodic, 0.5 * (low + high), 0.0)
    cell = Cell(np.where(periodic, size, 0.0), np.zeros(3), np.zeros(3), centre, axes, tilt=tilt)
    if tilt and len(axes) < 3:
        raise DustError(
            "sample.keep: the cell of the other run has been sheared; a cell that is periodic "
            "along x, y and z is needed (boundary: {kind: periodic}), or keep no box"
        )
    if not tilt:  # a sheared cell is reused unchanged
        check_images(positions, cell, radius)
    return box, cell


def _put_planes(boundary, low, high, size):
    """Set ends and sizes (3,) of a box [um] along the axes with prescribed positions of walls."""
    planes = getattr(boundary, "at", None)
    for n, axis in enumerate(AXES):
        ends = None if planes is None else getattr(planes, axis)
        if ends is None:
            continue
        first, last = (end / units.LENGTH for end in ends)
        # as in _check_size, far below any length of a contact
        margin = 1e-9 * (high[n] - low[n])
        if low[n] < first - margin or high[n] > last + margin:
            raise DustError(
                f"boundary.at.{axis}: the sample does not fit: it reaches from {low[n]:.4g} µm to "
                f"{high[n]:.4g} µm along {axis}, the walls are at {first:.4g} µm and {last:.4g} "
                "µm; move them apart"
            )
        low[n], high[n], size[n] = first, last, last - first


def _kept(room, low, high, axes):
    """Lower and upper ends (3,) of the walls and faces in `room`; others at `low` and `high`."""
    open_ = [AXES[n] for n in axes if np.isnan(room[2 * n : 2 * n + 2]).any()]
    if open_:
        raise DustError(
            f"sample.keep: the other run has no faces along {', '.join(open_)}, along which the "
            "cell of this scene is periodic; leave that axis out of boundary.axes, or keep no box"
        )
    ends = np.array(room).reshape(3, 2).T
    low, high = (np.where(np.isnan(k), f, k) for k, f in zip(ends, (low, high), strict=True))
    return low, high


def _wanted(boundary):
    """Prescribed lengths [um], NaN where there is none; None if there are none at all."""
    if boundary.kind == "plates":
        gap = boundary.gap
        return None if gap == "fit" else np.array([np.nan, np.nan, gap / units.LENGTH])
    if boundary.kind == "open" or isinstance(boundary.size, str):
        return None
    size = [np.nan if isinstance(edge, str) else edge for edge in boundary.size]
    return np.array(size) / units.LENGTH


def _check_size(boundary, size, need, axes):
    """Refuse walls inside the sample.

    Across periodic faces the images of the sample may interlock.
    """
    # the need is a sum of rounded numbers; a billionth is far below any length of a contact
    walled = [
        n
        for n in range(3)
        if n not in axes
        and boundary.kind != "periodic"
        or set(WALLS[2 * n : 2 * n + 2]) & set(boundary.walls)
    ]
    short = [n for n in walled if size[n] < need[n] * (1.0 - 1e-9)]
    if short:
        n = short[int(np.argmax(need[short] / size[short]))]
        key = "gap" if boundary.kind == "plates" else "size"
        raise DustError(
            f"boundary.{key}: the sample does not fit: it needs {need[n]:.4g} µm along "
            f"{AXES[n]}, there are {size[n]:.4g} µm; enlarge it or use {key}: fit"
        )
