"""Growth of a rapidly exploring random tree of grains in contact, in a box (LaValle 1998).

A trial draws random points, one after another. Beside the grain whose surface is nearest to the
point the next grain is placed, in the direction of the point, unless it would overlap another
one or leave the box; then the next point is tried. A trial without success is repeated with other
points.

Beyond the first grains, many trials are made at once: against the grains of earlier batches, and
against those that earlier trials of the same batch have placed so far. Trials that feel the change
of an earlier one are repeated until nothing changes any more. As each depends on earlier ones only,
the result is that of one trial after another.
"""

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.samples.mixture import Grains
from dusttaichi.samples.sample import ROUNDING
from dusttaichi.scene.making import report_progress

POINTS, AT_ONCE = 32, 4  # points of a trial, and those that are compared together with all grains
TRIES = 100  # successive trials without success after which the box is full
FEW = 600  # grains up to which comparing a point with all of them is faster
BATCH = 1 / 16  # trials of a batch over the grains so far,
LEAST_BATCH = 16  # and the smallest batch
ROUNDS = 24  # of a batch, after which its unsettled trials are left to the next one
MORE = 8  # times more neighbours are compared where the nearest surface is not among those so far


def grow_tree(
    grains: Grains, edges: NDArray[np.float64], rng: np.random.Generator
) -> np.ndarray | None:
    """Grow centres (N, 3) [m] in the box from the origin to `edges`; None if too few grains fit."""
    radii, x = grains.radii, np.empty((len(grains), 3))
    x[0] = radii[0] + rng.random(3) * (edges - 2 * radii[0])
    for k in range(1, min(FEW, len(grains))):
        report_progress(k, len(grains))
        touch = grains.distance(k, np.arange(k))
        for _ in range(TRIES):
            x[k] = _place_grain(x[:k], radii[:k], touch, (edges, radii[k]), rng)
            if np.isfinite(x[k, 0]):
                break
        else:
            return None
    count, failures = min(FEW, len(grains)), 0
    largest_batch, points = len(grains), np.empty((0, POINTS, 3))
    while count < len(grains):
        report_progress(count, len(grains))
        trials = min(max(int(BATCH * count), LEAST_BATCH), largest_batch, len(grains) - count)
        if trials > len(points):
            fresh_points = rng.random((trials - len(points), POINTS, 3)) * edges
            points = np.concatenate([points, fresh_points])
        batch = _Batch(grains, x[:count], points[:trials], edges)
        settled = batch.settle()
        largest_batch = len(grains) if settled == trials else max(LEAST_BATCH, 2 * settled)
        points = points[settled:]
        success = np.flatnonzero(batch.is_success[:settled])
        steps = np.diff(success, prepend=-1 - failures, append=settled)
        if steps.max() > TRIES:
            return None
        failures = int(steps[-1]) - 1
        x[count : count + len(success)] = batch.positions[success]
        count += len(success)
    return x


def _place_grain(
    x: NDArray[np.float64],
    radii: NDArray[np.float64],
    touch: NDArray[np.float64],
    room: Any,
    rng: np.random.Generator,
) -> Any:
    """Place the next grain beside the one nearest to a random point; NaN without success."""
    edges, radius = room
    # the first that fits is taken: most often one of the first few, and all cost as much
    for points in (rng.random((POINTS, 3)) * edges).reshape(-1, AT_ONCE, 3):
        apart = points[:, None] - x
        distance = np.linalg.norm(apart, axis=2)
        near = (distance - radii).argmin(axis=1)
        row = np.arange(AT_ONCE)
        towards = apart[row, near] / np.maximum(distance[row, near], 1e-30)[:, None]
        candidates = x[near] + towards * touch[near][:, None]
        inside = np.all((candidates >= radius) & (candidates <= edges - radius), axis=1)
        for candidate in candidates[inside]:
            free = np.linalg.norm(x - candidate, axis=1) >= touch * (1 - ROUNDING)
            if free.all():
                return candidate
    return np.full(3, np.nan)


class _Batch:
    """Trials (T,) that are made together, each with its points (T, POINTS, 3) [m].

    grains: all of the tree; x: centres of those that stand (N, 3) [m]; edges: of the box [m].
    positions: (T, 3) [m], where each trial places its grain at present, NaN without success.
    """

    def __init__(self, grains: Grains, x: Any, points: Any, edges: Any) -> None:
        self._grains, self._x, self._points, self._edges = grains, x, points, edges
        self._largest = float(grains.radii.max())
        self._tree = scipy.spatial.cKDTree(x, balanced_tree=False, compact_nodes=False)
        self.positions = np.full((len(points), 3), np.nan)
        # points of each trial that were tried, and about each the radius in which grains matter
        self._tried = np.zeros(len(points), int)
        self._ranges = np.empty(points.shape[:2])

    @property
    def is_success(self) -> NDArray[np.bool_]:
        """True of trials that place their grain."""
        success: NDArray[np.bool_] = np.isfinite(self.positions[:, 0])
        return success

    def settle(self) -> int:
        """Make trials again until they are those of one after another; the number of these."""
        trials: NDArray[np.integer] = np.arange(len(self.positions))
        numbers = len(self._x) + trials  # of the grains, if each trial has success
        for _ in range(ROUNDS):
            before = self.positions.copy()
            self._try(trials, numbers)
            unequal = ~((before == self.positions) | np.isnan(before + self.positions)).all(axis=1)
            unequal |= np.isfinite(before[:, 0]) != self.is_success
            changed = np.flatnonzero(unequal)
            success = self.is_success
            shifted_numbers = len(self._x) + np.cumsum(success) - success
            trials = self._find_affected(changed, before)
            if np.ptp(self._grains.radii) or np.ptp(self._grains.numbers):
                trials = np.union1d(trials, np.flatnonzero(shifted_numbers != numbers))
            numbers = shifted_numbers
            if len(trials) == 0:
                return len(self.positions)
        return int(trials[0])

    def _find_affected(self, changed: Any, before: Any) -> NDArray[np.integer]:
        """Find the trials that may feel that earlier ones have changed from `before` (T, 3)."""
        sources = np.concatenate([changed, changed])
        centres = np.concatenate([before[changed], self.positions[changed]])
        finite = np.isfinite(centres[:, 0])
        if not finite.any():
            return np.empty(0, int)
        sources, tree = sources[finite], scipy.spatial.cKDTree(centres[finite])
        trial, number = np.nonzero(np.arange(POINTS) < self._tried[:, None])
        i, j = _find_pairs(tree, self._points[trial, number], self._ranges[trial, number])
        return np.unique(trial[i[sources[j] < trial[i]]])

    def _try(self, trials: Any, numbers: Any) -> None:
        """Make these trials, of the grains with these numbers (T,), among those of `positions`."""
        standing = np.flatnonzero(self.is_success)
        placed = self.positions[standing]
        others = standing, numbers[standing], placed
        tree = scipy.spatial.cKDTree(placed) if len(standing) else None
        self.positions[trials] = np.nan
        for n in range(POINTS):
            if len(trials) == 0:
                break
            self._tried[trials] = n + 1
            candidates = self._find_candidates(trials, numbers[trials], n, (tree, others))
            radius = self._grains.radii[numbers[trials]][:, None]
            fits = np.all((candidates >= radius) & (candidates <= self._edges - radius), axis=1)
            rows = np.flatnonzero(fits)
            bodies = [(self._tree, None)] + ([(tree, others)] if tree is not None else [])
            for body in bodies:
                rows = rows[self._are_free(candidates[rows], trials[rows], numbers, body)]
            self.positions[trials[rows]] = candidates[rows]
            trials = np.delete(trials, rows)

    def _find_candidates(self, trials: Any, numbers: Any, n: int, new_grains: Any) -> Any:
        """Find the centres (T, 3) [m] beside the grain that is nearest to point n of each trial."""
        grains, points = self._grains, self._points[trials, n]
        nearest = self._find_nearest(points)
        centres = self._x[nearest]
        gap = np.linalg.norm(points - centres, axis=1) - grains.radii[nearest]
        ranges = gap + self._largest
        tree, (standing, new_numbers, placed) = new_grains
        if tree is not None:
            i, j = _find_pairs(tree, points, ranges)
            earlier = standing[j] < trials[i]
            i, j = i[earlier], j[earlier]
            new_gap = np.linalg.norm(points[i] - placed[j], axis=1) - grains.radii[new_numbers[j]]
            order = np.lexsort((new_gap, i))
            order = order[np.diff(i[order], prepend=-1) > 0]
            order = order[new_gap[order] < gap[i[order]]]
            centres[i[order]], nearest[i[order]] = placed[j[order]], new_numbers[j[order]]
        apart = points - centres
        distance = np.linalg.norm(apart, axis=1)
        towards = apart / np.maximum(distance, 1e-30)[:, None]
        touch = grains.distance(numbers, nearest)
        candidates = centres + towards * touch[:, None]
        # a grain that overlaps the candidate matters as well
        beside = np.abs(distance - touch) + grains.radii[numbers] + self._largest
        self._ranges[trials, n] = np.maximum(ranges, beside) * (1 + ROUNDING)
        return candidates

    def _find_nearest(self, points: Any) -> NDArray[np.integer]:
        """Find the grain that stands whose surface is nearest to each point, (M,)."""
        nearest, rows, count = np.zeros(len(points), int), np.arange(len(points)), 1
        while len(rows):
            distance, index = self._tree.query(points[rows], k=[*range(1, count + 1)])
            gap = distance - self._grains.radii[index]
            best = gap.argmin(axis=1)[:, None]
            nearest[rows] = np.take_along_axis(index, best, axis=1)[:, 0]
            farther = distance[:, -1] - self._largest
            is_open = farther < np.take_along_axis(gap, best, axis=1)[:, 0]
            rows = rows[is_open & (count < len(self._x))]
            count = min(MORE * count, len(self._x))
        return nearest

    def _are_free(self, candidates: Any, trials: Any, numbers: Any, body: Any) -> Any:
        """True of candidates (M, 3) that overlap no grain that stands, or of an earlier trial."""
        free = np.ones(len(candidates), bool)
        if len(candidates) == 0:
            return free
        tree, new_grains = body
        pairs = scipy.spatial.cKDTree(candidates).sparse_distance_matrix(
            tree, 2.0 * self._largest, output_type="ndarray"
        )
        i, j = pairs["i"], pairs["j"]
        if new_grains is None:
            others, x = j, self._x[j]
        else:
            standing, new_numbers, placed = new_grains
            earlier = standing[j] < trials[i]
            i, j = i[earlier], j[earlier]
            others, x = new_numbers[j], placed[j]
        touch = self._grains.distance(numbers[trials[i]], others)
        free[i[np.linalg.norm(x - candidates[i], axis=1) < touch * (1 - ROUNDING)]] = False
        return free


def _find_pairs(tree: Any, centres: Any, ranges: Any) -> Any:
    """Pairs i, j of centres (M, 3) and points j of a tree within the range (M,) of the centre."""
    near = np.flatnonzero(tree.query_ball_point(centres, ranges, return_length=True))
    neighbours = tree.query_ball_point(centres[near], ranges[near])
    counts = [len(indices) for indices in neighbours]
    joined = np.concatenate([*neighbours, np.empty(0)]).astype(int)
    return np.repeat(near, counts), joined
