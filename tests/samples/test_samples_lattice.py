"""Lattices: contacts, filling factors, and that they go on across the period."""

from itertools import product

import numpy as np
import pytest
from bodies import ROUNDING, D, R, refused, scene

from dusttaichi.samples import make

# Neighbours in contact, and filling factor of touching spheres.
KNOWN = {
    "sc": (6, np.pi / 6),
    "bcc": (8, np.sqrt(3) * np.pi / 8),
    "fcc": (12, np.pi / np.sqrt(18)),
    "ccp": (12, np.pi / np.sqrt(18)),
}


def lattice(**keys):
    return make(scene(kind="lattice", **keys))


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


def test_coordination_in_info_is_of_the_grains_as_they_stand():
    info = lattice(structure="sc", cells=[10, 10, 10]).info
    assert info["coordination"] == pytest.approx(2 * 3 * 9 * 100 / 1000)


def test_ccp_is_fcc_with_close_packed_layers_across_z():
    x = lattice(structure="ccp", cells=[4, 2, 2]).positions
    layers, count = np.unique(np.round(x[:, 2] / (D * np.sqrt(2 / 3)), 9), return_counts=True)
    np.testing.assert_allclose(layers, np.arange(6), atol=1e-9)
    assert (count == 16).all()
    # Stacked ABC and not AB: no grain stands over one two layers below.
    first, third = x[x[:, 2] < 0.1 * D], x[np.abs(x[:, 2] - 2 * D * np.sqrt(2 / 3)) < 0.1 * D]
    sideways = np.linalg.norm(first[:, None, :2] - third[None, :, :2], axis=-1)
    assert sideways.min() == pytest.approx(D / np.sqrt(3), rel=1e-9)


def test_cells_make_the_grains():
    for structure, basis in (("sc", 1), ("bcc", 2), ("fcc", 4), ("ccp", 6)):
        sample = lattice(structure=structure, cells=[2, 3, 4])
        assert len(sample) == sample.info["grains"] == 24 * basis
        assert sample.info["cells"] == [2, 3, 4]
        assert not sample.velocities.any() and not sample.spins.any()


@pytest.mark.parametrize("structure", KNOWN)
@pytest.mark.parametrize("grains", [1, 7, 500, 1000, 3001])
def test_grains_are_rounded_up_to_whole_cells_of_about_a_cube(structure, grains):
    info = lattice(structure=structure, grains=grains).info
    basis = info["grains"] / np.prod(info["cells"])
    edges, cells = np.array(info["period"]), np.array(info["cells"])
    assert info["grains"] >= grains
    # The last layer of cells was needed, and edges differ by one cell at most.
    assert any(basis * np.prod(cells - one) < grains for one in np.eye(3))
    assert edges.max() - edges.min() <= (edges / cells).max() * (1 + 1e-9)


@pytest.mark.parametrize("structure", KNOWN)
def test_size_is_filled_and_kept(structure):
    size = np.array([9e-6, 12e-6, 10.5e-6])
    sample = lattice(structure=structure, size=[f"{edge * 1e6} um" for edge in size])
    info = sample.info
    extent = np.ptp(sample.positions, axis=0) + 2 * R
    assert (extent <= size * (1 + 1e-12)).all()
    assert (extent + np.array(info["period"]) / info["cells"] > size).all()


def test_exact_size_holds_its_cells():
    edge = f"{(9 * D + 2 * R) * 1e6!r} um"
    assert lattice(structure="sc", size=[edge] * 3).info["cells"] == [10, 10, 10]


def test_vacancies_are_sites_without_a_grain():
    keys = {"structure": "fcc", "cells": [3, 3, 3]}
    sites = {tuple(row) for row in np.round(lattice(**keys).positions / D, 9)}
    found = [lattice(**keys, vacancies=0.25, seed=seed) for seed in (1, 2)]
    one, other = ({tuple(row) for row in np.round(s.positions / D, 9)} for s in found)
    assert len(one) == len(other) == 81 and one < sites and other < sites and one != other
    assert found[0].info["period"] == lattice(**keys).info["period"]
    assert "it is allowed only together with vacancies" in refused(kind="lattice", **keys, seed=1)
