"""Walls and cell around the grains of a scene, by its boundary. Internal units."""

import numpy as np
import scipy

from dusttaichi import samples, units
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.walls import make_box
from dusttaichi.errors import DustError
from dusttaichi.physics.contact.constants import CLOSEST
from dusttaichi.physics.geometry import AXES, WALLS, pairs_within
from dusttaichi.physics.near import are_apart


def place_environment(table, sample, overlaps):
    """(Box or None, Cell or None) around the sample of the scene of a ContactTable, at rest.

    overlaps: of each grain in equilibrium with a wall, (N,) or one number of equal grains.
    With `size: fit` the outermost grains are in equilibrium contact with their wall, or with each
    other across the faces. A sample may have a `period` (3,), and from the run that it is of,
    `room` (6,): positions of walls and faces, NaN where there is none, and the `tilt`: shift of the
    image above its cell. Raises DustError for a sample that does not fit.
    """
    scene, positions = table.scene, sample.positions / units.LENGTH
    boundary, equal = scene.boundary, table.properties is None
    radius = (scene.material.radius if equal else table.properties.radius) / units.LENGTH
    contact = 2.0 * radius - table.farthest_pair.rest_overlap / units.LENGTH
    axes = tuple(AXES.index(axis) for axis in boundary.periodic_axes)
    periodic = np.isin(np.arange(3), axes)
    low, high = positions.min(axis=0), positions.max(axis=0)
    reach = np.reshape(radius - overlaps, (-1, 1))
    room_low, room_high = (positions - reach).min(axis=0), (positions + reach).max(axis=0)
    size = room_high - room_low
    if axes:
        size = np.where(periodic, _period(sample, positions, radius, contact), size)
        if boundary.size == "cube":
            size = np.where(periodic, size[list(axes)].max(), size)
    if (prescribed := _find_prescribed_lengths(boundary)) is not None:
        prescribed = np.where(np.isnan(prescribed), size, prescribed)
        _check_size(boundary, prescribed, size, axes)
        size = prescribed
    if (room := sample.info.get("room")) is not None:
        room_low, room_high = _reuse_ends(np.array(room) / units.LENGTH, room_low, room_high, axes)
        low, high, size = room_low, room_high, room_high - room_low
    _put_planes(boundary, room_low, room_high, size)
    box = make_box(boundary, room_low, room_high, size) if scene.has_walls else None
    if not axes:
        return box, None
    _check_edges(size[list(axes)], axes, np.max(radius))
    centre = np.where(periodic, 0.5 * (low + high), 0.0)
    edges, tilt = np.where(periodic, size, 0.0), sample.info.get("tilt", 0.0) / units.LENGTH
    tilted = is_tilted(scene, sample)
    cell = Cell(edges, np.zeros(3), np.zeros(3), centre, axes, tilted=tilted, tilt=tilt)
    if tilt and len(axes) < 3:
        raise DustError(
            "sample.keep: the cell of the other run has been sheared; a cell that is periodic "
            "along x, y and z is needed (boundary: {kind: periodic}), or keep no box"
        )
    if not tilt:  # a sheared cell is reused unchanged
        _check_images(positions, cell, radius)
    return box, cell


def describe_images(scene, sample, cell):
    """The Sample with the measures that it has in a domain.Cell, None without one.

    scene: `scale_materials`. A sample that has been described in this cell is returned as it is.
    """
    if cell is None:
        return sample
    periodic = np.isin(np.arange(3), cell.axes)
    period = np.where(periodic, cell.edges(0.0) * units.LENGTH, np.inf)
    scene_cell = samples.Cell(period, cell.offset(0.0) * units.LENGTH)
    materials = samples.Materials(scene)
    sample_cell = samples.find_cell(sample.info, materials)
    same = np.allclose(sample_cell.period, period) and np.isclose(sample_cell.tilt, scene_cell.tilt)
    if same and "network" in sample.info:
        return sample
    return samples.describe_in_cell(sample, materials.radii_of(sample), scene_cell)


def is_tilted(scene, sample):
    """True where the cell of a scene is sheared in some stage, or its sample brings one along."""
    sheared = any(plan.drive.shear_rate for plan in scene.stage_plans)
    return sheared or bool(sample.info.get("tilt"))


def _period(sample, positions, radius, contact):
    """Edges (3,) with which the grains at the faces are in equilibrium contact.

    contact: distance of two grains in equilibrium contact.
    """
    if (period := sample.info.get("period")) is not None:
        return np.array(period) / units.LENGTH
    if not np.ndim(radius):
        return positions.max(axis=0) - positions.min(axis=0) + contact
    # grains at the faces overlap at most as much as the deepest contact in equilibrium
    surface = radius[:, None]
    extent = (positions + surface).max(axis=0) - (positions - surface).min(axis=0)
    return extent - np.min(2.0 * radius - contact)


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


def _reuse_ends(room, low, high, axes):
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


def _find_prescribed_lengths(boundary):
    """Prescribed lengths [um], NaN where there is none; None if there are none at all."""
    if boundary.kind in ("plates", "tube"):
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
        key = "gap" if boundary.kind in ("plates", "tube") else "size"
        raise DustError(
            f"boundary.{key}: the sample does not fit: it needs {need[n]:.4g} µm along "
            f"{AXES[n]}, there are {size[n]:.4g} µm; enlarge it or use {key}: fit"
        )


def _check_images(positions, cell, radius):
    """Raise DustError where grains overlap too much with images of others.

    positions (N, 3), radius: of all grains, or (N,) [um].
    """
    far = 1e6 * np.max(radius) + np.ptp(positions, axis=0).max()
    edges = np.where(cell.start > 0.0, cell.start, far)
    inside = np.mod(positions - cell.low(0.0), edges)
    inside[inside >= edges] = 0.0  # grains that rounding has put on the upper face
    if np.ndim(radius):
        nearest = pairs_within(inside, radius, CLOSEST, edges)[2].min(initial=np.inf)
        allowed = np.inf
    else:
        allowed = CLOSEST * 2.0 * radius
        if are_apart(inside, allowed, np.where(cell.start > 0.0, edges, np.inf)):
            return
        nearest = scipy.spatial.cKDTree(inside, boxsize=edges).query(inside, k=2)[0][:, 1].min()
    if nearest < allowed:
        raise DustError(
            "boundary.size: the periodic cell is too small: grains of the sample overlap with "
            f"images of others (centres {nearest:.4g} µm apart); enlarge it or use size: fit"
        )


def _check_edges(edges, axes, radius):
    """Raise DustError where an edge [um] is so short that a grain would touch another twice."""
    n = int(np.argmin(edges))
    if edges[n] < 4.0 * radius:
        raise DustError(
            f"boundary: the periodic edge along {AXES[axes[n]]} is {edges[n]:.4g} µm, shorter than "
            f"four radii ({4.0 * radius:.4g} µm): a grain would touch another twice, across both "
            "faces; take a larger sample or boundary.size, or leave this axis out of boundary.axes"
        )
