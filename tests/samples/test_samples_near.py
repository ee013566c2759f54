"""The list of cells finds the pairs and distances that scipy's tree finds."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dusttaichi.samples.near import near


@pytest.mark.parametrize("edges", [None, [1.0, 0.7], [1.0, 0.7, 0.3], [1.0, 0.11]])
@pytest.mark.parametrize("reach", [0.02, 0.05, 0.2])
def test_pairs_are_those_of_a_tree(edges, reach):
    rng = np.random.default_rng(1)
    size = np.array(edges or [1.0, 0.7, 0.3])
    a, b = (rng.random((n, len(size))) * size for n in (300, 200))
    b[:50] = a[:50]  # at no distance
    period = edges and size
    trees = [cKDTree(points, boxsize=period) for points in (a, b)]
    expected = trees[0].sparse_distance_matrix(trees[1], reach, output_type="ndarray")
    i, j, distance = near(a, b, reach, period)
    order, other = np.lexsort((j, i)), np.lexsort((expected["j"], expected["i"]))
    np.testing.assert_array_equal(i[order], expected["i"][other])
    np.testing.assert_array_equal(j[order], expected["j"][other])
    np.testing.assert_array_equal(distance[order], expected["v"][other])
    assert len(i) >= 50


def test_points_of_a_line_a_single_point_and_none():
    line = np.arange(10.0)[:, None] * [0.0, 0.0, 1.0]
    assert len(near(line, line, 1.0)[0]) == 10 + 2 * 9
    assert len(near(line, line[:1], 1.0)[0]) == 2
    assert len(near(line, line[:0], 1.0)[0]) == len(near(line[:0], line, 1.0)[0]) == 0
