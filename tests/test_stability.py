"""The largest stable step: predicted, measured, and enforced."""

import numpy as np
import pytest
from conftest import RADIUS, Probe, box, make_scene, sample_of

from dusttaichi.build import time_step
from dusttaichi.errors import DustError
from dusttaichi.physics import stability

D = 2 * RADIUS - 0.16627e-9


def cluster(n):
    return stability.close_packed(n) * D


def growth(n, factor):
    """Kinetic energy after 150 steps over that at the start, dt = factor x the predicted limit.

    The amplitude is so small that no spring comes near its limit: the motion is linear.
    """
    limit = time_step(make_scene(dt="0.01 ns"), n).limit
    rng = np.random.default_rng(41)
    w = 1e-6 * rng.normal(size=(n, 3))
    probe = Probe(make_scene(dt=0.9 * limit), sample_of(cluster(n), None, w))
    probe.sim.dt = factor * limit * 1e6
    first = probe.sim.measure()["kinetic_rotation"]
    probe.advance(150)
    return probe.sim.measure()["kinetic_rotation"] / first


@pytest.mark.parametrize("n", [2, 3])
def test_predicted_limit_is_the_measured_one(n):
    """Beyond the limit the fastest mode grows by exp(2 sqrt(2 (factor - 1))) a step (energy): at
    1.03 by 1e30 in 150 steps, at 0.97 nothing grows."""
    assert growth(n, 0.97) < 100
    assert growth(n, 1.03) > 1e6


def test_unstable_step_is_refused():
    with pytest.raises(DustError, match=r"numerics\.time_step.*not stable.*4\.681 ns.*1\.49 ns"):
        Probe(make_scene(dt="1.5 ns"), sample_of(cluster(2)))


def test_auto_is_a_fraction_of_the_stiffest_period():
    scene = make_scene(dt="auto", numerics={"step_fraction": 0.1})
    assert time_step(scene, 2).dt == pytest.approx(0.1 * 4.6813e-9, rel=1e-4)
    assert time_step(scene, 13).dt < time_step(scene, 3).dt < time_step(scene, 2).dt


def test_walls_count():
    """One grain on a wall: sliding and turning, w^2 = (1 + 5/2) k_s/m with the wall's k_s, which is
    2^(2/3) times that of a pair (a0 ~ R^(2/3)); at least that stiff is what auto must assume."""
    scene = make_scene(dt="auto", boundary=box("bottom"))
    period = time_step(scene, 1).period
    assert period <= 12.39e-9 / np.sqrt(3.5 * 2 ** (2 / 3)) * 1.001


def energy_stays(scene, x, v, w, steps=400):
    """Largest of kinetic + potential + lost over the run, less the start, over the kinetic energy
    given."""
    probe = Probe(scene, sample_of(x, v, w))
    start = probe.energy()
    m = probe.sim.measure()
    kinetic = (m["kinetic_translation"] + m["kinetic_rotation"]) * 1e-15
    probe.advance(steps)
    own, lost, _ = probe.energy() - start
    return max(own, lost) / kinetic


def test_auto_step_is_stable_in_a_corner():
    """A grain that touches all six walls of a strong box is held by six springs at once: stable
    motion loses nothing at amplitudes far below the limits."""
    scene = make_scene(dt="auto", boundary=box(side_walls=1.0))
    gain = energy_stays(scene, np.zeros((1, 3)), [[1e-4, 2e-4, 5e-5]], [[10.0, 20.0, 40.0]])
    assert gain < 1.0


@pytest.mark.parametrize("damping", [
    {"model": "viscoelastic", "time": "100 ps"}, {"model": "viscous", "kappa": "1e-2 g/s"},
])  # fmt: skip
def test_strong_damping_shortens_the_step_or_is_refused(damping):
    """Damping is explicit: too much of it is unstable at a step that the springs alone allow."""
    v = [[1e-4, 0, 0], [-1e-4, 0, 0]]
    try:
        gain = energy_stays(make_scene(dt="auto", damping=damping), cluster(2), v, None)
    except DustError as error:
        assert "damping" in str(error)
    else:
        assert gain < 1.5
