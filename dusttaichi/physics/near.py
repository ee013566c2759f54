"""Pairs of points near each other, by sorted cells: N log N for any distribution of the points.

scipy.spatial takes 0.3 s to import, and as long to search or longer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

WIDER = 1 + 1e-9  # cells over the reach, by more than rounding
BATCH = 1 << 18  # pairs that are compared at a time: their numbers stay in the cache
KEYS = 60  # bits of the number of a cell


def near(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    reach: float,
    period: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Pairs of points of `a` (N, D) and `b` (M, D) at most `reach` apart: i, j, distance.

    period: edges (D,) of a periodic cell that has all points, [0, period), whose nearest images
    count, inf along axes that are open; None: no images. Pairs and distances are those of scipy's
    cKDTree, in another order.
    """
    if not (len(a) and len(b)):
        return _join_batches([])
    grid = _Grid((a, b), reach, period)
    points, targets = _Sorted(grid, a), _Sorted(grid, b, images=True)
    batches: list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]] = []
    for row in product((-1, 0, 1), repeat=a.shape[1] - 1):
        middle = grid.shift(row)
        begin, end = targets.find_range(points.cells + (middle - 1), points.cells + (middle + 1))
        candidates = _Candidates(begin, end, points.counts)
        batches += candidates.close(points, targets, reach, period)
    return _join_batches(batches)


def near_pairs(
    x: NDArray[np.float64], reach: float, period: NDArray[np.float64] | None = None
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Pairs i < j of points (N, D) at most `reach` apart: i, j, distance; arguments as of `near`.

    In no particular order.
    """
    if len(x) < 2:
        return _join_batches([])
    grid = _Grid((x,), reach, period)
    points, targets = _Sorted(grid, x), _Sorted(grid, x, images=True)
    batches: list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]] = []
    for row in product((-1, 0, 1), repeat=x.shape[1] - 1):
        if row < (0,) * len(row):
            continue  # each two cells are compared once
        is_same_row, middle = not any(row), grid.shift(row)
        first = points.cells + (middle if is_same_row else middle - 1)
        begin, end = targets.find_range(first, points.cells + (middle + 1))
        candidates = _Candidates(begin, end, points.counts, behind=is_same_row)
        batches += candidates.close(points, targets, reach, period)
    i, j, distance = _join_batches(batches)
    return np.minimum(i, j), np.maximum(i, j), distance


def are_apart(
    x: NDArray[np.float64], reach: float, period: NDArray[np.float64] | None = None
) -> bool:
    """True where no two points (N, D) are less than `reach` apart; period as of `near`.

    Many coincident points take no more time.
    """
    if len(x) < 2:
        return True
    grid = _Grid((x,), reach, period)
    # a cell is less than twice as wide as the reach; each of 4^D parts of it has one point at most
    if not grid.coarse and _Sorted(grid, x).counts.max() > 4 ** x.shape[1]:
        return False
    return not (near_pairs(x, reach, period)[2] < reach).any()


def _join_batches(
    batches: Sequence[tuple[NDArray[Any], NDArray[Any], NDArray[np.float64]]],
) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.float64]]:
    if not batches:
        return np.empty(0, int), np.empty(0, int), np.empty(0)
    first, second, distance = (np.concatenate(column) for column in zip(*batches, strict=True))
    return first, second, distance


class _Grid:
    """Cells at least as wide as the reach around all points, with an empty layer at each side.

    coarse: they are far wider, of points that are very far apart.
    """

    def __init__(
        self,
        bodies: Sequence[NDArray[np.float64]],
        reach: float,
        period: NDArray[np.float64] | None,
    ) -> None:
        low = np.min([x.min(axis=0) for x in bodies], axis=0)
        edges = np.max([x.max(axis=0) for x in bodies], axis=0) - low
        self.periodic = np.zeros(len(low), bool)
        if period is not None:
            self.periodic = np.isfinite(period)
            low, edges = np.where(self.periodic, 0.0, low), np.where(self.periodic, period, edges)
        largest_number = 2 ** (KEYS // len(low)) - 2
        with np.errstate(divide="ignore", invalid="ignore"):
            cells = np.where(edges > 0.0, edges / (reach * WIDER), 1.0)
        self.coarse = bool(cells.max() > largest_number)
        self.cells = np.clip(cells, 1, largest_number).astype(np.int64)
        self.low, self.size = low, np.where(edges > 0.0, edges, 1.0) / self.cells
        strides = np.cumprod([1, *(self.cells[:0:-1] + 2)])
        self.strides = strides[::-1]

    def find_cells(self, x: NDArray[np.float64]) -> NDArray[np.int64]:
        """Cells (N, D) of points, from 1 on."""
        cells: NDArray[np.int64] = ((x - self.low) / self.size).astype(np.int64)
        return cells.clip(0, self.cells - 1) + 1

    def shift(self, row: Sequence[int]) -> int:
        """Difference of the numbers of two cells that are that far apart along all axes but one."""
        return int(np.dot(row, self.strides[:-1]))


class _Sorted:
    """Points in the order of their cells; images: with those beside the faces of a periodic cell.

    rows: numbers of the points in their order; columns: coordinates (D arrays). cells: numbers of
    the cells that have points; first: of each, its first place in the order.
    """

    def __init__(self, grid: _Grid, x: NDArray[np.float64], *, images: bool = False) -> None:
        point_cells, self.rows = grid.find_cells(x), np.arange(len(x))
        if images:
            point_cells, self.rows = _with_images(grid, point_cells, self.rows)
        keys = point_cells @ grid.strides
        order = np.argsort(keys, kind="stable")
        self.keys, self.rows = keys[order], self.rows[order]
        self.columns = [np.take(column, self.rows) for column in x.T]
        self.first = np.flatnonzero(np.diff(self.keys, prepend=-1))
        self.cells = self.keys[self.first]
        self.counts = np.diff(self.first, append=len(self.keys))

    def find_range(
        self, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Places (begin, end) in the order of the points of cells from `low` to `high`."""
        first = np.append(self.first, len(self.keys))
        begin = first[np.searchsorted(self.cells, low, "left")]
        return begin, first[np.searchsorted(self.cells, high, "right")]


class _Candidates:
    """Ranges of the ordered targets, one for each of the ordered points.

    begin, end: of the points of each cell; counts: number of these points; behind: begin with the
    target after the point itself.
    """

    def __init__(
        self,
        begin: NDArray[np.intp],
        end: NDArray[np.intp],
        counts: NDArray[np.intp],
        *,
        behind: bool = False,
    ) -> None:
        start, number = np.repeat(begin, counts), np.repeat(end - begin, counts)
        if behind:
            rank = np.arange(len(start)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
            start, number = start + rank, number - rank
        self.points = np.flatnonzero(number > 0)
        self.start, self.number = start[self.points], number[self.points]

    def close(
        self, points: _Sorted, targets: _Sorted, reach: float, period: NDArray[np.float64] | None
    ) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]]:
        """Pairs at most `reach` apart: (i, j, distance) of each batch."""
        ends = np.cumsum(self.number)
        total = ends[-1] if len(ends) else 0
        cuts = np.searchsorted(ends, np.arange(BATCH, total, BATCH))
        for begin, end in zip([0, *cuts], [*cuts, len(ends)], strict=True):
            number = self.number[begin:end]
            first_candidates = np.cumsum(number) - number
            i = np.repeat(self.points[begin:end], number)
            j = np.arange(len(i)) + np.repeat(self.start[begin:end] - first_candidates, number)
            square = np.zeros(len(i))
            for k, (x, y) in enumerate(zip(points.columns, targets.columns, strict=True)):
                apart = np.abs(x[i] - y[j])
                if period is not None and np.isfinite(period[k]):
                    apart = np.minimum(apart, period[k] - apart)
                square += apart**2
            near = np.flatnonzero(square <= reach**2)
            yield points.rows[i[near]], targets.rows[j[near]], np.sqrt(square[near])


def _with_images(
    grid: _Grid, point_cells: NDArray[np.int64], rows: NDArray[np.intp]
) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """Cells and numbers of points, and of the images beside the faces of at least three cells."""
    for axis in np.flatnonzero(grid.periodic & (grid.cells >= 3)):
        for end, beyond in ((1, grid.cells[axis] + 1), (grid.cells[axis], 0)):
            at_face = np.flatnonzero(point_cells[: len(rows), axis] == end)
            image = point_cells[at_face]
            image[:, axis] = beyond
            point_cells, rows = np.concatenate([point_cells, image]), np.append(rows, rows[at_face])
    return point_cells, rows
