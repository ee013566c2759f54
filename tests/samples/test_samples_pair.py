"""Pairs and chains."""

import numpy as np
import pytest
from bodies import D, R, scene

from dusttaichi.samples import make


def pair(**keys):
    return make(scene(kind="pair", **keys))


def test_default_is_equilibrium_contact_at_rest():
    sample = pair()
    np.testing.assert_allclose(sample.positions, [[-D / 2, 0, 0], [D / 2, 0, 0]], rtol=1e-15)
    assert not sample.velocities.any() and not sample.spins.any()
    assert sample.info["coordination"] == 1


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


def test_spins():
    sample = pair(spins=[["1e5 rad/s", "0 rad/s", "0 rad/s"], ["0 rad/s", "0 rad/s", "-2 rad/us"]])
    assert sample.spins.tolist() == [[1e5, 0, 0], [0, 0, -2e6]]


@pytest.mark.parametrize("axis", "xyz")
def test_chain_is_straight_and_in_contact(axis):
    sample = make(scene(kind="chain", grains=50, axis=axis))
    x = sample.positions
    along = "xyz".index(axis)
    assert x[:, [k for k in range(3) if k != along]].any() == np.False_
    np.testing.assert_allclose(np.diff(x[:, along]), D, rtol=1e-12)
    assert x[0].tolist() == [0, 0, 0]
    assert sample.info["coordination"] == pytest.approx(2 * 49 / 50)
    # Rods: R_g^2 = (n^2 - 1) D^2/12 + (3/5) r^2.
    expected = np.sqrt((50**2 - 1) * D**2 / 12 + 0.6 * R**2)
    assert sample.info["radius_of_gyration"] == pytest.approx(expected, rel=1e-12)


def test_chain_is_along_z_by_default():
    assert make(scene(kind="chain", grains=2)).positions[1, 2] == pytest.approx(D)
