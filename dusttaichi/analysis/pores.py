"""Sizes of pores: the largest sphere without a grain that contains a point of the void.

The pore radius of a point is that of the largest sphere that contains it and no part of a grain or
a wall (Gelb & Gubbins 1999). It is searched for random points of the void by trial: a sphere takes
random steps of decreasing length, accepts those that make it larger, and always contains its point.
A point is then assigned the largest of all these spheres that contains it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.analysis.frame import read_frame
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import measure_rows, nearest_image

if TYPE_CHECKING:
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


POINTS = 4_000  # random points of the cell
STEPS = 150  # of each search
FIRST, LAST = 2.0, 0.02  # length of the first and the last step, in mean radii of the grains
RADII = 60
BINS = 24  # of the radii of polydisperse grains
NEAREST = 4  # grains of a bin whose surfaces are examined
BLOCKING = 6  # grains near a sphere that are examined before all others
MARGIN = 1e-9  # of rounding, in mean radii


@dataclass(frozen=True)
class Pores:
    """Pores of a snapshot."""

    void: float  #: Share of the volume outside of grains.
    radius: NDArray[np.float64]  #: [m], (RADII,), rising from 0.
    share: NDArray[np.float64]  #: Share of the void in pores of at least that radius, (RADII,).
    largest: float  #: Radius of the largest pore [m].
    points: int = POINTS  #: Random points of the cell.

    @property
    def void_error(self) -> float:
        """Standard error of `void`, as the points are random."""
        return float(np.sqrt(self.void * (1.0 - self.void) / self.points))

    @property
    def median(self) -> float:
        """Radius [m] such that pores at least as large make up half of the void."""
        return float(np.interp(-0.5, -self.share, self.radius))


def measure_pores(run: Run, snapshot: int = -1) -> Pores:
    """Pore sizes in a snapshot of a run.

    Parameters
    ----------
    run : Run
    snapshot : int

    Raises
    ------
    DustError
        The boundary is open.
    """
    return measure_frame_pores(read_frame(run, snapshot, contacts=False))


def measure_frame_pores(frame: Frame, points: int = POINTS) -> Pores:
    """The Pores of a Frame from that many random points.

    Raises DustError where the boundary is open along an axis, or the cell is sheared.
    """
    if not np.isfinite(frame.edges).all():
        raise DustError("Pores need walls or periodic faces along all axes.")
    if frame.tilt:
        raise DustError("Pores are only found in cells without a tilt, and this one is sheared.")
    rng, surfaces = np.random.default_rng(1), Surfaces(frame)
    x = rng.random((points, 3)) * frame.edges
    x = x[surfaces.distances(x, walls=False) > 0.0]
    pore = _search_pore_radii(frame, surfaces, x, rng)
    largest = float(pore.max(initial=0.0))
    radius = np.linspace(0.0, largest, RADII)
    fraction = 1.0 - np.searchsorted(np.sort(pore), radius) / max(len(pore), 1)
    return Pores(len(x) / points, radius, fraction, largest, points)


def _search_pore_radii(
    frame: Frame, surfaces: Surfaces, points: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Radii of the largest spheres that contain the points, (P,) [m]."""
    centre, mean_radius = points.copy(), frame.radius.mean()
    radius, grain = surfaces.find_nearest(centre)
    radius = np.maximum(radius, 0.0)
    blocking = np.repeat(grain[:, None], BLOCKING, axis=1)  # the last nearest grains
    for number, step in enumerate(np.geomspace(FIRST, LAST, STEPS) * mean_radius):
        trial = centre + step * rng.normal(size=centre.shape)
        moved = measure_rows(trial - points)
        tested = np.arange(len(points))
        for age in range(BLOCKING):  # most trials meet a grain that was near before
            blocker = blocking[tested, (number - 1 - age) % BLOCKING]
            most = surfaces.distances_to(blocker, trial[tested]) + MARGIN * mean_radius
            tested = tested[(most > radius[tested]) & (most >= moved[tested])]
        free, blocking[tested, number % BLOCKING] = surfaces.find_nearest(trial[tested])
        is_better = (free > radius[tested]) & (moved[tested] <= free)
        better = tested[is_better]
        centre[better], radius[better] = trial[better], free[is_better]
    return _enlarge_to_containing_spheres(frame, points, centre, radius)


def _enlarge_to_containing_spheres(
    frame: Frame,
    points: NDArray[np.float64],
    centre: NDArray[np.float64],
    radius: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Radii of the largest of all these spheres that contains each point, (P,) [m]."""
    tree = scipy.spatial.cKDTree(points, boxsize=np.where(frame.periodic, frame.edges, 0.0))
    centre, result = wrap_into_cell(centre, frame.edges, frame.periodic), radius.copy()
    for sphere in np.argsort(radius):  # the largest comes last
        result[tree.query_ball_point(centre[sphere], radius[sphere])] = radius[sphere]
    return result


class Surfaces:
    """Surfaces of the grains of a Frame and of its walls; trees of the grains are made once."""

    def __init__(self, frame: Frame) -> None:
        self._edges, self._periodic, self._radius = frame.edges, frame.periodic, frame.radius
        self._x = x = wrap_into_cell(frame.position - frame.cell[:, 0], frame.edges, frame.periodic)
        box = np.where(frame.periodic, frame.edges, 0.0)
        self._trees = []
        for group in _group_similar_radii(frame.radius):
            radius = frame.radius[group]
            near = min(NEAREST if np.ptp(radius) else 1, len(group))
            tree = scipy.spatial.cKDTree(
                x[group], boxsize=box, balanced_tree=False, compact_nodes=False
            )
            self._trees.append((tree, group, [*range(1, near + 1)]))

    def distances(self, points: NDArray[np.float64], walls: bool = True) -> NDArray[np.float64]:
        """Distance of points to the nearest surface [m], (P,), below 0 inside of a grain.

        points: (P, 3), from the corner of the cell. walls: whether they count as surfaces.
        """
        return self.find_nearest(points, walls)[0]

    def find_nearest(
        self, points: NDArray[np.float64], walls: bool = True
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """(`distances` of points, numbers of the grains that are nearest to them)."""
        edges, closed = self._edges, ~self._periodic
        wrapped = wrap_into_cell(points, edges, self._periodic)
        nearest, grain = np.full(len(points), np.inf), np.zeros(len(points), int)
        for tree, group, neighbours in self._trees:
            distance, index = tree.query(wrapped, k=neighbours)
            index = group[index]
            distance -= self._radius[index]
            column = distance.argmin(axis=1)[:, None]
            distance, index = (
                np.take_along_axis(a, column, axis=1)[:, 0] for a in (distance, index)
            )
            grain = np.where(distance < nearest, index, grain)
            nearest = np.minimum(nearest, distance)
        if walls and closed.any():
            sides = np.minimum(points[:, closed], (edges - points)[:, closed]).min(axis=1)
            nearest = np.minimum(nearest, sides)
        return nearest, grain

    def distances_to(
        self, grains: NDArray[np.int64], points: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Distance of each point (P, 3) to the surface of its grain [m], (P,)."""
        period = np.where(self._periodic, self._edges, np.inf)
        apart = nearest_image(points - self._x[grains], period)
        gaps: NDArray[np.float64] = measure_rows(apart) - self._radius[grains]
        return gaps


def wrap_into_cell(
    x: NDArray[np.float64], edges: NDArray[np.float64], periodic: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Points at their images in the cell."""
    x = np.where(periodic, np.mod(x, edges), x)
    return np.where(periodic & (x >= edges), 0.0, x)  # rounded to the far face


def _group_similar_radii(radius: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Groups of grains (lists of their numbers) whose radii differ little."""
    edges = np.geomspace(radius.min(), radius.max() * (1 + 1e-9), BINS + 1)
    bin_of_grain = np.clip(np.searchsorted(edges, radius, "right") - 1, 0, BINS - 1)
    return [np.flatnonzero(bin_of_grain == n) for n in np.flatnonzero(np.bincount(bin_of_grain))]
