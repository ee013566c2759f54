"""What surrounds the grains of a simulation: walls and periodic cell, in internal units.

Both are laid out from the scene and the sample, move as the drive of the stage says, and tell where
they are at a time. Times count from the start of the run: a change of drive keeps every place.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.geometry import pairs_within
from dusttaichi.grains.kernels.walls import Walls
from dusttaichi.names import AXES, WALLS
from dusttaichi.physics.contact import constants
from dusttaichi.samples.explicit import CLOSEST

NORMALS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
TOP = WALLS.index("top")


@dataclass(frozen=True)
class Box:
    """Up to six walls; plane of wall n: x.normal = offset + speed t."""

    normal: np.ndarray
    offset: np.ndarray
    speed: np.ndarray
    strength: np.ndarray
    present: np.ndarray

    @cached_property
    def kernel_argument(self):
        return Walls(
            normal=self.normal.tolist(),
            offset=self.offset.tolist(),
            speed=self.speed.tolist(),
            strength=self.strength.tolist(),
        )

    def planes(self, time):
        """Coordinates of the six walls at a time [us]."""
        return (self.offset + self.speed * time) * self.normal.sum(axis=1)

    def driven(self, drive, time):
        """The same walls, moving as `drive` says from `time` on."""
        speed = np.zeros(6)
        if self.present[TOP]:
            speed[TOP] = (drive.wall_speed or 0.0) / units.SPEED
        return replace(self, offset=self.offset + (self.speed - speed) * time, speed=speed)


@dataclass(frozen=True)
class Cell:
    """A periodic cell: edge L(t) = start exp(growth t) + rate t along the periodic axes, centred.

    start [um], rate [um/us], growth [1/us], centre [um]: (3,). Along the other axes start is 0.
    """

    start: np.ndarray
    rate: np.ndarray
    growth: np.ndarray
    centre: np.ndarray
    axes: tuple

    @property
    def rows(self):
        """Contents of the `cell` field (kernels.cell)."""
        return np.array([self.start, self.rate, self.growth, self.centre])

    def edges(self, time):
        """Lengths at a time [um], (3,)."""
        return self.start * np.exp(self.growth * time) + self.rate * time

    def speeds(self, time):
        """Their speeds of growth [um/us], (3,)."""
        return self.growth * self.start * np.exp(self.growth * time) + self.rate

    def low(self, time):
        """Lower faces at a time [um], (3,)."""
        return self.centre - 0.5 * self.edges(time)

    def driven(self, drive, time, material):
        """The same cell, moving as `drive` says from `time` on."""
        periodic = np.isin(np.arange(3), self.axes)
        growth, rate = np.zeros(3), np.zeros(3)
        if drive.compression_rate is not None:
            t_c = constants.characteristic_time(material) / units.TIME
            growth[:] = -2.0 * drive.compression_rate / t_c
        elif drive.strain_rate is not None:
            growth = np.array(drive.strain_rate) * units.TIME
        elif drive.face_speed is not None:
            rate = 2.0 * np.array(drive.face_speed) / units.SPEED
        growth, rate = np.where(periodic, growth, 0.0), np.where(periodic, rate, 0.0)
        now = self.edges(time)
        start = (now - rate * time) * np.exp(-growth * time)
        return replace(self, start=start, rate=rate, growth=growth)


def wall_strengths(boundary):
    """Factor on the springs of each wall, None for one left out; None for a scene without walls."""
    if not boundary.walls:
        return None
    side = boundary.side_walls if boundary.kind == "box" else 1.0
    factors = [side] * 4 + [1.0, 1.0]
    return [f if name in boundary.walls else None for name, f in zip(WALLS, factors, strict=True)]


def glued(wall, boundary):
    """Constants of a wall contact [SI] with the normal force of glued plates."""
    glue = boundary.glue if boundary.kind == "plates" else 1.0
    return replace(wall, F_c=glue * wall.F_c, k_n=glue * wall.k_n)


def make_surroundings(boundary, positions, radius, contact, overlap, period=None):
    """(Box or None, Cell or None) around a sample at rest.

    positions (N, 3), radius, distance of two grains in equilibrium contact, overlap in equilibrium
    with a wall: um; each but the first one number, or (N,) of grains that are not all alike. With
    `size: fit` the outermost grains are in equilibrium contact with their wall, or with each other
    across the faces; a sample that repeats says by what `period`.
    Raises DustError when the sample does not fit.
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
            # grains at the faces overlap no more than the deepest contact in equilibrium
            surface = radius[:, None]
            needed = (positions + surface).max(axis=0) - (positions - surface).min(axis=0)
            needed -= np.min(2.0 * radius - contact)
        size = np.where(np.isin(np.arange(3), axes), needed, size)
        if boundary.size == "cube":
            size = np.where(np.isin(np.arange(3), axes), size[list(axes)].max(), size)
    if wanted is not None:
        wanted = np.where(np.isnan(wanted), size, wanted)
        _check_room(boundary, wanted, size, axes)
        size = wanted
    box = _box(boundary, room_low, room_high, size) if boundary.walls else None
    if not axes:
        return box, None
    periodic = np.isin(np.arange(3), axes)
    _check_edges(size[list(axes)], axes, np.max(radius))
    centre = np.where(periodic, 0.5 * (low + high), 0.0)
    cell = Cell(np.where(periodic, size, 0.0), np.zeros(3), np.zeros(3), centre, axes)
    _check_images(positions, cell, radius)
    return box, cell


def _wanted(boundary):
    """Lengths that the scene gives [um], NaN where it gives none; None if it gives none at all."""
    if boundary.kind == "plates":
        gap = boundary.gap
        return None if gap == "fit" else np.array([np.nan, np.nan, gap / units.LENGTH])
    if boundary.kind == "open" or isinstance(boundary.size, str):
        return None
    return np.array(boundary.size) / units.LENGTH


def _check_room(boundary, size, need, axes):
    """Walls must stand outside the sample. (Across periodic faces its images may interlock.)"""
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
            f"boundary.{key}: the sample does not fit: it needs {need[n]:.4g} um along "
            f"{AXES[n]}, there are {size[n]:.4g} um; enlarge it or use {key}: fit"
        )


def _check_images(positions, cell, radius):
    """Grains must not lie in the images of others."""
    far = 1e6 * np.max(radius) + np.ptp(positions, axis=0).max()
    edges = np.where(cell.start > 0.0, cell.start, far)
    inside = np.mod(positions - cell.low(0.0), edges)
    inside[inside >= edges] = 0.0  # what rounding has put on the upper face
    if np.ndim(radius):
        nearest = pairs_within(inside, radius, CLOSEST, edges)[2].min(initial=np.inf)
        allowed = np.inf
    else:
        nearest = cKDTree(inside, boxsize=edges).query(inside, k=2)[0][:, 1].min()
        allowed = CLOSEST * 2.0 * radius
    if nearest < allowed:
        raise DustError(
            "boundary.size: the periodic cell is too small: grains of the sample overlap with "
            f"images of others (centres {nearest:.4g} um apart); enlarge it or use size: fit"
        )


def _check_edges(edges, axes, radius):
    n = int(np.argmin(edges))
    if edges[n] < 4.0 * radius:
        raise DustError(
            f"boundary: the periodic edge along {AXES[axes[n]]} is {edges[n]:.4g} um, shorter than "
            f"four radii ({4.0 * radius:.4g} um): a grain would touch another twice, across both "
            "faces; take a larger sample or boundary.size, or leave this axis out of boundary.axes"
        )


def _box(boundary, low, high, size):
    """Walls around the room: centred between the side walls, standing on the bottom."""
    slack = size - (high - low)
    low = low - np.array([0.5, 0.5, 0.0]) * slack
    high = low + size
    present = np.array([name in boundary.walls for name in WALLS], dtype=np.int32)
    strength = np.array([factor or 0.0 for factor in wall_strengths(boundary)])
    offset = np.array([low[0], -high[0], low[1], -high[1], low[2], -high[2]])
    return Box(NORMALS, offset, np.zeros(6), strength, present)
