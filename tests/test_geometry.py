"""Shadows, volumes and neighbours against closed forms, brute force and Monte Carlo."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dusttaichi.physics import geometry

EXACT = 1e-12  # relative: some hundred roundings


def lens(s, r=1.0):
    """Area common to two discs of radius r, their centres s apart (closed form)."""
    return 2 * r**2 * np.arccos(s / (2 * r)) - 0.5 * s * np.sqrt(4 * r**2 - s**2)


def polygon(corners, side):
    """Corners of a regular polygon with this side."""
    angle = 2 * np.pi * np.arange(corners) / corners
    return side / (2 * np.sin(np.pi / corners)) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def test_products_and_lengths_of_rows_have_the_bits_of_numpy():
    a, b = np.random.default_rng(1).standard_normal((2, 1000, 3))
    np.testing.assert_array_equal(geometry.dot_rows(a, b), np.sum(a * b, axis=1))
    np.testing.assert_array_equal(geometry.measure_rows(a), np.linalg.norm(a, axis=1))


# Union of discs.


def test_none_and_one_disc():
    assert geometry.union_area(np.zeros((0, 2)), 1.0) == 0
    assert geometry.union_area([[1.0, 2.0]], 0.0) == 0
    assert geometry.union_area([[3.0, -7.0]], 0.6) == pytest.approx(np.pi * 0.36, rel=EXACT)


@pytest.mark.parametrize("s", [1e-9, 0.1, 1.0, 1.9999999, 2.0, 2.5])
@pytest.mark.parametrize("turn", [0.0, 0.7, np.pi / 2, np.pi])
def test_two_discs(s, turn):
    centres = 5.0 + s * np.array([[0, 0], [np.cos(turn), np.sin(turn)]])
    union = 2 * np.pi - (lens(s) if s < 2 else 0.0)
    # arccos has 1e-8 of error where it meets 0, and the two arcs differ by as little there
    assert geometry.union_area(centres, 1.0) == pytest.approx(union, rel=1e-11)


THREE, RING = polygon(3, 1.0), polygon(6, 1.8)
NEARLY = np.repeat(THREE, 4, axis=0) + 1e-13 * np.random.default_rng(0).standard_normal((12, 2))
GRID = 1.5 * np.indices((7, 7)).reshape(2, -1).T
REULEAUX = 3 * np.pi - 3 * lens(1.0) + (np.pi - np.sqrt(3)) / 2
UNIONS = {
    "three of side 1, to all of which the Reuleaux triangle is common": (THREE, REULEAUX, EXACT),
    # no arc is left in the middle, and none is lost; the end points of arcs agree to rounding only
    "three through one point": (polygon(3, 3**0.5), 3 * np.pi - 3 * lens(3**0.5), EXACT),
    "coincident discs count once": (np.repeat(THREE, 4, axis=0), REULEAUX, EXACT),
    "also those that nearly are": (NEARLY, REULEAUX, 1e-11),  # moved by 1e-13
    # neighbours overlap, diagonals do not: inclusion and exclusion end after pairs
    "a grid": (GRID, 49 * np.pi - 84 * lens(1.5), EXACT),
    "a hole does not count": (RING, 6 * np.pi - 6 * lens(1.8), EXACT),
    # which a disc in the middle meets in a lens each
    "filled": (np.vstack([RING, [0, 0]]), 7 * np.pi - 12 * lens(1.8), EXACT),
}


@pytest.mark.parametrize("name", UNIONS)
def test_unions_in_closed_form(name):
    centres, union, rel = UNIONS[name]
    assert geometry.union_area(centres, 1.0) == pytest.approx(union, rel=rel)


def test_a_disc_closes_a_hole():
    """Six of side 1.2 leave the hexagon of their centres less six sectors of 120 degrees, whose
    overlaps count twice."""
    tight = polygon(6, 1.2)
    hole = 1.5 * np.sqrt(3) * 1.2**2 - 2 * np.pi + 3 * lens(1.2)
    closed = geometry.union_area(np.vstack([tight, [0, 0]]), 1.0)
    # a hundredth of either
    assert closed - geometry.union_area(tight, 1.0) == pytest.approx(hole, rel=1e-10)


def test_union_turned_moved_and_scaled():
    rng = np.random.default_rng(3)
    centres = rng.random((400, 2)) * 12
    area = geometry.union_area(centres, 1.0)
    turn = rng.random() * 2 * np.pi
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    assert geometry.union_area(centres @ matrix.T, 1.0) == pytest.approx(area, rel=EXACT)
    # the centres themselves are rounded when moved by 80 diameters
    assert geometry.union_area(centres + 1e2, 1.0) == pytest.approx(area, rel=1e-11)
    assert geometry.union_area(centres * 6e-7, 6e-7) == pytest.approx(area * 3.6e-13, rel=1e-11)


@pytest.mark.parametrize("grains", [60, 1000])
def test_union_against_monte_carlo(grains):
    rng = np.random.default_rng(grains)
    centres = rng.random((grains, 2)) * 14
    points = rng.random((40_000, 2)) * 16 - 1
    hits = np.zeros(len(points), dtype=bool)
    for centre in centres:
        hits |= np.sum((points - centre) ** 2, axis=1) < 1
    fraction = hits.mean()
    error = 4 * np.sqrt(fraction * (1 - fraction) / len(points)) * 16**2
    assert abs(geometry.union_area(centres, 1.0) - fraction * 16**2) < error


# Spheres in a cylinder.


def test_spheres_wholly_inside_and_outside():
    ball = 4 / 3 * np.pi
    positions = [[0, 0, 0], [3, 0, 0], [0, 9, 0], [0, 0, 50]]
    volume = geometry.cylinder_volume(positions, 1.0, (0, 0), 4.0, low=-10, high=10)
    assert volume == pytest.approx(2 * ball, rel=EXACT)
    half = geometry.cylinder_volume(positions, 1.0, (0, 0), 4.0, low=0, high=10)
    assert half == pytest.approx(ball, rel=EXACT)
    assert geometry.cylinder_volume(np.zeros((0, 3)), 1.0, (0, 0), 4.0, low=0, high=1) == 0
    assert geometry.cylinder_volume(positions, 1.0, (0, 0), 4.0, low=20, high=30) == 0


@pytest.mark.parametrize("cylinder", [0.01, 0.3, 0.999, 1.0, 2.0])
def test_sphere_on_the_axis(cylinder):
    volume = geometry.cylinder_volume([[7, -3, 2]], 1.0, (7, -3), cylinder, low=-10, high=10)
    cap = max(1 - cylinder**2, 0) ** 1.5
    assert volume == pytest.approx(4 / 3 * np.pi * (1 - cap), rel=1e-11)


def test_sphere_cut_by_a_wide_mantle():
    """A mantle ten thousand times wider than the sphere is a plane: half of it is inside."""
    volume = geometry.cylinder_volume([[1e4, 0, 0]], 1.0, (0, 0), 1e4, low=-1, high=1)
    # the sagitta of the mantle, r^2/2R = 5e-5 at most, takes some of the half
    assert volume == pytest.approx(2 / 3 * np.pi, abs=np.pi * 5e-5)


@pytest.mark.parametrize("cylinder, distance", [(0.3, 0.5), (1, 1), (0.5, 0.5), (0.2, 0.9), (5, 5)])
def test_integration_has_converged(cylinder, distance, monkeypatch):
    """The stated error, 1e-10 of a sphere, against eight times as many nodes."""
    args, ends = ([[distance, 0, 0.2]], 1.0, (0, 0), cylinder), {"low": -0.5, "high": 10}
    coarse = geometry.cylinder_volume(*args, **ends)
    nodes, weights = np.polynomial.legendre.leggauss(192)
    monkeypatch.setattr(geometry, "_NODES", nodes)
    monkeypatch.setattr(geometry, "_WEIGHTS", weights)
    assert abs(geometry.cylinder_volume(*args, **ends) - coarse) < 1e-10 * 4 / 3 * np.pi


def test_cylinder_against_monte_carlo():
    rng = np.random.default_rng(5)
    lattice = np.stack(np.meshgrid(*[np.arange(5) * 2.1] * 3), axis=-1).reshape(-1, 3)
    positions = lattice + 0.05 * (rng.random(lattice.shape) - 0.5)  # no two overlap
    axis, radius, low, high = np.array([4.3, 4.0]), 3.4, 0.7, 7.9
    volume = geometry.cylinder_volume(positions, 1.0, axis, radius, low=low, high=high)
    angle, r = 2 * np.pi * rng.random(60_000), radius * np.sqrt(rng.random(60_000))
    points = np.stack(
        [
            axis[0] + r * np.cos(angle),
            axis[1] + r * np.sin(angle),
            low + (high - low) * rng.random(60_000),
        ],
        axis=1,
    )
    nearest = np.min([np.sum((points - p) ** 2, axis=1) for p in positions], axis=0)
    fraction, room = np.mean(nearest < 1), np.pi * radius**2 * (high - low)
    assert abs(volume - fraction * room) < 4 * room * np.sqrt(
        fraction * (1 - fraction) / len(points)
    )


def test_parts_of_a_cylinder_add_up():
    positions = np.random.default_rng(6).random((50, 3)) * 6
    cuts = [-1.0, 0.4, 1.7, 3.3, 7.0]
    volumes = [
        geometry.cylinder_volume(positions, 1.0, (3, 3), 2.2, low=a, high=b)
        for a, b in zip(cuts, cuts[1:], strict=False)
    ]
    total_volume = geometry.cylinder_volume(positions, 1.0, (3, 3), 2.2, low=-1.0, high=7.0)
    # fifty spheres in five calls, each good to 1e-10 of a sphere
    assert sum(volumes) == pytest.approx(total_volume, abs=5 * 50 * 1e-10 * 4.2)


def test_lens_area():
    assert geometry.lens_area(1.0, 1.0, 0.8) == pytest.approx(lens(0.8), rel=EXACT)
    assert geometry.lens_area(1.0, 3.0, 1.5) == pytest.approx(np.pi)
    assert geometry.lens_area(1.0, 3.0, 4.0) == 0
    assert geometry.lens_area(2.0, 0.5, 0.0) == pytest.approx(np.pi / 4)


# Neighbours.


def brute(positions, radii, period):
    """Every image of every grain by itself."""
    reach = max(radii)
    shifts = [
        [0.0]
        if not np.isfinite(e)
        else np.arange(-np.ceil(reach / e) - 1, np.ceil(reach / e) + 2) * e
        for e in period
    ]
    grid = np.stack(np.meshgrid(*shifts, indexing="ij"), axis=-1).reshape(-1, 3)
    distances = np.concatenate(
        [np.linalg.norm(positions[:, None] - positions[None] - shift, axis=-1) for shift in grid]
    )
    return [(np.sum(distances < r) - len(positions) * (r > 0)) / len(positions) for r in radii]


@pytest.mark.parametrize(
    "period", [(np.nan,) * 3, (7.0, 5.0, 6.0), (7.0, np.nan, np.nan), (np.nan, 5.0, 6.0)]
)
def test_neighbours_against_brute_force(period):
    rng = np.random.default_rng(7)
    positions = rng.random((40, 3)) * 9 - 3  # some outside the cell: images are what counts
    wrapped = positions.copy()
    for axis in np.flatnonzero(np.isfinite(period)):
        wrapped[:, axis] %= period[axis]
    radii = [3.0, 1.0, 0.0, 8.0, 2.5]  # beyond the cell, and not in order
    counts = geometry.neighbours_within(positions, radii, period)
    np.testing.assert_allclose(counts, brute(wrapped, radii, period), rtol=1e-13)


def test_neighbours_of_a_lattice():
    """Simple cubic: 6 nearest, 12 next, 8 at the corners; strictly nearer than r_in."""
    lattice = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3)
    radii = [1.0, 1.01, 1.42, 1.74, 2.01]
    counts = geometry.neighbours_within(lattice, radii, (4, 4, 4))
    np.testing.assert_array_equal(counts, [0, 6, 18, 26, 32])
    # a cell of one grain has nothing but its own images around it
    np.testing.assert_array_equal(
        geometry.neighbours_within([[0.5] * 3], radii, [1, 1, 1]), [0, 6, 18, 26, 32]
    )
    # of a lattice each grain has as many neighbours as any other
    some = geometry.neighbours_within(lattice, radii, (4, 4, 4), largest_number=5)
    np.testing.assert_array_equal(some, counts)
    pair = geometry.neighbours_within([[0, 0, 0], [1.5, 0, 0]], [1.0, 2.0])
    np.testing.assert_array_equal(pair, [0, 1])
    single_counts = geometry.neighbours_within([[0.0, 0, 0]], [0.6, 1.1], [None, None, 1.0])
    np.testing.assert_array_equal(single_counts, [0, 2])


def test_radius_of_gyration():
    assert geometry.radius_of_gyration([[1, 2, 3]]) == 0
    assert geometry.radius_of_gyration([[0, 0, 0], [2, 0, 0]]) == pytest.approx(1)
    rod = np.stack([np.arange(11.0), np.zeros(11), np.zeros(11)], axis=1)
    assert geometry.radius_of_gyration(rod) == pytest.approx(np.sqrt((11**2 - 1) / 12))


def test_fragments_are_those_of_a_graph():
    rng = np.random.default_rng(3)
    for count, bonds in ((1, 0), (50, 0), (50, 20), (300, 200), (300, 600)):
        i, j = rng.integers(count, size=(2, bonds))
        graph = coo_array((np.ones(bonds), (i, j)), shape=(count, count))
        number, label = geometry.label_components(np.column_stack([i, j]), count)
        assert number == connected_components(graph, directed=False)[0]
        np.testing.assert_array_equal(label, connected_components(graph, directed=False)[1])
    chain = np.column_stack([np.arange(999), np.arange(1, 1000)])[rng.permutation(999)]
    assert geometry.label_components(chain, 1000)[0] == 1
