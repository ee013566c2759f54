"""What is said of a sample, against bodies that are known; neighbours are those of scipy's tree."""

import numpy as np
import pytest
from bodies import D, R, make_sample, scene
from scipy.spatial import cKDTree

from dusttaichi.grains.preview import preview
from dusttaichi.physics.near import are_apart, near, near_pairs
from dusttaichi.samples import describe, fractal_dimension, make, radius_of_gyration
from dusttaichi.samples.sample import Sample

KINDS = {
    "rbd": {"grains": 200},
    "pca": {"grains": 200},
    "bcca": {"grains": 256},
    "lattice": {"structure": "fcc", "grains": 200},
    "random_packing": {"grains": 60},
    "pair": {},
    "chain": {"grains": 30},
    "explicit": {"positions": [["0 m", "0 m", "0 m"], ["1.2 um", "0 m", "0 m"]]},
    "collision": {
        "target": {"kind": "pca", "grains": 100},
        "projectile": {"kind": "pca", "grains": 100},
        "speed": "1 m/s",
    },
}


def random_body(grains, inside, seed=0):
    """Points even over the part of a cube of edge 60 R that `inside` picks."""
    points = np.random.default_rng(seed).uniform(-30 * R, 30 * R, (100_000, 3))
    return Sample.at_rest(points[inside(points)][:grains])


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_described_and_shown(kind):
    """In its information, and by `dust check`."""
    built = scene(kind=kind, **KINDS[kind])
    sample = make(built)
    info = sample.info
    assert info["kind"] == kind and info["grains"] == len(sample)
    assert 0 < info["filling_factor"] < 1
    assert info.items() >= describe(sample, R, 2 * R).items()
    # Grains that overlap are in contact from the first step on: by brute force.
    apart = np.linalg.norm(sample.positions[:, None] - sample.positions, axis=-1)
    np.fill_diagonal(apart, np.inf)
    assert info["coordination"] == np.count_nonzero(apart <= 2 * R) / len(sample)
    shown = dict(preview(built).sections[0][1])
    filling = float(shown[f"filling factor of the {info['filling_factor_in']}"])
    assert filling == pytest.approx(info["filling_factor"], rel=1e-3)
    assert shown["radius of gyration"] == f"{radius_of_gyration(sample, R) * 1e6:.4g} µm"
    assert ("repeats itself after" in shown) == (kind in ("lattice", "random_packing"))
    assert ("impact parameter" in shown) == (kind == "collision")


SEEDED = [
    ("rbd", {"grains": 1000}),
    ("rbd", {"grains": 1000, "shape": "cylinder"}),
    ("pca", {"grains": 700}),
    ("pca", {"grains": 200, "shape": "box"}),
    ("bcca", {"grains": 256}),
    ("random_packing", {"grains": 100}),
    ("space_filling", {"grains": 60}),
    ("collision", KINDS["collision"]),
]


@pytest.mark.parametrize("kind, keys", SEEDED)
def test_same_seed_same_bits(kind, keys):
    first, repeated, different = (make_sample(kind, seed=seed, **keys) for seed in (3, 3, 4))
    assert first.positions.tobytes() == repeated.positions.tobytes()
    assert first.info == repeated.info and first.info["seed"] == 3
    assert first.positions.tobytes() != different.positions.tobytes()


def test_radius_of_gyration():
    assert radius_of_gyration(Sample.at_rest(np.zeros((1, 3))), R) == pytest.approx(
        np.sqrt(3 / 5) * R
    )
    # A ball of radius 30 R: sqrt(3/5) of it; 40000 points leave 0.2 %.
    ball = random_body(40_000, lambda x: np.linalg.norm(x, axis=1) < 30 * R)
    assert radius_of_gyration(ball, R) == pytest.approx(np.sqrt(3 / 5) * 30 * R, rel=0.005)


@pytest.mark.parametrize(
    "dimension, inside",
    [
        (3, lambda x: np.linalg.norm(x, axis=1) < 30 * R),
        (3, lambda x: np.abs(x).max(axis=1) < 25 * R),
        (2, lambda x: np.abs(x[:, 2]) < 0.5 * R),
        (1, lambda x: np.hypot(x[:, 0], x[:, 1]) < 1.5 * R),
    ],
    ids=["ball", "cube", "plate", "rod"],
)
def test_fractal_dimension_of_bodies_without_structure(dimension, inside):
    # Counts of hundreds of points from tens of centres scatter by 1 %; the smallest radius, 3 R,
    # is not far above the thickness of plate and rod, which adds a few hundredths.
    found = fractal_dimension(random_body(5000, inside), R)
    assert found == pytest.approx(dimension, abs=0.12)


@pytest.mark.parametrize("exponent, known", [(3.0, True), (3.6, False)])
def test_a_density_that_grows_outwards_is_no_fractal(exponent, known):
    """N(<R) ~ R^3.6 about the centre; a homogeneous ball has 3, which may scatter above it."""
    directions = np.random.default_rng(1).normal(size=(8000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    distance = 60 * R * (np.arange(8000) / 8000)[:, None] ** (1.0 / exponent)
    found = fractal_dimension(Sample.at_rest(distance * directions), R)
    assert found == pytest.approx(3.0, abs=0.1) if known else np.isnan(found)


def test_the_fractal_dimension_of_a_small_deposit_is_not_known():
    """Octants of 200 grains differ so much that the error is 0.16 and 0.23; of 4000, 0.01."""
    for seed in (1, 2):
        info = make_sample("rbd", grains=200, shape="cylinder", seed=seed).info
        assert "fractal_dimension" not in info


def test_few_grains_have_no_fractal_dimension():
    assert np.isnan(fractal_dimension(random_body(99, lambda x: x[:, 0] < np.inf), R))
    assert "fractal_dimension" not in make_sample("bcca", grains=32).info
    x = np.array([[0, 0, 0], [D, 0, 0], [2 * D + 1e-9, 0, 0]])
    still = np.zeros((3, 3))
    brought = {"i": np.array([1, 2]), "j": np.array([0, 1])}  # the second one is stretched
    info = describe(Sample(x, still, still, brought), R, 2 * R)
    assert info["coordination"] == pytest.approx(4 / 3)


EDGES = [None, [1.0, 0.7], [1.0, 0.7, 0.3], [1.0, 0.11], [1.0, np.inf, 0.3], [np.inf, 1.0]]


def _sort_pairs(i, j, distance):
    order = np.lexsort((j, i))
    return i[order], j[order], distance[order]


@pytest.mark.parametrize("edges", EDGES)
@pytest.mark.parametrize("reach", [0.02, 0.05, 0.2])
def test_pairs_are_those_of_a_tree(edges, reach):
    rng = np.random.default_rng(1)
    size = np.where(np.isfinite(edges or [1.0, 0.7, 0.3]), edges or [1.0, 0.7, 0.3], 0.8)
    a, b = (rng.random((n, len(size))) * size for n in (300, 200))
    b[:50] = a[:50]  # at no distance
    # of the tree, 0 is an open axis
    box = None if edges is None else np.where(np.isfinite(edges), edges, 0.0)
    period = None if edges is None else np.array(edges)
    first, second = (cKDTree(points, boxsize=box) for points in (a, b))

    def expected(second):
        pairs = first.sparse_distance_matrix(second, reach, output_type="ndarray")
        return _sort_pairs(pairs["i"], pairs["j"], pairs["v"])

    pairs = near(a, b, reach, period)
    assert len(pairs[0]) >= 50
    np.testing.assert_array_equal(_sort_pairs(*pairs), expected(second))
    i, j, distance = expected(first)
    np.testing.assert_array_equal(
        _sort_pairs(*near_pairs(a, reach, period)), (i[i < j], j[i < j], distance[i < j])
    )
    closest = distance[i < j].min()
    assert are_apart(a, closest, period)
    assert not are_apart(a, np.nextafter(closest, 1.0), period)


def test_pairs_of_a_loose_cluster_and_of_a_heap():
    """Neither a body that is mostly empty nor points at one place make a slow search."""
    far = np.random.default_rng(2).random((2000, 3)) * 1e9
    x = np.concatenate([far, far + [0.4, 0.0, 0.0]])
    i, j, _ = near_pairs(x, 0.5)
    np.testing.assert_array_equal(_sort_pairs(i, j, i)[0], np.arange(2000))
    np.testing.assert_array_equal(j - i, np.full(2000, 2000))
    assert not are_apart(np.zeros((200_000, 3)), 1.0)
    assert are_apart(np.zeros((1, 3)), 1.0)


def test_points_of_a_line_a_single_point_and_none():
    line = np.arange(10.0)[:, None] * [0.0, 0.0, 1.0]
    assert len(near(line, line, 1.0)[0]) == 10 + 2 * 9
    assert len(near(line, line[:1], 1.0)[0]) == 2
    assert len(near(line, line[:0], 1.0)[0]) == len(near(line[:0], line, 1.0)[0]) == 0
