"""Collisions: momentum, impact parameter, and the first touch where it is said to be."""

import math

import netCDF4
import numpy as np
import pytest
import snapshots
from bodies import D, R, made
from scipy.spatial.distance import cdist

from dusttaichi.results.integrity import DIGEST

TARGET = {"kind": "pca", "grains": 120}
PROJECTILE = {"kind": "bcca", "grains": 64, "seed": 3}


def collision(**keys):
    usual = {"target": TARGET, "projectile": PROJECTILE, "speed": "2 m/s"}
    return made("collision", **usual | keys)


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


def turned(positions):
    """Distances of consecutive grains do not change when a body turns; directions do."""
    return np.diff(positions, axis=0)


def test_orientation():
    alone = made(**TARGET).positions
    given, _ = parts(collision(orientation="as given"))
    random, _ = parts(collision())
    other, _ = parts(collision(seed=2))
    np.testing.assert_allclose(turned(given), turned(alone), atol=1e-19)
    for body in (random, other):
        np.testing.assert_allclose(
            np.linalg.norm(turned(body), axis=1), np.linalg.norm(turned(alone), axis=1), rtol=1e-9
        )
        assert np.abs(turned(body) - turned(alone)).max() > R
    assert np.abs(turned(random) - turned(other)).max() > R
    # A turn and no mirror image: the volume of three edges keeps its sign.
    volume = [np.linalg.det(turned(body)[:3]) for body in (random, other, alone)]
    np.testing.assert_allclose(volume, volume[2], rtol=1e-6)


def test_info_holds_both_bodies():
    info = collision().info
    assert info["target"]["kind"] == "pca" and info["projectile"]["kind"] == "bcca"
    assert info["target"]["filling_factor"] > info["projectile"]["filling_factor"]


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


def test_grains_can_collide():
    grain = {"kind": "chain", "grains": 1}
    sample = collision(target=grain, projectile=grain, impact_parameter=0.5, gap="0 m")
    assert closest_after(sample, 0) == pytest.approx(2 * R, rel=1e-12)
    assert sample.positions[1, 1] - sample.positions[0, 1] == pytest.approx(R)
