"""Aggregates of many unequal grains: batches of shots, with the result of one after another.

Each shot of a grain is several flights, of which the first in their order that hits is used. They
are computed against the aggregate as it was before the batch, and then, in their order, for grains
of the same batch that landed in the way. A batch ends with a grain that all of its flights miss, as
the grains of later shots are other ones then, and with a grain that lands farther out than any
before, as later flights start from a larger disc then.
"""

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.samples.ballistic import (
    SHOTS,
    Aggregate,
    Flights,
    find_perpendicular,
    first_hits,
    flight_length,
    random_directions,
    random_in_disc,
)
from dusttaichi.samples.growing_targets import Targets, settle_in_order
from dusttaichi.samples.mixture import Grains
from dusttaichi.scene.making import report_progress

FEW = 20_000  # grains that are shot one by one: batches are short before and cost more
BATCH = 1 / 16  # shots of a batch over the grains so far,
LEAST_BATCH, LARGEST_BATCH = 16, 4000  # and their bounds


def grow_unequal(grains: Grains, rng: np.random.Generator) -> np.ndarray:
    """Grow centres (N, 3) [m] by particle-cluster aggregation, about the centre of their volume."""
    few, total = min(FEW, len(grains)), len(grains)
    aggregate = Aggregate(grains.select(slice(0, 1)))
    for k in range(1, few):
        report_progress(k, total)
        aggregate.add(np.zeros((1, 3)), grains.select(slice(k, k + 1)), rng)
    targets = Targets(aggregate.positions)
    outer = _outer(aggregate.positions, grains.radii[:few]).max()
    directions, off = np.empty((0, SHOTS, 3)), np.empty((0, SHOTS, 2))
    shots = LEAST_BATCH
    while (count := len(targets.positions)) < total:
        report_progress(count, total)
        shots = min(max(shots, LEAST_BATCH), LARGEST_BATCH, int(BATCH * count) + 1, total - count)
        fresh = range(shots - len(directions))
        drawn = [(random_directions(rng, SHOTS), random_in_disc(rng, SHOTS)) for _ in fresh]
        directions = np.concatenate([directions, *[vectors[None] for vectors, _ in drawn]])
        off = np.concatenate([off, *[points[None] for _, points in drawn]])
        batch = _Batch(grains, targets, outer, directions[:shots], off[:shots])
        landed = batch.land()
        end = len(landed)
        hit = landed[np.isfinite(landed[:, 0])]
        reach = _outer(hit, grains.radii[count : count + len(hit)])
        records = np.flatnonzero(reach > outer)
        if len(records):
            hit, end = hit[: records[0] + 1], int(records[0]) + 1
            outer = reach[records[0]]
        targets.add(hit)
        shots = 2 * end
        directions, off = directions[end:], off[end:]
    aggregate.positions, aggregate.grains = targets.positions, grains
    return aggregate.centre_positions()


def _outer(x: NDArray[np.float64], radii: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances (N,) of the farthest points of grains from the first grain [m]."""
    values: NDArray[np.float64] = np.sqrt((x**2).sum(axis=1)) + radii
    return values


class _Batch:
    """Shots (T,) of the next grains at targets, T x SHOTS flights.

    outer: farthest point of the targets from the origin [m]; directions (T, SHOTS, 3) and points
    in the unit disc `off` (T, SHOTS, 2) of the flights.
    """

    def __init__(
        self, grains: Grains, targets: Targets, outer: float, directions: Any, off: Any
    ) -> None:
        self._grains, self._targets, self._count = grains, targets, len(targets.positions)
        shots, flat = len(directions), directions.reshape(-1, 3)
        self._directions = directions
        cover = outer + grains.radii[self._count : self._count + shots]
        u, v = (vectors.reshape(directions.shape) for vectors in find_perpendicular(flat))
        self._starts = cover[:, None, None] * (
            off[..., :1] * u + off[..., 1:] * v - 2.0 * directions
        )
        self._hits = np.full((shots, SHOTS), np.inf)
        self._used = np.full(shots, SHOTS - 1)  # the flight that hits, of a miss the last one
        self._distance, self._longest = 2.0 * float(grains.radii.max()), 4.0 * float(cover.max())

    def land(self) -> NDArray[np.float64]:
        """Centres (n, 3) [m] of the first n grains; NaN of the last one if it misses."""
        shots = self._hit_targets()
        landed = np.array([self._find_centre(row) for row in range(shots)])
        rows, flights = np.nonzero(np.arange(SHOTS) <= self._used[:shots, None])
        first = np.searchsorted(rows, np.arange(shots) + 1)  # flight of a later shot
        present = np.flatnonzero(np.isfinite(landed[:, 0]))
        if len(present) == 0:
            return landed
        measure = self._measure(rows, flights, self._count + present)
        hits = np.minimum(self._hits[rows, flights], self._longest)
        starts, directions = self._starts[rows, flights], self._directions[rows, flights]
        tree = scipy.spatial.cKDTree(landed[present])
        nearer = first_hits(
            tree, starts, directions, self._distance, hits, numbers=first[present], measure=measure
        )

        def land_again(row: int) -> NDArray[np.integer]:
            before = landed[row].copy()
            self._hit_one_another(row, landed[:row])
            landed[row] = self._find_centre(row)
            if np.array_equal(before, landed[row]) or np.isnan(landed[row, 0]):
                return np.empty(0, int)
            later = slice(first[row], None)
            measure = self._measure(rows[later], flights[later], np.array([self._count + row]))
            pairs = np.arange(len(rows) - first[row])
            lengths = measure(pairs, np.zeros_like(pairs), landed[row] - starts[later])
            return np.asarray(rows[later][lengths <= hits[later]])

        settle_in_order(np.unique(rows[np.isfinite(nearer)]), land_again)
        return landed

    def _hit_targets(self) -> int:
        """Find the first hits on the targets; the number of shots up to the first miss."""
        pending = np.arange(len(self._hits))
        for n in range(SHOTS):
            if len(pending) == 0:
                return len(self._hits)
            flights = np.full(len(pending), n)
            measure = self._measure(pending, flights, np.arange(self._count))
            self._hits[pending, n] = self._targets.first_hits(
                self._starts[pending, n],
                self._directions[pending, n],
                self._distance,
                self._longest,
                measure,
            )
            is_hit = np.isfinite(self._hits[pending, n])
            self._used[pending[is_hit]] = n
            pending = pending[~is_hit]
        return int(pending[0]) + 1 if len(pending) else len(self._hits)

    def _measure(self, rows: Any, flights: Any, numbers: Any) -> Flights:
        """Lengths of flights of pairs of these shots and the grains with these numbers."""

        def measure(pairs: Any, targets: Any, apart: Any) -> NDArray[np.float64]:
            directions = self._directions[rows[pairs], flights[pairs]]
            touch = self._grains.distance(self._count + rows[pairs], numbers[targets])
            along = np.einsum("tc,tc->t", apart, directions)
            return flight_length(along, (apart**2).sum(axis=1) - along**2, touch)

        return measure

    def _find_centre(self, row: int) -> NDArray[np.float64]:
        """Centre (3,) [m] of the grain of a shot where it hits, NaN for a miss."""
        n = self._used[row]
        hit = self._hits[row, n]
        if not np.isfinite(hit):
            return np.full(3, np.nan)
        values: NDArray[np.float64] = self._starts[row, n] + hit * self._directions[row, n]
        return values

    def _hit_one_another(self, row: int, earlier: NDArray[np.float64]) -> None:
        """Shorten the flights of a shot by the grains that landed earlier (n, 3) [m]."""
        numbers = np.arange(len(earlier))
        for n in range(self._used[row] + 1):
            rows, flights = np.full(len(earlier), row), np.full(len(earlier), n)
            measure = self._measure(rows, flights, self._count + numbers)
            lengths = measure(numbers, numbers, earlier - self._starts[row, n])
            self._hits[row, n] = lengths.min(initial=self._hits[row, n])
            if np.isfinite(self._hits[row, n]):
                self._used[row] = n
                return
