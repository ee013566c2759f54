"""Pairs of points near each other, by a list of cells: scipy.spatial takes 0.3 s to import."""

from itertools import product

import numpy as np


def near(a, b, reach: float, period=None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of points of `a` (N, D) and `b` (M, D) at most `reach` apart: i, j, distance.

    period: edges (D,) of a periodic cell that has all points, [0, period), whose nearest images
    count; None: no images. Pairs and distances are those of scipy's cKDTree, in another order.
    """
    if not (len(a) and len(b)):
        return np.empty(0, int), np.empty(0, int), np.empty(0)
    low, edges = 0.0, period
    if period is None:
        both = np.concatenate([a, b])
        low = both.min(axis=0)
        edges = both.max(axis=0) - low
    # no more cells than points, each wider than the reach by more than rounding
    most = max(1, int(len(b) ** (1.0 / b.shape[1])))
    cells = np.clip(edges / (reach * (1 + 1e-9)), 1, most).astype(int)
    size = np.where(edges > 0.0, edges, 1.0) / cells
    at, others = (np.minimum(((x - low) / size).astype(int), cells - 1) for x in (a, b))
    number = np.ravel_multi_index(others.T, cells)
    order = np.argsort(number, kind="stable")
    first = np.searchsorted(number[order], np.arange(cells.prod() + 1))
    columns = [(np.ascontiguousarray(x), y[order]) for x, y in zip(a.T, b.T, strict=True)]
    found = []
    steps = np.full(len(cells), 3) if period is None else np.minimum(cells, 3)
    for step in product(*(range(-1, n - 1) for n in steps)):
        cell, i = at + step, np.arange(len(a))
        if period is None:
            i = np.flatnonzero(((cell >= 0) & (cell < cells)).all(axis=1))
        cell = np.ravel_multi_index((cell[i] % cells).T, cells)
        count = first[cell + 1] - first[cell]
        i = np.repeat(i, count)
        j = np.arange(len(i)) + np.repeat(first[cell] - np.cumsum(count) + count, count)
        square = np.zeros(len(i))
        for k, (x, y) in enumerate(columns):
            apart = np.abs(x[i] - y[j])
            square += (apart if period is None else np.minimum(apart, period[k] - apart)) ** 2
        close = np.flatnonzero(square <= reach**2)
        found.append((i[close], order[j[close]], np.sqrt(square[close])))
    return tuple(np.concatenate(part) for part in zip(*found, strict=True))
