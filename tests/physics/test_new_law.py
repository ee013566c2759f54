"""A law of one's own, the example of the docs: pairs, walls, equal and unequal grains."""

import numpy as np
import pytest
from scenes import RADIUS, Probe, box, law_of_the_docs, make_scene, polydisperse, sample_of

from dusttaichi.errors import DustError
from dusttaichi.grains.measure import measurement
from dusttaichi.grains.preview import _contact
from dusttaichi.physics.contact import constants, register, registry
from dusttaichi.run.ledger import ledger


@pytest.fixture(scope="module", autouse=True)
def example():
    with law_of_the_docs() as names:
        yield names


def scene(speed=None, dt="0.1 ns", precision="f64", **keys):
    """Of the built-in law without a speed."""
    numerics = {"precision": precision}
    made = make_scene(damping="none", dt=dt, boundary=box("bottom"), numerics=numerics, **keys)
    if speed is None:
        return made
    return made.with_value("interaction.rolling", {"law": "speed_dependent", "speed": speed})


def spinning(made, unequal=False):
    """A pair high above the floor and a grain on it, all of which roll fast."""
    radii = np.array([0.6e-6, 0.5e-6 if unequal else 0.6e-6, 0.6e-6])
    x = np.array([[0, 0, 5e-6], [radii[:2].sum() - 0.1e-9, 0, 5e-6], [0, 0, RADIUS - 0.1e-9]])
    w = np.array([[0, -2e6, 0], [1e5, 2e6, 0], [2e6, 0, 1e5]])
    sample = polydisperse(x, radii, None, 0.0, w) if unequal else sample_of(x, None, w)
    return Probe(made, sample)


def after(probe, steps):
    """(ledger residual, rolling losses of pairs and walls, positions, spins)."""
    start = measurement(probe.sim)
    probe.advance(steps)
    last = measurement(probe.sim)
    m = last.parts
    return ledger(last, start)[1], (m["loss"][3], m["loss_wall"][3]), probe.x, probe.w


@pytest.mark.parametrize(
    "precision, rounding", [pytest.param("f64", 1e-9, marks=pytest.mark.long), ("mixed", 1e-6)]
)
def test_limit_case_is_the_built_in_law(precision, rounding):
    """Where the speed is beyond all measure the limit is xi_crit: the same to rounding, which the
    compiler may take in another order (400 steps, as in test_effects)."""
    _, lost, x, w = after(spinning(scene(precision=precision)), 400)
    _, same, x2, w2 = after(spinning(scene("2.9e8 m/s", precision=precision)), 400)
    assert min(lost) > 0
    np.testing.assert_allclose(same, lost, rtol=100 * rounding)
    assert np.abs(x2 - x).max() < rounding * RADIUS
    assert np.abs(w2 - w).max() < 10 * rounding * np.abs(w).max()


@pytest.mark.parametrize(
    "unequal", [False, pytest.param(True, marks=pytest.mark.long)], ids=["equal", "unequal"]
)
def test_ledger_closes(unequal):
    """At a speed that makes the limit half as large again; a step four times as short leaves less
    than half of the residual (first order: the limit changes within a step)."""
    residuals = []
    for dt, steps in (("0.2 ns", 250), ("0.05 ns", 1000)):
        residual, lost, _, _ = after(spinning(scene("1 m/s", dt=dt), unequal), steps)
        residuals.append(abs(residual))
        assert min(lost) > 0
    assert residuals[0] < 2e-3 and residuals[1] < max(0.5 * residuals[0], 1e-6)


def test_its_numbers_are_told():
    """`dust check` and the table of the docs have the number of the law."""
    made = scene("2 cm/s")
    pair = constants.pair_constants(made.material, made.interaction)
    assert pair.slowness == pytest.approx(50.0) and pair.k_r > 0
    told = dict(_contact(pair, made))
    assert any("slowness" in what and value == "50 s/m" for what, value in told.items())
    assert ("rolling", "speed_dependent", "slowness") in {
        row[:3] for row in registry.table_of_numbers()
    }


def test_its_keys_are_checked():
    with pytest.raises(DustError, match=r"rolling\.speed = 2: it has no unit"):
        scene(2)
    with pytest.raises(DustError, match=r"rolling\.law = .*linear, speed_dependent is needed"):
        make_scene().with_value("interaction.rolling", {"law": "none_such"})
    made = scene("2 cm/s")
    assert type(made).from_dict(made.plain) == made


def test_what_cannot_be_registered(example):
    law = example["RollingWithSpeed"]
    for effect, name, own, text in (
        ("roling", "mine", law, "rolling, sliding"),
        ("rolling", "linear", law, "built-in"),
        ("twisting", "mine", object(), "lacks NUMBERS, numbers, HISTORY"),
    ):
        with pytest.raises(ValueError, match=text):
            register(effect, name, own)
