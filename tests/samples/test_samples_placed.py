"""Grains placed by a rule: pairs, chains, lattices and random packings."""

from functools import partial
from itertools import product

import numpy as np
import pytest
from bodies import ROUNDING, D, R, make_sample, periodic_distances, refuse_sample

pair = partial(make_sample, "pair")
lattice = partial(make_sample, "lattice")
packing = partial(make_sample, "random_packing")

# Pairs and chains.


def test_default_is_equilibrium_contact_at_rest_and_chains_are_along_z():
    sample = pair()
    np.testing.assert_allclose(sample.positions, [[-D / 2, 0, 0], [D / 2, 0, 0]], rtol=1e-15)
    assert not sample.velocities.any() and not sample.spins.any()
    assert sample.info["coordination"] == 1
    sample = pair(spins=[["1e5 rad/s", "0 rad/s", "0 rad/s"], ["0 rad/s", "0 rad/s", "-2 rad/us"]])
    assert sample.spins.tolist() == [[1e5, 0, 0], [0, 0, -2e6]]
    assert make_sample("chain", grains=2).positions[1, 2] == pytest.approx(D)


@pytest.mark.parametrize(
    "keys, distance",
    [({"distance": "1.5 um"}, 1.5e-6), ({"gap": "2 nm"}, 2 * R + 2e-9), ({"gap": "-1 pm"}, None)],
)
def test_distance_and_gap(keys, distance):
    distance = distance or 2 * R - 1e-12
    sample = pair(**keys)
    found = np.linalg.norm(sample.positions[1] - sample.positions[0])
    assert found == pytest.approx(distance, rel=1e-14)
    assert sample.info["distance"] == found
    assert sample.info["gap"] == pytest.approx(found - 2 * R, abs=1e-20)


@pytest.mark.parametrize(
    "keys, impact",
    [
        ({"impact_parameter": 0.5}, R),
        ({"impact_parameter": "0.3 um"}, 0.3e-6),
        ({"impact_parameter": 1}, 2 * R),
        ({"angle": "30 deg"}, (2 * R + 5e-9) / 2),
        ({"angle": "0 rad"}, 0.0),
    ],
)
def test_impact_parameter_is_that_of_the_lines_of_flight(keys, impact):
    sample = pair(gap="5 nm", speed="2 m/s", **keys)
    apart = sample.positions[1] - sample.positions[0]
    speed = sample.velocities[1] - sample.velocities[0]
    assert np.linalg.norm(apart) == pytest.approx(2 * R + 5e-9, rel=1e-14)
    assert speed.tolist() == [-2, 0, 0]  # grain 1 is ahead on x and comes closer
    assert apart[0] > 0
    # Angular momentum of a unit mass over its momentum.
    assert np.cross(apart, speed)[2] / 2 == pytest.approx(impact, abs=1e-20)
    assert sample.info["impact_parameter"] == pytest.approx(impact, rel=1e-12)
    assert sample.velocities.sum(axis=0).tolist() == [0, 0, 0]
    np.testing.assert_allclose(sample.positions.sum(axis=0), 0, atol=1e-21)


@pytest.mark.parametrize("axis", "xyz")
def test_chain_is_straight_and_in_contact(axis):
    sample = make_sample("chain", grains=50, axis=axis)
    x = sample.positions
    along = "xyz".index(axis)
    assert x[:, [k for k in range(3) if k != along]].any() == np.False_
    np.testing.assert_allclose(np.diff(x[:, along]), D, rtol=1e-12)
    assert x[0].tolist() == [0, 0, 0]
    assert sample.info["coordination"] == pytest.approx(2 * 49 / 50)
    # Rods: R_g^2 = (n^2 - 1) D^2/12 + (3/5) r^2.
    expected = np.sqrt((50**2 - 1) * D**2 / 12 + 0.6 * R**2)
    assert sample.info["radius_of_gyration"] == pytest.approx(expected, rel=1e-12)


# Lattices.

# Neighbours in contact, and filling factor of touching spheres.
KNOWN = {
    "sc": (6, np.pi / 6),
    "bcc": (8, np.sqrt(3) * np.pi / 8),
    "fcc": (12, np.pi / np.sqrt(18)),
    "ccp": (12, np.pi / np.sqrt(18)),
}


@pytest.mark.parametrize("structure", KNOWN)
def test_every_grain_has_its_neighbours_across_the_period(structure):
    neighbours, filling = KNOWN[structure]
    sample = lattice(structure=structure, cells=[4, 3, 3])
    # All 27 images by hand, with no minimum image.
    period = np.array(sample.info["period"])
    images = np.array(list(product((-1, 0, 1), repeat=3))) * period
    x = sample.positions
    apart = np.linalg.norm(x[:, None, None] - x[None, :, None] - images, axis=-1)
    apart[apart < ROUNDING] = np.inf
    assert apart.min() >= D - ROUNDING
    touching = np.count_nonzero(apart <= D + ROUNDING, axis=(1, 2))
    assert (touching == neighbours).all()
    # Centres are 2r - delta0 apart and not 2r.
    assert sample.info["filling_factor"] == pytest.approx(filling * (2 * R / D) ** 3, rel=1e-12)
    assert sample.info["filling_factor_in"] == "periodic cell"


def test_ccp_is_fcc_with_close_packed_layers_across_z():
    x = lattice(structure="ccp", cells=[4, 2, 2]).positions
    layers, count = np.unique(np.round(x[:, 2] / (D * np.sqrt(2 / 3)), 9), return_counts=True)
    np.testing.assert_allclose(layers, np.arange(6), atol=1e-9)
    assert (count == 16).all()
    # Stacked ABC and not AB: no grain stands over one two layers below.
    first, third = x[x[:, 2] < 0.1 * D], x[np.abs(x[:, 2] - 2 * D * np.sqrt(2 / 3)) < 0.1 * D]
    sideways = np.linalg.norm(first[:, None, :2] - third[None, :, :2], axis=-1)
    assert sideways.min() == pytest.approx(D / np.sqrt(3), rel=1e-9)


def test_cells_make_the_grains_and_exact_sizes_hold_them():
    for structure, basis in (("sc", 1), ("bcc", 2), ("fcc", 4), ("ccp", 6)):
        sample = lattice(structure=structure, cells=[2, 3, 4])
        assert len(sample) == sample.info["grains"] == 24 * basis
        assert sample.info["cells"] == [2, 3, 4]
        assert not sample.velocities.any() and not sample.spins.any()
    edge = f"{(9 * D + 2 * R) * 1e6!r} um"
    assert lattice(structure="sc", size=[edge] * 3).info["cells"] == [10, 10, 10]
    info = lattice(structure="sc", cells=[10, 10, 10]).info
    assert info["coordination"] == pytest.approx(2 * 3 * 9 * 100 / 1000)


@pytest.mark.parametrize("structure", KNOWN)
@pytest.mark.parametrize("grains", [1, 7, 500, 1000, 3001])
def test_grains_are_rounded_up_to_whole_cells_of_about_a_cube(structure, grains):
    info = lattice(structure=structure, grains=grains).info
    basis = info["grains"] / np.prod(info["cells"])
    edges, cells = np.array(info["period"]), np.array(info["cells"])
    assert info["grains"] >= grains
    # The last layer of cells was needed, and edges differ by one cell at most.
    assert any(basis * np.prod(cells - axis) < grains for axis in np.eye(3))
    assert edges.max() - edges.min() <= (edges / cells).max() * (1 + 1e-9)


@pytest.mark.parametrize("structure", KNOWN)
def test_size_is_filled_and_kept(structure):
    size = np.array([9e-6, 12e-6, 10.5e-6])
    sample = lattice(structure=structure, size=[f"{edge * 1e6} um" for edge in size])
    info = sample.info
    extent = np.ptp(sample.positions, axis=0) + 2 * R
    assert (extent <= size * (1 + 1e-12)).all()
    assert (extent + np.array(info["period"]) / info["cells"] > size).all()


def test_vacancies_are_sites_without_a_grain():
    keys = {"structure": "fcc", "cells": [3, 3, 3]}
    sites = {tuple(row) for row in np.round(lattice(**keys).positions / D, 9)}
    lattices = [lattice(**keys, vacancies=0.25, seed=seed) for seed in (1, 2)]
    first, second = ({tuple(row) for row in np.round(s.positions / D, 9)} for s in lattices)
    assert len(first) == len(second) == 81 and first < sites and second < sites and first != second
    assert lattices[0].info["period"] == lattice(**keys).info["period"]
    assert "it is allowed only together with vacancies" in refuse_sample(
        kind="lattice", **keys, seed=1
    )


# Random packings: no overlap beyond that of a contact at rest, at the requested filling factor.


@pytest.mark.parametrize("grains, filling", [(1, 0.05), (300, 0.1), (250, 0.6), (100, 0.6)])
def test_no_overlap_beyond_equilibrium_with_images(grains, filling):
    sample = packing(grains=grains, filling_factor=filling)
    info, x = sample.info, sample.positions
    period = np.array(info["period"])
    assert len(x) == info["grains"] == grains
    assert ((x >= 0) & (x < period)).all()
    # Distances across the period carry the rounding of the cell's edge.
    apart = periodic_distances(x, period)
    assert apart.min() >= D - 1e-14 * period.max()
    assert info["closest"] == pytest.approx(apart.min(), rel=1e-12)
    assert info["filling_factor"] == pytest.approx(filling, rel=1e-12)
    assert not sample.velocities.any() and not sample.spins.any()


def test_dense_packing_is_in_contact_and_random():
    sample = packing(grains=400, seed=2)
    period = np.array(sample.info["period"])
    apart = periodic_distances(sample.positions, period)
    # At random close packing there would be 6 contacts a grain; of points that keep off each
    # other otherwise evenly 0.01, as the shell between D and 2 r is so thin.
    contacts = np.count_nonzero(apart <= 2 * R, axis=1).mean()
    assert 2.5 < contacts < 6
    # No crystal: fcc would have nothing between D and 1.41 D, a random packing has a third there.
    between = np.count_nonzero((apart > 1.1 * D) & (apart < 1.35 * D), axis=1).mean()
    assert between > 2
    sample = packing(size=["10 um", "12 um", "8 um"], filling_factor=0.5)
    period = np.array(sample.info["period"])
    np.testing.assert_allclose(period, [10e-6, 12e-6, 8e-6], rtol=1e-15)
    # Met to one grain.
    assert 0 <= 0.5 - sample.info["filling_factor"] < 4 / 3 * np.pi * R**3 / period.prod()
    assert periodic_distances(sample.positions, period).min() >= D - 1e-14 * period.max()
