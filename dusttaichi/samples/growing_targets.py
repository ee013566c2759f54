"""Targets of many flights that grow by the grains that land on them."""

from collections.abc import Callable
from heapq import heapify, heappop, heappush

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.samples.ballistic import Flights, first_hits, flight_length
from dusttaichi.samples.sample import ROUNDING

RATIO = 4  # of the sizes of two successive search trees, at least


class Targets:
    """Centres that are added in batches, and search trees of geometrically decreasing sizes.

    A tree is joined with the one before it as soon as that is less than RATIO times as large, so
    that building all of them takes N log N.
    """

    def __init__(self, positions: NDArray[np.float64]) -> None:
        self._buffer, self._count = positions.copy(), 0
        self._firsts: list[int] = []
        self._trees: list[scipy.spatial.cKDTree] = []
        self.add(positions)

    @property
    def positions(self) -> NDArray[np.float64]:
        """Centres (N, 3) [m] in the order in which they were added; a view."""
        return self._buffer[: self._count]

    def add(self, positions: NDArray[np.float64]) -> None:
        """Add centres (n, 3) [m]."""
        if len(positions) == 0:
            return
        end = self._count + len(positions)
        if end > len(self._buffer):
            buffer = np.empty((2 * end, 3))
            buffer[: self._count] = self.positions
            self._buffer = buffer
        self._buffer[self._count : end] = positions
        first, self._count = self._count, end
        while self._firsts and first - self._firsts[-1] < RATIO * (end - first):
            first = self._firsts.pop()
            self._trees.pop()
        self._firsts.append(first)
        points = self._buffer[first:end].copy()
        self._trees.append(
            scipy.spatial.cKDTree(points, balanced_tree=False, compact_nodes=len(points) > 10_000)
        )

    def first_hits(
        self,
        starts: NDArray[np.float64],
        directions: NDArray[np.float64],
        distance: float,
        longest: float,
        measure: Flights | None = None,
    ) -> NDArray[np.float64]:
        """Length of flight (M,) [m] until the first hit of each; arguments as of `first_hits`."""
        hits = np.full(len(starts), np.inf)
        for first, tree in zip(self._firsts, self._trees, strict=True):
            of_tree = None if measure is None else _shift_targets(measure, first)
            farthest = np.minimum(hits, longest)
            flights = first_hits(tree, starts, directions, distance, farthest, measure=of_tree)
            hits = np.minimum(hits, flights)
        return hits


def _shift_targets(measure: Flights, first: int) -> Flights:
    return lambda flights, targets, apart: measure(flights, targets + first, apart)


def land_in_order(
    starts: NDArray[np.float64],
    directions: NDArray[np.float64],
    hits: NDArray[np.float64],
    distance: float,
) -> NDArray[np.float64]:
    """Centres (M, 3) [m] of grains that fly one after another, NaN of those that miss.

    hits: lengths of their flights (M,) [m] up to a grain that is there before, inf for none; a
    grain that landed earlier may be nearer.
    """
    flights = np.where(np.isfinite(hits), hits, np.nan)
    landed = starts + flights[:, None] * directions
    rows = np.flatnonzero(np.isfinite(hits))
    if len(rows) == 0:
        return landed
    span = 2.0 * float(np.linalg.norm(starts, axis=1).max()) + distance
    reach, farthest = distance * (1 + ROUNDING), np.minimum(hits, span) + distance
    tree = scipy.spatial.cKDTree(landed[rows])
    nearer = first_hits(tree, starts, directions, reach, farthest, numbers=rows + 1)

    def land_again(row: int) -> NDArray[np.integer]:
        earlier = landed[:row][np.isfinite(landed[:row, 0])]
        apart = earlier - starts[row]
        along = apart @ directions[row]
        across_squared = ((apart - along[:, None] * directions[row]) ** 2).sum(axis=1)
        hit = flight_length(along, across_squared, distance).min(initial=hits[row])
        if hit == hits[row]:
            return np.empty(0, int)
        landed[row] = starts[row] + hit * directions[row]
        apart, later = landed[row] - starts[row + 1 :], directions[row + 1 :]
        along = (apart * later).sum(axis=1)
        across_squared = ((apart - along[:, None] * later) ** 2).sum(axis=1)
        flights = flight_length(along, across_squared, reach)
        return row + 1 + np.flatnonzero(flights < farthest[row + 1 :])

    settle_in_order(np.flatnonzero(np.isfinite(nearer)), land_again)
    return landed


def settle_in_order(
    rows: NDArray[np.integer], settle: Callable[[int], NDArray[np.integer]]
) -> None:
    """Settle rows in their order, each once.

    settle(row): settles a row, and returns later ones, which have to be settled because of it.
    """
    queue, last = rows.tolist(), -1
    heapify(queue)
    while queue:
        if (row := heappop(queue)) != last:
            last = row
            for later in settle(row).tolist():
                heappush(queue, later)
