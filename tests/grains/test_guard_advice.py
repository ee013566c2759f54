"""Advice of guards: a speed to lower, grains in question, a box too full, a skin too large."""

from types import SimpleNamespace

import numpy as np
import pytest
from scenes import FAR, RADIUS, make_scene, sample_of

from dusttaichi.errors import GuardStop
from dusttaichi.grains.build import build
from dusttaichi.grains.validity import explain_packing, name_invalid, validate
from dusttaichi.method import Measurement, Start
from dusttaichi.running import ledger


def make_engine(*, wall=0.0, closing=0.0, volume=0.8):
    """(measurement, run, motion, contacts) of two grains whose contact is 0.2 of a radius deep."""
    parts = {"largest_strain": 0.2}
    domain = SimpleNamespace(fastest_wall=wall)
    environment = SimpleNamespace(
        domain=domain, closing_speed=lambda: closing, box=None, lengths=lambda: np.full(3, 2.0)
    )
    pairs = {"grain_i": np.array([0]), "grain_j": np.array([1]), "overlap": np.array([0.2])}
    contacts = SimpleNamespace(
        measure_pairs=lambda: pairs, grain_count=2, smaller_radius=lambda i, j: np.ones(1)
    )
    run = SimpleNamespace(step=3, time=1e-6, units=lambda name: 1.0, suspect="")
    measurement = SimpleNamespace(parts=parts, energy=1.0)
    motion = SimpleNamespace(environment=environment, bodies=SimpleNamespace(volume=volume))
    return measurement, run, motion, contacts


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


@pytest.mark.parametrize("speeds", [{"wall": 1.0}, {"closing": 1.0}])
def test_a_box_pressed_past_dense_packing_is_named(speeds):
    words = r"filling factor is 0\.65 \(random close packing: 0\.64\)\. Stop earlier, with stop"
    engine = make_engine(**speeds, volume=0.65 * 8.0)
    with pytest.raises(GuardStop, match=words):
        validate(*engine, None)
    measurement, run, motion, _ = engine
    run.explain_state = lambda m: explain_packing(measurement, motion)
    run.validate, run.channels, run.step_key = lambda m: None, ("sliding",), "numerics.time_step"
    start = Start.from_measurement(Measurement.from_energies(1.0, 0.0, [0.0]))
    open_energies = Measurement.from_energies(2.0, 0.0, [0.0])
    with pytest.raises(GuardStop, match=f"ledger is open by.*: the box is.*{words}"):
        ledger.check(run, open_energies, start)
    measurement.parts["largest_strain"] = 0.01  # as deep as at rest: a crystal, and a long step
    with pytest.raises(GuardStop, match="does not resolve the motion. Try a smaller numerics.time"):
        ledger.check(run, open_energies, start)
    still = make_engine(volume=0.65 * 8.0)  # nothing presses
    assert not explain_packing(still[0], still[2])


def test_a_skin_that_is_too_large_is_named_first():
    x = 2.4 * RADIUS * np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3)
    scene = make_scene(boundary=FAR, dt="0.1 ns", numerics={"skin": 3.0})
    with pytest.raises(GuardStop, match=r"within numerics.skin = 3 radii.*Try numerics.skin: auto"):
        build(scene, sample_of(x))
    with pytest.raises(GuardStop, match=r"overlap without limit. Try a smaller numerics.time_step"):
        build(scene, sample_of(0.5 * x))
