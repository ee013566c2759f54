"""Pores and pair correlation of grains, against lattices and points that are known."""

from importlib import import_module

import numpy as np
import pytest

from dusttaichi.analysis.frame import Frame
from dusttaichi.analysis.pores import Surfaces, measure_frame_pores
from dusttaichi.analysis.structure import BINS, FARTHEST, compute_pair_correlation
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
    pores = measure_frame_pores(frame(cubic(3), np.ones(27), np.full(3, 6.0)), 3000)
    void = 1.0 - np.pi / 6.0
    assert pores.void == pytest.approx(void, abs=3.0 * pores.void_error)
    assert pores.void_error == pytest.approx(np.sqrt(void * (1.0 - void) / 3000), rel=0.05)
    # the last steps are 0.02 long
    assert pores.largest == pytest.approx(3**0.5 - 1.0, abs=0.01)
    fraction = np.interp(0.97 * pores.largest, pores.radius, pores.share)
    sphere = 4 / 3 * np.pi * (3**0.5 - 1.0) ** 3 / (8.0 * void)
    assert sphere - 0.04 < fraction < sphere + 0.12
    assert pores.share[0] == 1.0 and np.all(np.diff(pores.share) <= 0.0)


def test_walls_and_unequal_grains():
    """One grain in the corner of a box: the largest sphere touches the three far walls and the
    grain, or all walls."""
    edge, a = 8.0, 3.0
    one = frame(np.full((1, 3), a), np.array([a]), np.full(3, edge), periodic=False)
    pores = measure_frame_pores(one, 400)
    # sqrt(3) (edge - R - a) = R + a
    expected = (3**0.5 * (edge - a) - a) / (1 + 3**0.5)
    assert pores.largest == pytest.approx(expected, rel=0.02)
    rng = np.random.default_rng(3)
    x, r = 10.0 * rng.random((60, 3)), rng.uniform(0.1, 1.5, 60)
    mixed = frame(x, r, np.full(3, 10.0))
    points = 10.0 * rng.random((300, 3))
    apart = points[:, None] - x
    apart -= 10.0 * np.round(apart / 10.0)
    direct = (np.linalg.norm(apart, axis=2) - r).min(axis=1)
    np.testing.assert_allclose(Surfaces(mixed).distances(points), direct)


def test_an_open_body_has_no_room():
    one = frame(np.zeros((1, 3)), np.ones(1), np.full(3, np.nan), periodic=False)
    with pytest.raises(DustError, match="Pores need walls"):
        measure_frame_pores(one)


# -- pair correlation ----------------------------------------------------------------------------


def points(position, edge, periodic=True):
    return frame(position, np.full(len(position), 0.5), np.full(3, edge), periodic)


def test_points_that_know_nothing_of_each_other():
    """g = 1 within four standard deviations of the number of pairs in a bin."""
    rng = np.random.default_rng(5)
    for periodic in (True, False):
        r, g, _ = compute_pair_correlation(points(16.0 * rng.random((4000, 3)), 16.0, periodic))
        far = r > 1.0
        centres = 4000 if periodic else 4000 * (6 / 16) ** 3
        pairs = centres * 4 * np.pi * r**2 * (FARTHEST / BINS) * 4000 / 16.0**3
        assert np.all(np.abs(g - 1.0)[far] < 4.0 * np.sqrt(2.0 / pairs[far]) + 0.02)
    assert np.isnan(compute_pair_correlation(points(np.random.rand(50, 3) * 5, 5.0))[1]).all()


def test_a_lattice_has_its_shells():
    """Simple cubic: 6, 12 and 8 neighbours at 1.01 times 1, sqrt 2 and sqrt 3."""
    x = 1.01 * np.array(np.meshgrid(*[np.arange(11.0)] * 3)).reshape(3, -1).T + 0.2
    r, g, error = compute_pair_correlation(points(x, 11.11))
    width = FARTHEST / BINS
    shells = g * 4 / 3 * np.pi * ((r + width / 2) ** 3 - (r - width / 2) ** 3)
    assert g.min() == 0.0 and not g[r < 1.0].any()  # a grain is no neighbour of itself
    first_shells = shells[shells > 1e-9][:3]
    np.testing.assert_allclose(first_shells / 1.01**3, [6, 12, 8], rtol=1e-9)
    assert not error.any()


def test_a_few_random_centres_serve_for_many_grains(monkeypatch):
    """About a quarter of the grains, g(r) is within four of its standard errors of that about all,
    and one standard error contains it in two bins of three."""
    snapshot = points(16.0 * np.random.default_rng(6).random((4000, 3)), 16.0)
    r, exact, _ = compute_pair_correlation(snapshot)
    monkeypatch.setattr(import_module("dusttaichi.analysis.structure"), "CENTRES", 1000)
    _, g, error = compute_pair_correlation(snapshot)
    far = r > 1.0
    deviations = np.abs(g - exact)[far] / error[far]
    assert deviations.max() < 4.0 and 0.6 < np.mean(deviations < 1.0) < 0.95
