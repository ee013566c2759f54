"""The error bar of the time step: changing the step of a run, segments, and the estimate."""

import os
import signal

import netCDF4
import numpy as np
import pytest
import yaml
from scenes import box, make_scene, sample_of

from dusttaichi import analysis, units
from dusttaichi.analysis.error_bar import of_levels, of_segments
from dusttaichi.errors import Interrupted
from dusttaichi.grains.build import build
from dusttaichi.grains.changes import halve_time_step
from dusttaichi.grains.record import measurement
from dusttaichi.method import State
from dusttaichi.run import error_bar, execute
from dusttaichi.run import loop as running
from dusttaichi.run.error_bar import States, StoredState, segments_of
from dusttaichi.scene import from_yaml

TOUCH = 2 * 0.6e-6 - 1.66e-10  # distance of grains in equilibrium contact [m]
# grains that touch, turn and slide, the fourth about to hit the first, the last one an image of it
X = np.array(
    [[0, 0, 0], [TOUCH, 0, 0], [0.6e-6, 1.04e-6, 0], [0.3e-6, 0.2e-6, 1.1456e-6], [2 * TOUCH, 0, 0]]
)
V = np.array([[0.05, 0, 0], [0, 0.02, 0.03], [0, -0.04, 0], [0.03, 0, -0.3], [0, 0, 0]])
W = np.array([[1e4, 0, 0], [0, 2e4, 0], [0, 0, 3e4], [1e4, 1e4, 0], [0, 0, 0]])
SCENES = {
    "box, asperities": dict(
        material="silica_pd08",
        interaction={"damping": "viscoelastic", "asperities": "on"},
        boundary=box(wall_speed=0.2),
    ),
    "periodic": dict(
        interaction={"damping": "viscous"},
        boundary={
            "kind": "periodic",
            "size": [f"{3 * TOUCH} m", "4 um", "4 um"],
            "face_speed": ["-20 cm/s", "10 cm/s", "0 m/s"],
        },
    ),
    "pushes": dict(
        interaction={"damping": "viscous"},
        boundary={"kind": "open"},
        push=[
            {"grains": [1], "force": ["1e-8 N", "0 N", "0 N"], "duration": "12 ns"},
            {"grains": [0], "speed": ["0 m/s", "5 cm/s", "0 m/s"]},
        ],
    ),
}


def moving(name, dt="0.2 ns"):
    blocks = SCENES[name]
    scene = make_scene(dt=dt, **{"output": {"series": {"steps": 10}}, **blocks})
    return build(scene, sample_of(X, V, W))


def approach(sim):
    """Speeds of approach of the contacts, by their grains [um/us]."""
    found = sim.contact_state()
    return dict(
        zip(zip(found["grain_i"], found["grain_j"], strict=True), found["approach"], strict=True)
    )


def left_open(sim, steps):
    """What the ledger leaves open over some steps, over the energy at their start. Energies are
    those of the very moment, in which an impulse is half done."""
    first = measurement(sim)
    sim.advance(steps)
    last = measurement(sim)
    out = last.energy - first.energy + last.lost - first.lost - (last.work - first.work)
    return out / abs(first.energy)


@pytest.fixture(scope="module", params=SCENES)
def changed(request):
    """A simulation that has changed its step in the very step in which grains touch, what it was
    just before, and residuals of the ledger over 10 ns from there at its own step and at the half.
    """
    sim = moving(request.param)
    contacts = sim.measure()["contacts"]
    sim.advance(5)
    while sim.measure()["contacts"] <= contacts and sim.step < 200:
        sim.advance(1)
    assert 5 < sim.step < 200
    before = {
        "state": sim.grain_state(),
        "measured": sim.measure(),
        "step": sim.step,
        "approach": approach(sim),
    }
    arrays, numbers, push, dt = sim.arrays(), sim.numbers(), sim.push, sim.dt
    sim.advance(1)
    before["approach after"] = approach(sim)
    residuals = []
    for steps, finer in ((50, 1), (50, 2), (0, 2)):
        sim.restore(arrays, numbers)
        sim.dt, sim.push = dt, push
        if finer == 2:
            halve_time_step(sim)
        if steps:
            residuals.append(left_open(sim, steps * finer))
    return sim, before, residuals


def test_nothing_moves_when_the_step_changes(changed):
    sim, before, _ = changed
    assert sim.step == 2 * before["step"] and sim.dt == pytest.approx(0.1e-9 / units.TIME)
    x, v, w = sim.grain_state()
    np.testing.assert_array_equal(x, before["state"][0])
    # half a step there and back: rounding of speeds of up to 0.3 um/us and 0.03 rad/us
    np.testing.assert_allclose(v, before["state"][1], rtol=0, atol=1e-14)
    np.testing.assert_allclose(w, before["state"][2], rtol=0, atol=1e-14)
    now = sim.measure()
    for name in ("potential", "potential_wall", "contacts", "kinetic_translation"):
        np.testing.assert_allclose(now[name], before["measured"][name], rtol=1e-12)
    assert [force.end for force in sim.push.forces] in ([], [120])  # 12 ns of 0.1 ns


def test_speeds_of_contacts_stand_half_a_new_step_back(changed):
    """Between those of half a step before and after, a quarter of the way: to second order."""
    sim, before, _ = changed
    if sim.layout.model.has("asperities"):
        return  # an impulse comes between
    now, was, after = approach(sim), before["approach"], before["approach after"]
    assert now.keys() == was.keys()
    for pair in was.keys() & after.keys():
        change = after[pair] - was[pair]
        # u is a sine of some 50 steps a period: its curvature is 1 % of its largest change
        assert now[pair] == pytest.approx(was[pair] + 0.25 * change, abs=0.02 * 0.03)


def test_the_ledger_goes_on(changed):
    """Through the very step in which grains touch, on asperities too: with an impulse that is not
    carried over whole it is open by thirty times as much."""
    _, _, (own, half) = changed
    assert abs(own) < 5e-3  # of the energy there is, at 0.07 of the stiffest period
    assert abs(half) < abs(own)


def trajectory(dt, halve):
    """Positions after 19.2 ns: three grains that roll and vibrate within their elastic limits."""
    x = np.array([[0, 0, 0], [TOUCH, 0, 0], [2 * TOUCH, 0, 0]])
    v = np.array([[0, 1e-3, 0], [1e-3, 0, 0], [0, 0, 2e-3]])
    scene = make_scene(dt=dt, damping={"model": "viscous", "kappa": "1e-4 g/s"})
    sim = build(scene, sample_of(x, v))
    steps = round(9.6e-9 / dt)
    sim.advance(steps)
    if halve:
        halve_time_step(sim)
    sim.advance(steps * (1 + halve))
    return sim.grain_state()


def test_a_change_of_step_keeps_the_order():
    """Errors fall by four when all steps are halved; a velocity that is half a step wrong would
    leave an error of first order, which falls by two."""
    exact = trajectory(0.0125e-9, False)
    errors = [np.abs(trajectory(dt, True) - exact).max(axis=(1, 2)) for dt in (4e-10, 2e-10, 1e-10)]
    for coarse, fine in zip(errors, errors[1:], strict=False):
        assert np.all(coarse[:2] / fine[:2] > 3.3), errors  # 4 as dt -> 0


def test_states_are_spread_over_the_run_so_far(tmp_path, monkeypatch):
    class Sim:
        step = 0

        def state(self):
            return State({"x": np.zeros(1)}, {"step": self.step})

    states, sim = States(tmp_path), Sim()
    states.store(sim, 0, 0)
    while sim.step < 100_000:
        sim.step = states.next(sim.step)
        states.store(sim, 0, 0)
    steps = [state.step for state in states.stored()]
    assert steps[0] == 0 and 6 <= len(steps) <= error_bar.MOST
    assert len(set(np.diff(steps))) == 1 and steps[-1] + np.diff(steps)[0] > 100_000
    states.begin(50_000)
    assert [s.step for s in states.stored()] == [s for s in steps if s <= 50_000]
    states.begin(-1)
    assert states.stored() == []


def test_stretches():
    states = [
        StoredState(0, 0, 0),
        StoredState(0, 0, 4000),
        StoredState(1, 7000, 7000),
        StoredState(1, 7000, 8000),
    ]
    plan = segments_of(states, 10_000, 10_000_000, 2)
    assert [s.steps for s in plan] == [125] * 4 and {s.levels for s in plan} == {2}
    # what is cheap is run again whole, without passing the next state or the end of a stage
    rooms = [4000, 3000, 1000, 2000]
    for segment in segments_of(states, 10_000, 2, 2):
        assert segment.steps == min(2500, rooms[states.index(segment.state)])
    (whole,) = segments_of(states[:2], 10_000, 2, 1)
    assert whole.steps == 10_000 and whole.levels == 3
    assert segments_of([], 10_000, 2, 1) == []
    # a state right before the end has too little left
    (only,) = segments_of([StoredState(0, 0, 0), StoredState(0, 0, 9990)], 10_000, 10**8, 1)
    assert only.state.step == 0


def test_estimate_of_a_method_of_second_order():
    dt2 = np.array([1.0, 1 / 4, 1 / 16])
    whole = of_levels([5.0 + 0.1 * dt2])
    assert whole.error == pytest.approx(0.1) and whole.resolved
    assert whole.scatter == pytest.approx(0.0, abs=1e-14)
    values = np.array([[5.0], [7.0], [1.0]]) * (1.0 + 0.02 * dt2[:2])
    parts = of_segments(values)
    assert parts.relative_error == pytest.approx(0.02 / 1.02)
    assert parts.resolved and parts.scatter == pytest.approx(0.0, abs=1e-12)


def test_estimate_of_mere_scatter():
    rng = np.random.default_rng(1)
    found = [of_segments(5.0 + rng.normal(size=(8, 2))) for _ in range(400)]
    # differences of two numbers of scatter 1, times 4/3, over sqrt(8)
    expected = 4 / 3 * np.sqrt(2 / 8)
    assert np.mean([e.scatter for e in found]) == pytest.approx(expected, rel=0.05)
    # 5 % of 400 stand out by chance: 20 +- 4.4
    assert 7 <= sum(e.resolved for e in found) <= 33
    assert not of_segments([[5.0, 4.0]]).resolved and np.isnan(of_segments([[5.0, 4.0]]).scatter)
    assert not of_levels([[5.0, 4.0, 5.0]]).resolved


CHAIN = """
name: chain
material: silicate_s12
interaction: {{damping: {{model: viscous, kappa: 1.0e-4 g/s}}}}
sample: {{kind: chain, grains: 3}}
push: [{{grains: [0], velocity: [2 mm/s, 3 mm/s, 0 m/s]}}]
boundary: {{kind: open}}
stop: {{time: 60 ns}}
numerics: {{time_step: {dt} ns, threads: 1, accuracy: reference}}  # errors of 1e-29 J
output: {{series: {{time: 3 ns}}}}
"""


def test_a_run_that_is_over_in_no_time_is_run_again_whole(tmp_path):
    """The estimate against the true error, that is a run at a sixteenth of the step."""
    coarse = execute(from_yaml(CHAIN.format(dt=0.4)), tmp_path / "a", error_bar=True)
    fine = execute(from_yaml(CHAIN.format(dt=0.025)), tmp_path / "b", error_bar=True)
    assert not (coarse / error_bar.FOLDER).exists()
    with analysis.open_run(coarse) as run, analysis.open_run(fine) as exact:
        bar, true = analysis.error_bar(run), analysis.error_bar(exact)
        assert bar.whole and bar.share == 1.0 and bar.segments == ((0, 150),)
        for name in ("kinetic_energy", "losses"):
            error = bar.estimates[name].value - true.estimates[name].value
            # of fourth order: the next term of the error
            assert bar.estimates[name].error == pytest.approx(error, rel=0.1), name
            assert bar.estimates[name].resolved
        told = {row[0]: row[1] for row in analysis.table(analysis.summary(run))}
    assert "the whole run at 0.4, 0.2 and 0.1 ns" in told["error bar of the time step"]
    assert "%" in told["… kinetic energy"]
    # without the states of a run there is nothing to begin from
    with netCDF4.Dataset(coarse / "result.nc", "a") as file:
        file.setncattr("error_bar", "")
        file.delncattr("digest")  # changed on purpose, as the message about damaged texts says
    said = []
    execute(from_yaml(CHAIN.format(dt=0.4)), coarse, resume=True, error_bar=True, log=said.append)
    assert any("--force --error-bar" in text for text in said)


CELL = """
name: cell
material: silicate_s12
interaction: {damping: viscous}
sample: {kind: random_packing, grains: 40, filling_factor: 0.3, seed: 1}
boundary: {kind: periodic, size: cube}
stages:
  - {name: press, drive: {strain_rate: -2e5 s^-1}, stop: {steps: 700}}
  - {name: pull, drive: {face_speed: [1 m/s, 0 m/s, 0 m/s]}, stop: {steps: 500}}
numerics: {time_step: 0.3 ns, threads: 1}
output: {series: {steps: 100}, profiles: off}
"""


def measured(directory):
    with analysis.open_run(directory) as run:
        data = yaml.safe_load(run.attrs["error_bar"])
        return data["stretches"], run.series.drop_vars("wall_clock")


def test_segments_of_a_run_in_stages_that_was_interrupted(tmp_path, monkeypatch):
    monkeypatch.setattr(error_bar, "FIRST", 64)
    monkeypatch.setattr(error_bar, "WORK", 2e4)
    scene = from_yaml(CELL)
    execute(scene, tmp_path / "plain/run", fresh=True)
    execute(scene, tmp_path / "whole/run", fresh=True, error_bar=True)
    segments, series = measured(tmp_path / "whole/run")
    with analysis.open_run(tmp_path / "plain/run") as run:
        assert analysis.error_bar(run) is None
        assert run.series.drop_vars("wall_clock").equals(series)
    assert {s["stage"] for s in segments} == {0, 1}
    assert all(s["step"] + s["steps"] <= (700 if s["stage"] == 0 else 1200) for s in segments)
    assert {"stress_xx", "losses", "work", "loss_damping"} <= set(segments[0]["values"])

    monkeypatch.setattr(running, "BURST_SECONDS", 0.0)
    seen = []

    def interrupt(progress):
        seen.append(progress)
        # once in the run, once in the segments
        if len(seen) == 20 or (progress.task and len(seen) < 10_000):
            seen.extend([None] * 10_000 if progress.task else [])
            os.kill(os.getpid(), signal.SIGINT)

    where = tmp_path / "parts/run"
    with pytest.raises(Interrupted):
        execute(scene, where, fresh=True, error_bar=True, report=interrupt)
    with pytest.raises(Interrupted):
        execute(scene, where, resume=True, error_bar=True, report=interrupt)
    with analysis.open_run(where) as run:
        assert run.status.startswith("finished") and analysis.error_bar(run) is None
    said = []
    execute(scene, where, resume=True, error_bar=True, report=interrupt, log=said.append)
    assert measured(where)[0] == segments
    assert not any("no error bar" in text for text in said)
