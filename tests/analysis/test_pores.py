"""Pores, pair correlation, and the dimension of fragments, against what is known of them."""

import numpy as np
import pytest
import snapshots

from dusttaichi import analysis, plots
from dusttaichi.analysis.frame import Frame
from dusttaichi.analysis.pores import _free, pores_of
from dusttaichi.analysis.structure import BINS, FARTHEST, pair_correlation
from dusttaichi.errors import DustError


def frame(position, radius, edges, periodic=True):
    still, cell = np.zeros_like(position), np.column_stack([np.zeros(3), edges])
    sides = np.array([periodic] * 3)
    return Frame(0, 0.0, 0, position, still, still, radius, cell, sides, None)


def cubic(n):
    """Touching spheres of radius 1."""
    return 2.0 * np.stack(np.meshgrid(*[np.arange(n)] * 3), axis=-1).reshape(-1, 3) + 1.0


def test_the_pores_of_a_simple_cubic_lattice():
    """The largest sphere sits in the middle of eight grains, of radius sqrt(3) - 1; the points that
    it holds have that pore, and few more one that is nearly as large."""
    found = pores_of(frame(cubic(3), np.ones(27), np.full(3, 6.0)), 3000)
    void = 1.0 - np.pi / 6.0
    # three standard deviations of 3000 points
    assert found.void == pytest.approx(void, abs=0.03)
    # the last steps are 0.02 long
    assert found.largest == pytest.approx(3**0.5 - 1.0, abs=0.01)
    share = np.interp(0.97 * found.largest, found.radius, found.share)
    sphere = 4 / 3 * np.pi * (3**0.5 - 1.0) ** 3 / (8.0 * void)
    assert sphere - 0.04 < share < sphere + 0.12
    assert found.share[0] == 1.0 and np.all(np.diff(found.share) <= 0.0)


def test_walls_and_unequal_grains():
    """One grain in the corner of a box: the largest sphere touches the three far walls and the
    grain, or all walls."""
    edge, a = 8.0, 3.0
    one = frame(np.full((1, 3), a), np.array([a]), np.full(3, edge), periodic=False)
    found = pores_of(one, 400)
    # sqrt(3) (edge - R - a) = R + a
    wanted = (3**0.5 * (edge - a) - a) / (1 + 3**0.5)
    assert found.largest == pytest.approx(wanted, rel=0.02)
    rng = np.random.default_rng(3)
    x, r = 10.0 * rng.random((60, 3)), rng.uniform(0.1, 1.5, 60)
    mixed = frame(x, r, np.full(3, 10.0))
    points = 10.0 * rng.random((300, 3))
    apart = points[:, None] - x
    apart -= 10.0 * np.round(apart / 10.0)
    direct = (np.linalg.norm(apart, axis=2) - r).min(axis=1)
    np.testing.assert_allclose(_free(mixed, points), direct)


def test_an_open_body_has_no_room():
    one = frame(np.zeros((1, 3)), np.ones(1), np.full(3, np.nan), periodic=False)
    with pytest.raises(DustError, match="Pores need walls"):
        pores_of(one)


def test_dimension_of_a_plate_across_a_face(tmp_path):
    """A square plate of touching grains that a periodic face cuts: D = 2."""
    n, d = 24, 1.2e-6
    x = np.stack(np.meshgrid(np.arange(n), np.arange(n)), axis=-1).reshape(-1, 2) * d
    number = np.arange(n * n).reshape(n, n)
    pairs = np.concatenate(
        [
            np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]),
            np.column_stack([number[:-1].ravel(), number[1:].ravel()]),
        ]
    )
    edge = 40 * d
    position = np.column_stack([np.mod(x[:, 0] + 30 * d, edge), x[:, 1], np.zeros(len(x))])
    box = np.array([0.0, edge, np.nan, np.nan, np.nan, np.nan])
    frames = [{"position": position, "pairs": pairs}]
    snapshots.write(tmp_path / "result.nc", frames, 0.6e-6, box=box, periodic="x")
    with analysis.open_run(tmp_path) as run:
        found = analysis.fragment_dimension(run)
        assert found.dimension == pytest.approx(2.0, abs=0.1) and found.grains == n * n
        plots.fragment_dimension(run)
        with pytest.raises(DustError, match="There is no fragment 1; allowed: 0 to 0"):
            analysis.fragment_dimension(run, fragment=1)


# -- pair correlation ----------------------------------------------------------------------------


def points(position, edge, periodic=True):
    return frame(position, np.full(len(position), 0.5), np.full(3, edge), periodic)


def test_points_that_know_nothing_of_each_other():
    """g = 1 within four standard deviations of the number of pairs in a bin."""
    rng = np.random.default_rng(5)
    for periodic in (True, False):
        r, g = pair_correlation(points(16.0 * rng.random((4000, 3)), 16.0, periodic))
        far = r > 1.0
        centres = 4000 if periodic else 4000 * (6 / 16) ** 3
        pairs = centres * 4 * np.pi * r**2 * (FARTHEST / BINS) * 4000 / 16.0**3
        assert np.all(np.abs(g - 1.0)[far] < 4.0 * np.sqrt(2.0 / pairs[far]) + 0.02)


def test_a_lattice_has_its_shells():
    """Simple cubic: 6, 12 and 8 neighbours at 1.01 times 1, sqrt 2 and sqrt 3."""
    x = 1.01 * np.array(np.meshgrid(*[np.arange(11.0)] * 3)).reshape(3, -1).T + 0.2
    r, g = pair_correlation(points(x, 11.11))
    width = FARTHEST / BINS
    shells = g * 4 / 3 * np.pi * ((r + width / 2) ** 3 - (r - width / 2) ** 3)
    assert g.min() == 0.0 and not g[r < 1.0].any()  # a grain is no neighbour of itself
    held = shells[shells > 1e-9][:3]
    np.testing.assert_allclose(held / 1.01**3, [6, 12, 8], rtol=1e-9)


def test_a_cell_that_is_too_small_has_none():
    assert np.isnan(pair_correlation(points(np.random.rand(50, 3) * 5, 5.0))[1]).all()
