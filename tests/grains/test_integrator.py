"""Order of the time step, and the ledger: energy + losses - work by walls stay constant."""

import numpy as np
import pytest
from scenes import FAR, RADIUS, Probe, balance, box, make_scene, sample_of
from test_pair import DAMPINGS, E_C, pairs

from dusttaichi import samples
from dusttaichi.grains.build import build

LEDGER = np.array([1.0, 1.0, -1.0])  # own + lost - work
STEPS = np.array([0.1, 0.05, 0.025, 0.0125])  # ns


def bound(speed, spin):
    """Six strained pairs that neither part nor slip at these speeds; all springs at work."""
    rng = np.random.default_rng(21)
    x, v, w = pairs(2 * RADIUS - np.linspace(0.12, 0.24, 6) * 1e-9, 0.0)
    return x, v + speed * rng.normal(size=(12, 3)), w + spin * rng.normal(size=(12, 3))


def refine_steps(x, v, w, time, **keys):
    """Ledger error (largest of ten moments) and end state for every step of STEPS; time in ns."""
    out = []
    for dt in STEPS:
        probe = Probe(make_scene(dt=f"{dt} ns", boundary=FAR, **keys), sample_of(x, v, w))
        start, worst = probe.energy(), 0.0
        for _ in range(10):
            probe.advance(round(time / dt / 10))
            worst = max(worst, abs((probe.energy() - start) @ LEDGER))
        out.append((worst, probe.x, probe.v, probe.w, probe.sim.ledger.measure_energies()["loss"]))
    return out


def slope(errors, steps):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def test_second_order_while_slipping():
    """Slipping starts and ends between two steps: each such event shifts a little at random,
    so the order of the ledger is met less sharply (1.5 to 2.5 over a factor of eight)."""
    runs = refine_steps(*bound(0.01, 3e5), 12.0)
    assert np.any(runs[-1][4][3:5] > 0), "rolling or sliding must have lost energy"
    assert 1.5 < slope([run[0] for run in runs], STEPS) < 2.5


def test_breaking_with_strained_springs():
    """What a contact that parts still holds in its rolling, sliding and twisting springs is lost.

    The ledger's jump at breaking, after the last step before it: second order in dt, so that
    halving dt divides it by four; required is a slope above 1.5, as the moment of breaking is
    found on the grid of steps.
    """
    x, v, w = pairs(2 * RADIUS - 1e-6 * 0.16627e-9, [0.238, 0.0, 0.0])
    w[0], w[1] = [4e5, 2e5, 1e5], [1e5, -1e5, 2e5]
    x[2:, 0] *= 3  # pairs that stay apart: one contact breaks, alone
    v[2:] = 0
    jumps = []
    for dt in STEPS:
        probe = Probe(make_scene(dt=f"{dt} ns", boundary=FAR), sample_of(x, v, w))
        start, energy_before = probe.energy(), None
        while probe.sim.ledger.measure_energies()["contacts"]:
            energy_before = (probe.energy() - start) @ LEDGER
            potential = probe.sim.ledger.measure_energies()["potential"][1:].sum()
            probe.advance(1)
        jumps.append(abs((probe.energy() - start) @ LEDGER - energy_before))
        assert potential > 1e-3, "the springs must be strained [fJ]"
    # an eighth of what the springs of this contact hold is what a first-order slip would leave
    assert slope(jumps, STEPS) > 1.5 or max(jumps) < 1e-4 * E_C


@pytest.mark.parametrize(
    "damping", ["none", pytest.param("viscous", marks=pytest.mark.long), "viscoelastic"]
)
def test_second_order(damping):
    """Differences of neighbouring steps and the ledger shrink with dt^2; 0.1 ns is 1/47 of the
    stiffest period, fine enough for the leading order to rule (hence 1.8 to 2.2)."""
    runs = refine_steps(*bound(0.002, 2e4), 20.0, damping=damping)
    assert all(np.all(run[4][3:] == 0) for run in runs), "nothing may slip"
    assert 1.8 < slope([run[0] for run in runs], STEPS) < 2.2
    for quantity in (1, 2, 3):
        steps = [
            np.abs(a[quantity] - b[quantity]).max() for a, b in zip(runs, runs[1:], strict=False)
        ]
        assert 1.8 < slope(steps, STEPS[:-1]) < 2.2


def test_ledger_starts_at_zero():
    """Nothing has been lost and no work done before the first step."""
    x, v, w = bound(0.002, 2e4)
    probe = Probe(make_scene(damping="viscoelastic", boundary=FAR), sample_of(x, v, w))
    assert np.all(probe.energy()[1:] == 0)


@pytest.mark.parametrize("damping", DAMPINGS)
def test_ledger_of_a_compressed_box(damping):
    """60 grains pressed by a wall of 1 m/s, contacts forming, slipping, breaking all the time.

    1 % of the throughput (losses + work): each of the some hundred breakings leaves an error of
    dt^1.5 (JKR's force has a vertical slope at pull-off), of either sign.
    """
    scene = make_scene(
        damping=damping,
        dt="0.1 ns",
        boundary=box(wall_speed=1.0, side_walls=1e-3),
        sample={"kind": "rbd", "grains": 60, "seed": 3},
    )
    sim = build(scene, samples.make(scene))
    start = balance(sim.ledger.measure_energies())
    for _ in range(8):
        sim.advance(1000)
        stored, lost, work = balance(sim.ledger.measure_energies()) - start
        assert abs(stored + lost - work) < 0.01 * (lost + abs(work))
    m = sim.ledger.measure_energies()
    assert m["wall_work"] > 0 and m["loss"][1] > 0 and m["loss"][3] > 0 and m["loss"][4] > 0
    assert (m["loss"][2] > 0) == (damping != "none")
