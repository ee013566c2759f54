"""Sizes of pores: the largest sphere without a grain that a point of the void lies in.

The pore radius of a point is that of the largest sphere that holds it and no part of a grain, of a
wall neither (Gelb & Gubbins 1999). For points at random in the void it is looked for by trial: a
sphere that grows where it goes by ever smaller random steps, and never lets its point out; a point
takes the largest of all spheres so found that it lies in.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.analysis.frame import nearest_image, read_frame
from dusttaichi.errors import DustError

POINTS = 4_000  # of the room, whose pores are looked for
STEPS = 150  # of each search,
FIRST, LAST = 2.0, 0.02  # so far at the beginning and at the end, in mean radii of the grains
RADII = 60
BINS = 24  # of the radii of the grains, where these are not alike
BLOCK = 500  # points at a time
NEAREST = 4  # grains of a bin whose surfaces are looked at


@dataclass(frozen=True)
class Pores:
    """The pores of a snapshot. void: share of the room that is in no grain.

    radius [m]: (RADII,), rising from 0. share: (RADII,), of the void that lies in pores of at least
    that radius. largest [m]: of all that were found.
    """

    void: float
    radius: np.ndarray
    share: np.ndarray
    largest: float

    @property
    def median(self):
        """Radius [m] of the pores that hold half of the void or more."""
        return float(np.interp(-0.5, -self.share, self.radius))


def pores(run, snapshot=-1):
    """The Pores of a snapshot of a Run. Raises DustError where its room is open."""
    return pores_of(read_frame(run, snapshot, contacts=False))


def pores_of(frame, points=POINTS):
    """The Pores of a Frame from so many points of the room.

    Raises DustError where the room is open along an axis.
    """
    if not np.isfinite(frame.edges).all():
        raise DustError("Pores need a room: walls or periodic faces along all axes.")
    if frame.tilt:
        raise DustError("Pores are found in upright cells alone, and this one has been sheared.")
    rng = np.random.default_rng(1)
    x = rng.random((points, 3)) * frame.edges
    x = x[_free(frame, x, walls=False) > 0.0]
    found = _grown(frame, x, rng)
    largest = float(found.max(initial=0.0))
    radius = np.linspace(0.0, largest, RADII)
    share = 1.0 - np.searchsorted(np.sort(found), radius) / max(len(found), 1)
    return Pores(len(x) / points, radius, share, largest)


def _grown(frame, points, rng):
    """Radii of the largest spheres found that hold the points, (P,) [m]."""
    centre = points.copy()
    radius = np.maximum(_free(frame, centre), 0.0)
    for step in np.geomspace(FIRST, LAST, STEPS) * frame.radius.mean():
        trial = centre + step * rng.normal(size=centre.shape)
        free = _free(frame, trial)
        better = (free > radius) & (np.linalg.norm(trial - points, axis=1) <= free)
        centre[better], radius[better] = trial[better], free[better]
    return _shared(frame, points, centre, radius)


def _shared(frame, points, centre, radius):
    """Radii of the largest of all these spheres that each point lies in, (P,) [m]."""
    order = np.argsort(-radius)
    centre, rank, found = centre[order], radius[order], radius.copy()
    for first in range(0, len(points), BLOCK):
        some = slice(first, first + BLOCK)
        apart = nearest_image(points[some, None] - centre, frame.edges, frame.periodic)
        holds = np.einsum("pck,pck->pc", apart, apart) <= rank**2
        held = holds.any(axis=1)
        found[some][held] = rank[holds.argmax(axis=1)[held]]
    return found


def _free(frame, points, walls=True):
    """Distance of points, measured from the room's corner, to the nearest surface [m], (P,); below
    0 inside of a grain. walls: those count as surfaces too."""
    edges, periodic = frame.edges, frame.periodic
    x = frame.position - frame.cell[:, 0]
    box = np.where(periodic, edges, 0.0)
    x, wrapped = (_inside(a, edges, periodic) for a in (x, points))
    found = np.full(len(points), np.inf)
    for group in _alike(frame.radius):
        near = min(NEAREST if np.ptp(frame.radius[group]) else 1, len(group))
        distance, index = scipy.spatial.cKDTree(x[group], boxsize=box).query(
            wrapped, k=[*range(1, near + 1)]
        )
        found = np.minimum(found, (distance - frame.radius[group][index]).min(axis=1))
    if walls and not periodic.all():
        closed = ~periodic
        sides = np.minimum(points[:, closed], (edges - points)[:, closed]).min(axis=1)
        found = np.minimum(found, sides)
    return found


def _inside(x, edges, periodic):
    """Points at their images in the cell."""
    x = np.where(periodic, np.mod(x, edges), x)
    return np.where(periodic & (x >= edges), 0.0, x)  # what rounding has put on the far face


def _alike(radius):
    """Groups of grains (lists of their numbers) whose radii differ little."""
    edges = np.geomspace(radius.min(), radius.max() * (1 + 1e-9), BINS + 1)
    place = np.clip(np.searchsorted(edges, radius, "right") - 1, 0, BINS - 1)
    return [np.flatnonzero(place == n) for n in np.unique(place)]
