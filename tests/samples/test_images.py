"""Samples in a periodic cell: contacts, fragments, sizes with the images, as the run has them."""

import numpy as np
import pytest
from bodies import D, R, periodic_distances
from scenes import make_scene

from dusttaichi import samples
from dusttaichi.grains.build import build, prepare
from dusttaichi.grains.preview import preview
from dusttaichi.physics.geometry import label_components, nearest_image
from dusttaichi.physics.unwrap import crossings, unwrap_fragments
from dusttaichi.samples.images import Cell

CELL = {"kind": "periodic"}
WIDE = {"kind": "periodic", "size": ["10 um"] * 3}


def place_sample(boundary, **sample):
    """The Prepared of a scene and its rows in `dust check`."""
    scene = make_scene(sample=sample, boundary=boundary)
    return prepare(scene, samples.make(scene)), dict(preview(scene).sections[0][1])


def place_at(*rows):
    """A sample of grains at these places [um], as they are."""
    rows = [[f"{a:.9f} um" for a in row] for row in rows]
    return {"kind": "explicit", "positions": rows, "touch_within": 0}


CHAIN = [[x % 10.0, 5.0, 5.0] for x in 1e6 * D * np.arange(5) + 7.0]  # across the face
RING = [[x, 5.0, 5.0] for x in 1e6 * D * np.arange(8)]
PACKING = {"kind": "random_packing", "grains": 60, "filling_factor": 0.4, "seed": 2}
CAKE = {"kind": "rbd", "grains": 60, "periodic": True, "seed": 1}
SC = {"kind": "lattice", "structure": "sc", "cells": [3, 3, 3]}
CUBE = CELL | {"size": "cube"}
WALLED = CELL | {"axes": ["x", "y"], "walls": ["bottom", "top"]}

# boundary, sample, fragments (None: by brute force), axes along which they percolate
SCENES = {
    "chain": (WIDE, place_at(*CHAIN), 1, ""),
    "ring": (CELL | {"axes": ["x"]}, place_at(*RING), 1, "x"),
    "packing": (CELL, PACKING, None, ""),
    "cake": (WALLED, CAKE, None, ""),
    "cubic": (CELL, SC, 1, "x y z"),
    "cubic in a larger cell": (WIDE, SC, 1, ""),
    "cubic, periodic along x and y": (CELL | {"axes": ["x", "y"]}, SC, 1, "x y"),
    "aggregate in a fitted cell": (CELL, {"kind": "pca", "grains": 60, "seed": 3}, None, None),
    "aggregate in a cube": (CUBE, {"kind": "pca", "grains": 60, "seed": 3}, None, None),
}


@pytest.mark.parametrize("name", SCENES)
def test_numbers_of_a_cell_are_those_of_all_images(name):
    boundary, sample, fragments, along = SCENES[name]
    parts, rows = place_sample(boundary, **sample)
    info, cell, x = parts.sample.info, parts.domain.cell, parts.sample.positions
    period = np.where(np.isin(range(3), cell.axes), cell.edges(0.0) * 1e-6, 1.0)  # 1 m: open
    i, j = np.nonzero(np.triu(periodic_distances(x, period) <= 2 * R))
    number = label_components(np.column_stack([i, j]), len(x))[0]
    network = info["network"]
    assert network["contacts"] == len(i) and network["fragments"] == number
    assert number == fragments or fragments is None
    assert info["coordination"] == pytest.approx(2 * len(i) / len(x))
    assert network.get("along", "") == along or along is None
    if parts.domain.bounded and len(cell.axes) == 3:
        filling = parts.domain.clock().filling_factor_at(0)
        assert info["filling_factor"] == pytest.approx(filling, rel=1e-12)
        assert float(rows["filling factor of the periodic cell"]) == pytest.approx(
            filling, rel=1e-3
        )
    text = f"{len(i)} contact{'s' * (len(i) != 1)} in {number} fragment{'s' * (number != 1)}"
    assert rows["contacts"] == text
    assert ("percolates" in rows) == bool(network.get("along"))


@pytest.mark.parametrize("name", ["chain", "packing", "cubic", "aggregate in a fitted cell"])
def test_check_counts_what_the_run_counts(name):
    boundary, sample, *_ = SCENES[name]
    scene = make_scene(sample=sample, boundary=boundary)
    sim = build(scene, samples.make(scene))
    assert sim.ledger.measure_energies()["contacts"] == sim.sample_info["network"]["contacts"]


def test_a_chain_across_a_face_is_as_long_as_elsewhere():
    parts, rows = place_sample(WIDE, **place_at(*CHAIN))
    alone = samples.make(
        make_scene(sample={"kind": "chain", "grains": 5, "axis": "x"}, boundary={"kind": "open"})
    )
    info = parts.sample.info
    assert info["radius_of_gyration"] == pytest.approx(alone.info["radius_of_gyration"], rel=1e-6)
    assert info["radius_of_gyration"] == pytest.approx(1.76e-6, rel=1e-3)
    np.testing.assert_allclose(info["extent"], alone.info["extent"], rtol=1e-6)
    assert rows["radius of gyration"] == "1.759 µm" and rows["extent"] == "5.999 x 1.2 x 1.2 µm"
    assert rows["periodic cell"] == "10 x 10 x 10 µm"
    assert float(rows["filling factor of the periodic cell"]) == pytest.approx(0.004524)


def test_a_fragment_that_percolates_has_no_radius_of_gyration():
    _, rows = place_sample(CELL | {"axes": ["x"]}, **place_at(*RING))
    assert rows["percolates"] == "connected to its own images along x"
    assert rows["radius of gyration"] == "none, since it percolates"
    assert rows["extent"] == f"{8 * 1e6 * D:.4g} x 1.2 x 1.2 µm"
    assert rows["filling factor of the bounding box, periodic along x"] == "0.5237"
    # beside a larger fragment that does not
    block = [[2.0 + 1.199 * a, 7.0 + 1.199 * b, 1.0] for a in range(4) for b in range(3)]
    _, rows = place_sample(
        WIDE | {"size": [f"{8e6 * D:.12f} um", "20 um", "10 um"]}, **place_at(*RING, *block)
    )
    assert rows["percolates"] == "1 of 2 fragments: connected to its own images along x"
    assert rows["extent of the largest fragment"] == "4.797 x 3.598 x 1.2 µm"


def test_a_tilted_cell_has_its_images():
    """A grain above the cell, whose image is shifted by the tilt."""
    cell = Cell(np.array([10.0, 10.0, 10.0]), 3.0)
    x = np.array([[9.0, 5.0, 9.6], [6.0, 5.0, 0.6], [2.0, 5.0, 3.0], [35.0, 5.0, 33.0]])
    radii = np.full(4, 0.6)
    np.testing.assert_array_equal(cell.pairs(x, radii), [[0, 1]])
    shifted = x + np.array([[0, 0, 0], [3, 0, 10], [-7, 20, -10], [0, 0, 0]])
    np.testing.assert_array_equal(cell.pairs(shifted, radii), [[0, 1]])
    alone = unwrap_fragments(shifted, [[0, 1]], [0, 2, 3], cell.nearest)
    assert np.linalg.norm(alone[0] - alone[1]) == pytest.approx(1.0)


@pytest.mark.parametrize("tilt", [0.0, 2.0])
def test_scattered_trees_are_put_together(tilt):
    rng = np.random.default_rng(4)
    x = np.cumsum(rng.uniform(-1.0, 1.0, (200, 3)), axis=0)
    x[100:] += 3.0
    pairs = np.column_stack([np.arange(199), np.arange(1, 200)])
    pairs = np.delete(pairs, 99, axis=0)  # two trees
    period = np.array([8.0, np.inf, 9.0])
    vectors = np.array([[8.0, 0, 0], [0, 0, 0], [tilt, 0, 9.0]])
    scattered = x + rng.integers(-2, 3, (200, 3)) @ vectors
    together = unwrap_fragments(
        scattered, pairs, [0, 100], lambda d: nearest_image(d, period, tilt)
    )
    for body_slice in (slice(0, 100), slice(100, 200)):
        shift = together[body_slice] - x[body_slice]
        np.testing.assert_allclose(shift, np.tile(shift[0], (100, 1)), atol=1e-12)
    np.testing.assert_array_equal(together[[0, 100]], scattered[[0, 100]])


def test_crossings_name_the_axes():
    period = np.array([10.0, 10.0, 10.0])
    x = np.array([[1.0, 0, 0], [9.0, 0, 0], [5.0, 0, 0], [1.0, 9.5, 9.5]])
    pairs = [[0, 1], [1, 2], [0, 3]]
    nearest = lambda d: nearest_image(d, period, 2.0)  # noqa: E731
    axes = crossings(x, pairs, nearest, period, 2.0)
    np.testing.assert_array_equal(
        axes != 0, [[True, False, False], [False] * 3, [False, True, True]]
    )


def test_stored_contacts_across_faces_that_a_scene_lacks_are_none():
    """A contact of a periodic run, whose grains are an edge apart in open space."""
    x = 1e-6 * np.array([[0.2, 5, 5], [9.2, 5, 5]])
    stored = {"i": np.array([0]), "j": np.array([1])}
    sample = samples.Sample(x, np.zeros((2, 3)), np.zeros((2, 3)), stored)
    assert samples.describe(sample, R, 2 * R)["network"] == {"contacts": 0, "fragments": 2}
    cell = samples.Cell(np.array([1e-5, np.inf, np.inf]))
    description = samples.describe(sample, R, 2 * R, cell)
    assert description["network"] == {"contacts": 1, "fragments": 1}
    assert description["filling_factor_in"] == "bounding box, periodic along x"
