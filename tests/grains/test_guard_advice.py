"""What the guards of grains advise: the speed that a user can lower, the grains in question."""

from types import SimpleNamespace

import numpy as np
import pytest

from dusttaichi.errors import GuardStop
from dusttaichi.grains.validity import name_invalid, validate


def make_engine(*, wall=0.0, closing=0.0):
    """(measurement, run, motion, contacts) of two grains whose contact is 0.2 of a radius deep."""
    parts = {"largest_strain": 0.2}
    domain = SimpleNamespace(fastest_wall=wall)
    environment = SimpleNamespace(domain=domain, closing_speed=lambda: closing, box=None)
    pairs = {"grain_i": np.array([0]), "grain_j": np.array([1]), "overlap": np.array([0.2])}
    contacts = SimpleNamespace(
        measure_pairs=lambda: pairs, grain_count=2, smaller_radius=lambda i, j: np.ones(1)
    )
    run = SimpleNamespace(step=3, time=1e-6, units=lambda name: 1.0, suspect="")
    measurement = SimpleNamespace(parts=parts, energy=1.0)
    return measurement, run, SimpleNamespace(environment=environment), contacts


@pytest.mark.parametrize(
    ("speeds", "sphere", "advice"),
    [
        ({"wall": 1.0}, None, "a lower wall speed"),
        ({"closing": 1.0}, None, "a lower strain rate"),
        ({}, object(), "a lower speed of the sphere"),
        ({}, None, "a lower impact speed"),
    ],
)
def test_it_names_the_speed_of_the_scene(speeds, sphere, advice):
    with pytest.raises(GuardStop, match=rf"grains 0 and 1 the deepest.*Try {advice}, an earlier"):
        validate(*make_engine(**speeds), sphere)


def test_it_names_the_grains_that_are_not_numbers():
    values = np.zeros((3, 5, 3))
    motion = SimpleNamespace(measure=lambda: values)
    assert name_invalid(motion) == ""
    values[0, 2, 1] = values[1, 4, 0] = np.nan
    assert name_invalid(motion) == " (grain 2 first of 2)"
    assert name_invalid(motion, slice(3, 5)) == " (grain 1 first of 1)"  # of a member, from 0 on
