"""The pair correlation against what is known of it."""

import numpy as np

from dusttaichi.analysis.frame import Frame
from dusttaichi.analysis.structure import BINS, FARTHEST, pair_correlation


def frame(position, edge, periodic=True):
    n = len(position)
    cell = np.array([[0.0, edge]] * 3)
    still = np.zeros((n, 3))
    sides = np.array([periodic] * 3)
    return Frame(0, 0.0, 0, position, still, still, np.full(n, 0.5), cell, sides, None)


def test_points_that_know_nothing_of_each_other():
    """g = 1 within four standard deviations of the number of pairs in a bin."""
    rng = np.random.default_rng(5)
    for periodic in (True, False):
        r, g = pair_correlation(frame(16.0 * rng.random((4000, 3)), 16.0, periodic))
        far = r > 1.0
        centres = 4000 if periodic else 4000 * (6 / 16) ** 3
        pairs = centres * 4 * np.pi * r**2 * (FARTHEST / BINS) * 4000 / 16.0**3
        assert np.all(np.abs(g - 1.0)[far] < 4.0 * np.sqrt(2.0 / pairs[far]) + 0.02)


def test_a_lattice_has_its_shells():
    """Simple cubic: 6, 12 and 8 neighbours at 1.01 times 1, sqrt 2 and sqrt 3."""
    x = 1.01 * np.array(np.meshgrid(*[np.arange(11.0)] * 3)).reshape(3, -1).T + 0.2
    r, g = pair_correlation(frame(x, 11.11))
    width = FARTHEST / BINS
    shells = g * 4 / 3 * np.pi * ((r + width / 2) ** 3 - (r - width / 2) ** 3)
    assert g.min() == 0.0 and not g[r < 1.0].any()  # a grain is no neighbour of itself
    held = shells[shells > 1e-9][:3]
    np.testing.assert_allclose(held / 1.01**3, [6, 12, 8], rtol=1e-9)


def test_a_cell_that_is_too_small_has_none():
    assert np.isnan(pair_correlation(frame(np.random.rand(50, 3) * 5, 5.0))[1]).all()
