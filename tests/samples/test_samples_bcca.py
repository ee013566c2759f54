"""Ballistic cluster-cluster aggregation, against the law of growth of its radius."""

import numpy as np
import pytest
from bodies import ROUNDING, D, R, distances, pieces, scene

from dusttaichi.samples import fractal_dimension, make
from dusttaichi.samples.ballistic import first_touch
from dusttaichi.samples.bcca import generations
from dusttaichi.samples.sample import Sample


def bcca(**keys):
    return make(scene(kind="bcca", **keys))


def test_clusters_touch_at_one_point():
    sample = bcca(grains=1024, seed=5)
    x = sample.positions
    apart = distances(x)
    assert len(sample) == sample.info["grains"] == 1024
    assert apart.min() >= D - ROUNDING
    assert pieces(x) == 1
    # A tree: n - 1 contacts. And a binary one: each half, quarter, ... hangs together by itself.
    assert np.count_nonzero(apart <= D + ROUNDING) == 2 * 1023
    for n in (512, 128, 8, 2):
        assert all(pieces(x[k : k + n]) == 1 for k in range(0, 1024, n))
    np.testing.assert_allclose(x.mean(axis=0), 0, atol=ROUNDING)


def test_first_touch_is_that_of_a_search_over_all_pairs():
    rng = np.random.default_rng(3)
    targets, projectiles = rng.normal(size=(2, 50, 20, 3)) * 4 * D
    projectiles[..., :2] += rng.normal(size=(50, 1, 2)) * 12 * D
    expected = []
    for target, projectile in zip(targets, projectiles, strict=True):
        apart = projectile[:, None] - target
        left = D**2 - (apart[..., :2] ** 2).sum(axis=2)
        with np.errstate(invalid="ignore"):
            flights = apart[..., 2] - np.sqrt(left)
        expected.append(np.nanmin(np.where(left > 0, flights, np.inf)))
    found = first_touch(targets, projectiles, D)
    assert 10 < np.isfinite(found).sum() < 50
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.fixture(scope="module")
def grown():
    return {
        clusters.shape[1]: clusters for clusters in generations(2**15, D, np.random.default_rng(7))
    }


def test_radius_of_gyration_grows_as_known(grown):
    # R_g/r ~ N^(0.531 +- 0.011) (arXiv:1908.03125), from the mean square of 1024 clusters of 32
    # grains to 32 of 1024. Their scatter makes 0.005 of the exponent, far below the tolerance;
    # an ensemble 16 times as large gives 0.528 +- 0.001 from 64 to 2048 grains.
    sizes = np.array([32, 64, 128, 256, 512, 1024])
    squares = [(grown[n] ** 2).sum(axis=2).mean(axis=1) for n in sizes]
    means = np.log([np.sqrt(square.mean()) / R for square in squares])
    errors = np.array([np.std(s) / np.mean(s) / 2 / np.sqrt(len(s)) for s in squares])
    (exponent, _), covariance = np.polyfit(np.log(sizes), means, 1, w=1 / errors, cov="unscaled")
    assert np.sqrt(covariance[0, 0]) < 0.005
    assert exponent == pytest.approx(0.531, abs=0.011)
    assert 1 / exponent == pytest.approx(1.9, abs=0.1)


def test_fractal_dimension_of_the_core(grown):
    # 1.9 (T19). About the centre, where the last two clusters overlap, it is higher by 0.1; of
    # one aggregate it scatters by 0.13, so 0.03 of this mean.
    found = [fractal_dimension(Sample.at_rest(cluster), R) for cluster in grown[1024][:16]]
    assert np.mean(found) == pytest.approx(1.95, abs=0.15)


def test_impact_parameters_of_pairs_are_even_over_the_disc():
    # Two grains meet at b = D sin(angle), b^2 even in (0, D^2): all orientations of the pair.
    x = list(generations(2**13, D, np.random.default_rng(2)))[1]
    direction = (x[:, 1] - x[:, 0]) / D
    # As two partners are alike to the direction of flight, z, the cosine squared is even too.
    assert np.mean(direction[:, 2] ** 2) == pytest.approx(0.5, abs=4 * np.sqrt(1 / 12 / 4096))
    assert np.mean(direction[:, 0] ** 2) == pytest.approx(0.25, abs=0.02)


@pytest.mark.parametrize("grains", [1, 2, 4])
def test_smallest(grains):
    assert len(bcca(grains=grains)) == grains
