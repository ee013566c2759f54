"""Bodies in a periodic cell in one piece, and those that are connected to their own images."""

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray


def unwrap_fragments(
    positions: NDArray[np.float64],
    pairs: ArrayLike,
    starts: ArrayLike,
    nearest: Callable[..., NDArray[np.float64]],
) -> NDArray[np.float64]:
    """Positions (N, 3) for which fragments are not cut by the faces of a periodic cell.

    pairs: (C, 2) connected points. starts: a point of each fragment, which does not move; other
    fragments stay as they are. nearest: maps differences (n, 3) to those to the nearest image.
    """
    count = len(positions)
    ends = np.asarray(pairs, int).reshape(-1, 2)
    # a point beside the others, connected to the starts: a single search reaches all fragments
    roots = np.column_stack([np.full(np.size(starts), count), starts]).astype(int)
    i, j = np.concatenate([ends, roots]).T
    graph = scipy.sparse.coo_array((np.ones(len(i), np.int8), (i, j)), shape=(count + 1,) * 2)
    parent = scipy.sparse.csgraph.breadth_first_order(graph.tocsr(), count, directed=False)[1]
    above = np.where(parent < 0, count, parent)  # of points that the search has not reached
    moved = np.zeros((count + 1, 3))
    rows = np.flatnonzero(above != count)
    apart = positions[rows] - positions[above[rows]]
    moved[rows] = nearest(apart) - apart
    while (above != count).any():  # sums along the branches, each round over twice as many points
        moved += moved[above]
        above = above[above]
    return positions + moved[:count]


def crossings(
    positions: NDArray[np.float64],
    pairs: ArrayLike,
    nearest: Callable[..., NDArray[np.float64]],
    period: NDArray[np.float64],
    tilt: float = 0.0,
) -> NDArray[np.int64]:
    """Numbers of edges (C, 3) by which pairs are apart beyond their nearest images.

    They are zero throughout a fragment that is unwrapped, unless it is connected to its own
    images: it percolates along the axes where they are not. Arguments as of unwrapped and
    nearest_image.
    """
    i, j = np.asarray(pairs, int).reshape(-1, 2).T
    apart = positions[i] - positions[j]
    apart = apart - nearest(apart)
    counts = np.zeros(apart.shape, int)
    for n in (2, 1, 0):
        if np.isfinite(period[n]):
            counts[:, n] = np.round(apart[:, n] / period[n])
        if n == 2:
            apart[:, 0] -= tilt * counts[:, 2]
    return counts
