"""Bodies cut from samples; collisions: momentum, impact parameter, and the first touch."""

import math
from itertools import combinations

import netCDF4
import numpy as np
import pytest
import snapshots
from bodies import D, R, make_sample, pieces, refuse_sample, um
from scipy.spatial.distance import cdist

from dusttaichi.results.integrity import DIGEST

TARGET = {"kind": "pca", "grains": 120}
PROJECTILE = {"kind": "bcca", "grains": 64, "seed": 3}


def collision(**keys):
    usual = {"target": TARGET, "projectile": PROJECTILE, "speed": "2 m/s"}
    return make_sample("collision", **usual | keys)


def parts(sample):
    n = sample.info["target_grains"]
    return sample.positions[:n], sample.positions[n:]


def closest_after(sample, flight):
    """Smallest distance of the bodies after so much relative flight."""
    target, projectile = parts(sample)
    return cdist(target, projectile - [flight, 0, 0]).min()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("impact", [0, 0.3, "3 um"])
@pytest.mark.parametrize("gap", [None, "20 nm", "5 um"])
def test_first_touch_is_where_it_is_said_to_be(seed, impact, gap):
    keys = {} if gap is None else {"gap": gap}
    sample = collision(impact_parameter=impact, seed=seed, **keys)
    info = sample.info
    if not info["hit"]:  # then they never touch, found on a fine path
        path = np.arange(0, 100e-6, 0.2 * R)
        assert min(closest_after(sample, flight) for flight in path) > 2 * R
        return
    expected = {None: R, "20 nm": 20e-9, "5 um": 5e-6}[gap]
    assert info["gap"] == pytest.approx(expected)
    assert info["time_to_touch"] == pytest.approx(expected / 2)
    # Lengths of 1e-5 m carry 1e-21 m; a grazing touch multiplies that by a few.
    assert closest_after(sample, info["gap"]) == pytest.approx(2 * R, abs=1e-18)
    path = np.linspace(0, info["gap"], 50)[:-1]
    assert min(closest_after(sample, flight) for flight in path) > 2 * R


def test_centre_of_mass_rests():
    sample = collision(impact_parameter=0.2)
    target, projectile = parts(sample)
    assert len(target) == 120 and len(projectile) == 64
    # Numbers of order 1 m/s and 1e-5 m, rounded; 184 of each, added exactly.
    for vectors, size in ((sample.velocities, 1.0), (sample.positions, 1e-5)):
        total = [math.fsum(component) for component in vectors.T]
        np.testing.assert_allclose(total, 0, atol=184 * 1e-15 * size)
    relative = sample.velocities[-1] - sample.velocities[0]
    np.testing.assert_allclose(relative, [-2, 0, 0], rtol=1e-15)
    assert (sample.velocities[:120] == sample.velocities[0]).all()
    info = collision().info
    assert info["target"]["kind"] == "pca" and info["projectile"]["kind"] == "bcca"
    assert info["target"]["filling_factor"] > info["projectile"]["filling_factor"]


@pytest.mark.parametrize("impact", [0, 0.25, "7 um"])
def test_impact_parameter(impact):
    sample = collision(impact_parameter=impact)
    target, projectile = parts(sample)
    apart = projectile.mean(axis=0) - target.mean(axis=0)
    outer = [np.linalg.norm(x - x.mean(axis=0), axis=1).max() + R for x in (target, projectile)]
    expected = 7e-6 if impact == "7 um" else impact * sum(outer)
    np.testing.assert_allclose(apart[1:], [expected, 0], atol=1e-19)
    assert sample.info["impact_parameter"] == pytest.approx(expected)
    assert sample.info["target_outer_radius"] == pytest.approx(outer[0])


def test_miss_is_said():
    sample = collision(impact_parameter=1.01, gap="1 um")
    target, projectile = parts(sample)
    assert sample.info["hit"] == 0 and "time_to_touch" not in sample.info
    between = projectile[:, 0].min() - target[:, 0].max() - 2 * R
    assert between == pytest.approx(1e-6, rel=1e-9)
    grain = {"kind": "chain", "grains": 1}
    sample = collision(target=grain, projectile=grain, impact_parameter=0.5, gap="0 m")
    assert closest_after(sample, 0) == pytest.approx(2 * R, rel=1e-12)
    assert sample.positions[1, 1] - sample.positions[0, 1] == pytest.approx(R)


def list_distances(positions):
    """Distances of consecutive grains do not change when a body turns; directions do."""
    return np.diff(positions, axis=0)


def test_orientation():
    alone = make_sample(**TARGET).positions
    fixed, _ = parts(collision(orientation="as given"))
    random, _ = parts(collision())
    second, _ = parts(collision(seed=2))
    np.testing.assert_allclose(list_distances(fixed), list_distances(alone), atol=1e-19)
    for body in (random, second):
        np.testing.assert_allclose(
            np.linalg.norm(list_distances(body), axis=1),
            np.linalg.norm(list_distances(alone), axis=1),
            rtol=1e-9,
        )
        assert np.abs(list_distances(body) - list_distances(alone)).max() > R
    assert np.abs(list_distances(random) - list_distances(second)).max() > R
    # A turn and no mirror image: the volume of three edges keeps its sign.
    volume = [np.linalg.det(list_distances(body)[:3]) for body in (random, second, alone)]
    np.testing.assert_allclose(volume, volume[2], rtol=1e-6)


def test_bodies_that_move_and_have_contacts(tmp_path):
    # A body from another run: its drift goes, its spins and the pointers of its contacts turn.
    pair = {"pairs": [[0, 1]], "twist": [0.1]}
    pair |= {"pointer_i": [[0, 0, 1]], "pointer_j": [[0, 0, -1]]}
    grains = {"position": [[0, 0, 0], [0, 0, D]], "velocity": [[3, 0, 1], [3, 0, -1]]}
    grains |= {"spin": [[0, 0, 5], [0, 0, 0]]}
    snapshots.write(tmp_path / "body.nc", [grains | pair], R)
    with netCDF4.Dataset(tmp_path / "body.nc", "a") as data:
        data.delncattr(DIGEST)
        contacts = data["contacts"]
        # of an effect of its own, whose vector turns as well; one of no effect stays behind
        for name, mark in (("bending", "contact_history"), ("other", "comment")):
            contacts.createVariable(name, "f8", contacts["pointer_i"].dimensions)[0] = [0, 0, 2]
            contacts[name].setncattr(mark, "kept")
    body = {"kind": "explicit", "file": str(tmp_path / "body.nc")}
    chain = {"kind": "chain", "grains": 3}
    sample = collision(target=chain, projectile=body)
    held = sample.contacts
    assert held["i"].tolist() == [3] and held["j"].tolist() == [4]
    line = (sample.positions[4] - sample.positions[3]) / D
    np.testing.assert_allclose(held["pointer_i"][0], line, atol=1e-9)
    np.testing.assert_allclose(held["pointer_j"][0], -line, atol=1e-9)
    np.testing.assert_allclose(held["bending"][0], 2 * line, atol=1e-9)
    assert "other" not in held
    np.testing.assert_allclose(sample.spins[3], 5 * line, atol=1e-8)
    np.testing.assert_allclose(sample.velocities[3] - sample.velocities[4], 2 * line, atol=1e-9)
    np.testing.assert_allclose(sample.velocities.sum(axis=0), 0, atol=1e-14)
    assert sample.info["coordination"] == pytest.approx(2 * 3 / 5)
    both = collision(target=body, projectile=body).contacts
    assert both["i"].tolist() == [0, 2] and both["twist"].tolist() == [0.1, 0.1]


LATTICE = {"kind": "lattice", "structure": "sc", "cells": [9, 9, 9]}


def cutout(of=LATTICE, **keys):
    return make_sample("cutout", of=of, **{"fragments": "all", **keys})


@pytest.mark.parametrize("axis", [None, "x", "y", "z"])
def test_all_grains_whose_centres_are_inside_and_no_others(axis):
    diameter, length = 7.3 * D, 4.1 * D
    keys = {} if axis is None else {"axis": axis, "length": um(length)}
    sample = cutout(diameter=um(diameter), **keys)
    # the lattice of nine sites along each edge, about its middle
    sites = D * (np.stack(np.meshgrid(*[np.arange(9) - 4.0] * 3), -1).reshape(-1, 3))
    along = np.zeros(len(sites)) if axis is None else sites[:, "xyz".index(axis)]
    across = sites if axis is None else np.delete(sites, "xyz".index(axis), axis=1)
    inside = np.linalg.norm(across, axis=1) <= diameter / 2
    inside &= (np.abs(along) <= length / 2) | (axis is None)
    expected = sites[inside]
    assert len(sample) == len(expected) > 50
    order = [np.lexsort(np.round(x / D).T) for x in (sample.positions, expected)]
    np.testing.assert_allclose(
        sample.positions[order[0]], expected[order[1]], rtol=0, atol=1e-9 * D
    )


def test_the_filling_factor_is_that_of_the_bounding_cylinder_about_its_axis():
    sample = cutout(diameter=um(7.3 * D), length=um(4.1 * D))
    assert sample.info["axis"] == "y" and sample.info["filling_factor_in"] == "bounding cylinder"
    # five layers of the 45 sites of a square lattice within 3.65 D: the farthest is (3, 2) D
    assert len(sample) == 5 * 45
    volume = np.pi * (np.sqrt(13) * D + R) ** 2 * (4 * D + 2 * R)
    expected = len(sample) * 4 / 3 * np.pi * R**3 / volume
    assert sample.info["filling_factor"] == pytest.approx(expected, rel=1e-9)
    sphere = cutout(diameter=um(7.3 * D))
    assert sphere.info["filling_factor_in"] == "bounding sphere"
    volume = 4 / 3 * np.pi * (np.sqrt(13) * D + R) ** 3  # (3, 2, 0) D
    expected = len(sphere) * 4 / 3 * np.pi * R**3 / volume
    assert sphere.info["filling_factor"] == pytest.approx(expected, rel=1e-9)
    body = {"kind": "cutout", "of": {"kind": "space_filling", "grains": 400}, "diameter": "9 um"}
    sample = make_sample("collision", target=body, projectile=body, speed="1 m/s")
    assert sample.info["target_grains"] == sample.info["projectile_grains"] > 20


def test_what_the_cut_disconnects_is_left_out():
    of = {"kind": "rbd", "grains": 500, "seed": 1}
    every = cutout(of, diameter="9 um", length="6 um")
    cut = cutout(of, diameter="9 um", length="6 um", fragments="largest")
    assert pieces(every.positions) > 1 and pieces(cut.positions) == 1
    assert cut.info["left_out"] == len(every) - len(cut) > 0 == every.info["left_out"]
    assert cut.info["cut_from"] == 500
    rows = {tuple(row) for row in np.round(every.positions / D, 9)}
    assert {tuple(row) for row in np.round(cut.positions / D, 9)} <= rows
    (text,) = cutout(diameter="8 um", length="20 um").info["remarks"]
    assert text.startswith("sample.of: along y it extends over 10.8 µm, and the cut over 20 µm")
    assert "remarks" not in cutout(diameter="8 um", length="10 um").info


@pytest.fixture(scope="module")
def pressed_result(tmp_path_factory):
    """A result with a lattice of 7^3 sites in a periodic cell: grains touch across all faces, each
    contact with its own history, and move."""
    sites = np.indices((7,) * 3).reshape(3, -1).T
    i = np.repeat(np.arange(343), 3)
    j = ((sites[:, None] + np.eye(3, dtype=int)) % 7 @ [49, 7, 1]).ravel()
    still = np.zeros((343, 3))
    frame = {"position": D * sites, "velocity": still + 1.0, "spin": still + 2.0}
    frame |= {"pairs": np.column_stack([i, j]), "twist": 0.1 * np.arange(3 * 343)}
    frame |= dict.fromkeys(("pointer_i", "pointer_j"), np.tile([0.0, 0.0, 1.0], (3 * 343, 1)))
    box = D * np.array([-0.5, 6.5] * 3)
    path = tmp_path_factory.mktemp("pressed") / "result.nc"
    snapshots.write(path, [frame], R, box=box, periodic="x y z")
    return {"kind": "explicit", "file": str(path)}


def test_contacts_of_a_run_without_those_across_its_faces(pressed_result):
    sample = make_sample("cutout", of=pressed_result, diameter=um(2.3 * D), length=um(6.5 * D))
    # all seven layers of the middle site and its four neighbours
    assert len(sample) == 35 and sample.contacts is not None
    # of the five sites of a layer four touch the middle one; layers touch grain by grain
    assert len(sample.contacts["i"]) == 7 * 4 + 6 * 5
    i, j = sample.contacts["i"], sample.contacts["j"]
    apart = np.linalg.norm(sample.positions[i] - sample.positions[j], axis=1)
    np.testing.assert_allclose(apart, D, rtol=1e-3)
    touching = {
        pair
        for pair in combinations(range(35), 2)
        if np.linalg.norm(np.subtract(*sample.positions[list(pair)])) < 1.01 * D
    }
    assert {tuple(sorted(pair)) for pair in zip(i.tolist(), j.tolist(), strict=True)} == touching


def test_a_sphere_of_grains_about_any_grain_of_a_periodic_cell(pressed_result):
    """A lattice looks the same from each of its sites, across the faces as well: 33 are within two
    spacings of one of them, with 60 pairs at one."""
    lattice = {"kind": "lattice", "structure": "sc", "cells": [7, 7, 7]}
    far = np.sqrt(np.repeat([0, 1, 2, 3, 4], [1, 6, 12, 8, 6]))
    for of in (pressed_result, lattice):
        bodies = [make_sample("cutout", of=of, grains=33, seed=seed) for seed in (1, 2, 1)]
        for body in bodies:
            assert len(body) == 33 and body.info["cut_from"] == 343
            np.testing.assert_allclose(
                np.sort(np.linalg.norm(body.positions, axis=1)) / D, far, atol=1e-9
            )
            assert not body.velocities.any() and not body.spins.any()
            if of is pressed_result:
                i, j = body.contacts["i"], body.contacts["j"]
                apart = np.linalg.norm(body.positions[i] - body.positions[j], axis=1)
                np.testing.assert_allclose(apart, D, rtol=1e-9)
                assert len(set(map(frozenset, zip(i, j, strict=True)))) == len(i) == 60
                assert len(np.unique(body.contacts["twist"])) == 60  # each with its own history
        orders = [body.positions.tolist() for body in bodies]
        assert orders[0] == orders[2] != orders[1]
    middle = cutout(grains=7)
    assert len(middle) == 7 and middle.info["filling_factor_in"] == "bounding sphere"
    # a sphere of 3 spacings, and a contact, reach the image of the sphere: 7 edges
    for of in (pressed_result, lattice):
        output = refuse_sample(kind="cutout", of=of, grains=123, seed=1)
        assert "wider than the cell of sample.of; allowed: up to" in output
