"""What ends a stage, and snapshots that a scene leaves to the run."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import reference as ref
import spring
import toy
import xarray as xr

from dusttaichi import analysis, method, plots, samples
from dusttaichi.domain.clock import NEVER, Clock
from dusttaichi.grains.build import build
from dusttaichi.running import execute, schedule
from dusttaichi.running.activities import EndCheck
from dusttaichi.running.schedule import next_record
from dusttaichi.running.stage_end import AVERAGED, End, component, plateau
from dusttaichi.running.state import RunState
from dusttaichi.scene import from_yaml
from dusttaichi.scene.boundary import Drive
from dusttaichi.scene.output import Interval
from dusttaichi.scene.stage import StagePlan
from dusttaichi.scene.stop import Bounds, Stop

NUMERICS = "numerics: {time_step: 0.3 ns, threads: 1}\n"
CYCLE = """
name: cycle
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: lattice, structure: sc, cells: [4, 4, 4]}
boundary: {kind: box}
stages:
  - {name: press, drive: {wall_speed: 0.3 mm/s}, stop: {pressure: 10 kPa}}
  - name: release
    drive: {wall_speed: -0.3 mm/s}
    stop: {pressure: {below: 2 kPa}}
  - {name: rest, stop: {rest: 1e-5, time: 20 us}, output: {series: {steps: 100}}}
output: {stress: true, series: {strain: 2.5e-6}}
numerics: {time_step: 0.3 ns, threads: 1}
"""


@pytest.fixture(scope="module")
def pressed_run(tmp_path_factory):
    path = execute(from_yaml(CYCLE), tmp_path_factory.mktemp("cycle") / "run")
    return analysis.open_run(path)


@pytest.fixture(scope="module")
def cycle(pressed_run):
    return pressed_run.series


def test_the_modulus_of_letting_go_is_that_of_the_contacts(pressed_run):
    """A column of four grains between walls: three contacts and two with walls in series, each with
    the overlap that JKR gives for the force. 5 %: the wall moves at 0.3 mm/s, and the slope
    is that of a line over half of the pressure."""
    (unloading,) = analysis.measure_unloadings(pressed_run)
    assert pressed_run.unloads and not pressed_run.stretches and unloading.stage == "release"
    pair, wall = ref.numbers(), ref.numbers(wall=True)
    area, grains = (8 * 0.6e-6 - 3 * pair.delta0 - 2 * wall.delta0) ** 2, 16

    def shortened(pressure):
        push = pressure * area / grains

        def overlap(c):
            s = (0.5 + np.sqrt(0.25 + 0.25 * push / c.F_c)) ** (1 / 3)
            return c.delta0 * (3 * s**4 - 2 * s)

        return 3 * overlap(pair) + 2 * overlap(wall)

    high, low = unloading.path[0], unloading.path[unloading.path > 0.5 * unloading.path[0]][-1]
    height = float(pressed_run.series.height[-1])
    expected = (high - low) / ((shortened(high) - shortened(low)) / height)
    assert unloading.modulus == pytest.approx(expected, rel=0.05)
    back = (shortened(10e3) - shortened(2e3)) / height
    # to the last of the points, of 2.5e-6 each, that the waves of the block let end the stage
    assert unloading.recovered == pytest.approx(back, abs=7.5e-6)


def test_a_stage_ends_by_a_pressure_from_either_side_and_at_rest(cycle):
    ends = [cycle.sel(time=cycle.stage == n).pressure.sel(wall="top").values for n in range(3)]
    assert ends[0][-1] >= 10e3 and np.all(ends[0][:-1] < 10e3)
    assert ends[1][-1] <= 2e3 and np.all(ends[1][:-1] > 2e3) and len(ends[1]) > 3
    # kinetic energy over 1.2 F_c delta0 a contact; those with walls hold more, by 2^(4/3)
    assert "at rest" in cycle.attrs["status"]
    kinetic = (cycle.kinetic_translation + cycle.kinetic_rotation).values
    pair = 1.2 * 56.549e-9 * 0.16627e-9
    bonds = pair * (cycle.contact_count + 2.0 ** (4.0 / 3.0) * cycle.wall_contact_count).values
    moving = kinetic / bonds
    resting = cycle.stage.values == 2
    assert moving[-1] < 1.001e-5 and np.all(moving[resting][:-1] > 0.999e-5)


def test_a_pressure_ends_a_stage_between_two_records(pressed_run, tmp_path):
    """The block of the cycle, whose pressure doubles from one record to the next."""
    coarse = CYCLE.replace("strain: 2.5e-6", "strain: 1e-4").split("  - name: release")[0]
    scene = from_yaml(coarse + "output: {series: {strain: 1e-4}, snapshots: off}\n" + NUMERICS)
    series = analysis.open_run(execute(scene, tmp_path / "run")).series
    pressures = series.pressure.sel(wall="top").values
    assert 10e3 <= pressures[-1] < 12e3
    fine = pressed_run.stage("press").series
    assert len(pressures) < len(fine.time) / 4


def window_of(values, **bounds):
    """Step of the test, of 16 in an interval, at which means of these values end a stage, or 0."""
    state = SimpleNamespace(end_reason="", opened=0, tests=[])
    sim = SimpleNamespace(step=0, domain=SimpleNamespace(has_top=True, surfaces=None))
    stop = Stop(pressure=Bounds(**bounds))
    end = End(StagePlan("", Drive(), stop, None, None, None), Clock(dt=1.0), state, 0)
    for number in range(1, len(values) + 1):
        sim.step = 100 * number
        record = {"pressure": [np.nan] * 5 + [float(np.mean(values[:number]))]}
        if end.reached_between(record, sim):
            return number
    return 0


def test_a_mean_between_records_must_be_surely_beyond_a_threshold():
    """A rise to 54 kPa in one interval is caught near 20. A burst is not taken for it, nor a load
    that fluctuates: near the threshold records end a stage by chance more often."""
    rise = np.linspace(10e3, 54e3, 16)
    number = window_of(rise, above="20 kPa")
    assert 20e3 <= rise[:number].mean() < 24e3
    assert window_of(rise[::-1] - 34e3, below="15 kPa") > 2
    assert window_of([5e3, 90e3, *[5e3] * 14], above="20 kPa") == 0
    assert window_of([40e3, 40e3, 40e3, *[18e3] * 5], above="20 kPa") == 0  # a peak at the start
    random = np.random.default_rng(1)
    loads = 19e3 * (1.0 + 0.33 * random.normal(size=(200, 16)))
    by_tests = sum(window_of(load, above="20 kPa") > 0 for load in loads)
    assert by_tests < 0.5 * np.sum(loads.mean(axis=1) >= 20e3)
    assert Bounds(above="20 kPa").overshoot(32e3) == pytest.approx(0.6)
    assert Bounds(below="-5 kPa").overshoot(-6e3) == pytest.approx(0.2)


def test_a_filling_factor_under_load_is_tested_between_records():
    """No step is known for it: the first test at which the box is as dense ends the stage."""
    clock = Clock(
        dt=1.0, volume=0.3, start=(1.0, 1.0, 1.0), rate=(0.0, 0.0, -1e-3), controlled=(2,)
    )
    plan = StagePlan("", Drive(), Stop(filling_factor=0.4), None, None, None)
    end = End(plan, clock, SimpleNamespace(end_reason="", opened=0, tests=[]), 0)
    assert end.tested
    domain = SimpleNamespace(has_top=True, surfaces=None, servo=SimpleNamespace(presses=True))
    ends = []
    for step in (100, 200, 300):
        record = {"filling_factor": clock.filling_factor_at(step)}
        ends.append(end.reached_between(record, SimpleNamespace(step=step, domain=domain)))
    assert ends == [False, False, True]
    at_speed = dataclasses.replace(clock, controlled=())
    assert not End(plan, at_speed, SimpleNamespace(end_reason=""), 0).tested


@pytest.mark.parametrize("steps", [60, 100])
def test_a_first_record_has_the_peak_of_the_start(steps):
    """Its pressure ends no stage, as that of the second does."""
    state = RunState(None, first=1000 - steps, last_span=steps * 0.5)
    sim = SimpleNamespace(step=1000, dt=0.5, domain=SimpleNamespace(has_top=True, surfaces=None))
    stop = Stop(pressure="20 kPa", plateau=0.02)
    plan = StagePlan("", Drive(), stop, Interval(steps=100), None, None)
    run = SimpleNamespace(sim=sim, state=state, plan=plan, clock=Clock(dt=0.5))
    run.end = End(plan, run.clock, state, 0)
    record = {"pressure": [np.nan] * 5 + [30e3]}
    check = EndCheck(run, SimpleNamespace(record=record, measurement=None))
    check.act()
    assert not state.end_reason and len(state.pressures) == 1
    sim.step, state.last_span = 1100, 100 * 0.5
    check.act()
    assert state.end_reason == "pressure 20 kPa, passed by 50 %: 30 kPa"


def test_a_first_record_is_no_shorter_than_half_an_interval():
    """Records are at multiples of the interval; a stage leaves out one that comes too soon."""
    clock, interval = Clock(dt=0.5), Interval(steps=100)
    assert next_record(interval, clock, 970, first=970) == 1100
    assert next_record(interval, clock, 1010, first=970) == 1100
    assert next_record(interval, clock, 940, first=940) == 1000
    assert next_record(interval, clock, 1000, first=940) == 1100
    assert next_record(Interval(steps=1), clock, 970, first=970) == 971
    assert next_record(None, clock, 970, first=970) == NEVER


def test_bounds_and_a_plateau():
    assert Bounds(below="-5 kPa").describe_crossing(-5e3) == "no more than -5 kPa"
    assert Bounds(above="5 kPa", below="1 kPa").describe_crossing(2e3) == ""
    stop = Stop(pressure="5 kPa")
    assert stop.pressure_bounds.describe_crossing(5e3) == "5 kPa" and not stop.falling
    stress = np.array([[1.0, 2.0, 0.0], [4.0, 5.0, 0.0], [0.0, 0.0, 6.0]])
    assert component(stress, "xy") == 3.0 and component(stress, "zz") == 6.0
    last = []
    rising = [plateau(last, p, 0.02) for p in np.linspace(1.0, 2.0, 3 * AVERAGED)]
    assert not any(rising) and len(last) == 2 * AVERAGED
    level = [plateau(last, 2.0, 0.02) for _ in range(2 * AVERAGED)]
    assert level[-1] and not level[0]


def test_contacts_carry_their_forces(pressed_run):
    """A simple cubic block of 64 grains: 8, 24, 24 and 8 of them have 3, 4, 5 and 6 neighbours, and
    its contacts point along the three axes alike. f4 has seven digits."""
    structure = analysis.measure_structure(pressed_run)
    np.testing.assert_allclose(structure.coordination * 64, [0, 0, 0, 8, 24, 24, 8], atol=1e-9)
    np.testing.assert_allclose(structure.fabric, np.eye(3) / 3, atol=1e-6)
    assert structure.anisotropy < 1e-6 and np.isnan(structure.correlation).all()
    frames = pressed_run.snapshots
    last, walls = pressed_run.contacts(), pressed_run.contacts(group="wall_contacts")
    assert np.all(last.step == frames.step[-1]) and len(last.contact) == 144
    assert len(walls.wall) == 6 * 16 and last.force.dtype == np.float32
    assert set(plots.draw_figures(pressed_run)) >= {"structure", "cycles"}


def test_forces_add_up(pressed_run):
    """Of every grain, those of its contacts and walls are what moves it; of every wall, its own."""
    scene = from_yaml(CYCLE)
    sim = build(scene, samples.make(scene))
    sim.advance(500)
    pairs, walls = sim.contacts.measure_pairs(), sim.contacts.measure_walls()
    total = np.zeros((2, sim.bodies.count, 3))
    np.add.at(total[0], pairs["grain_i"], pairs["force"])
    np.add.at(total[0], pairs["grain_j"], -pairs["force"])
    np.add.at(total[0], walls["grain"], walls["force"])
    np.add.at(total[1], pairs["grain_i"], pairs["torque_i"])
    np.add.at(total[1], pairs["grain_j"], pairs["torque_j"])
    np.add.at(total[1], walls["grain"], walls["torque"])
    moving = np.array(sim.motion.sum_contact_loads())[:, np.argsort(sim.grain_state.order)]
    np.testing.assert_allclose(total, moving, rtol=0, atol=1e-9)
    of_walls = np.zeros((6, 3))
    np.add.at(of_walls, walls["wall"], walls["force"])
    np.testing.assert_allclose(
        of_walls, sim.kernel_sums.read_loads().wall_force(), rtol=0, atol=1e-9
    )
    assert np.abs(of_walls).max() > 1.0


@pytest.mark.long  # of unlike grains: test_polydisperse
def test_momenta_of_an_open_scene(tmp_path):
    """Two grains of different size that meet obliquely and spin: neither momentum changes, to
    rounding, and both are what the sample begins with."""
    scene = from_yaml("""
name: two
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: pair, gap: 0.1 nm, radii: [0.6 um, 0.4 um], speed: 2 m/s, impact_parameter: 0.4,
  spins: [[1e5 rad/s, 0 rad/s, 0 rad/s], [0 rad/s, 2e5 rad/s, 0 rad/s]]}
boundary: {kind: open}
stop: {steps: 600}
output: {series: {steps: 100}}
""")
    series = analysis.open_run(execute(scene, tmp_path / "run")).series
    sample = samples.make(scene)
    mass = 4 / 3 * np.pi * sample.radii**3 * scene.material.density
    spun = (0.4 * mass * sample.radii**2) @ sample.spins
    turning = np.cross(sample.positions, mass[:, None] * sample.velocities).sum(axis=0) + spun
    scale = (mass[:, None] * abs(sample.velocities)).sum()
    np.testing.assert_allclose(series.momentum, 0 * series.momentum, atol=1e-12 * scale)
    expected = np.broadcast_to(turning, series.angular_momentum.shape)
    np.testing.assert_allclose(series.angular_momentum, expected, atol=1e-11 * abs(turning).max())
    assert float(series.loss.sum("channel")[-1]) > 0.0


def plan(snapshots="auto", **stop):
    return StagePlan("", Drive(), Stop(**stop), None, None, snapshots)


def test_some_thirty_within_a_size_or_by_the_strain():
    one, clock = plan(steps=3000), Clock(dt=1e-4)
    assert schedule.steps_apart([one], clock, one, 1000) == 100
    # of two stages fifteen each; a stage with an interval of its own has no share
    assert schedule.steps_apart([one, one], clock, one, 1000) == 200
    assert schedule.steps_apart([one, plan(None, steps=5)], clock, one, 1000) == 100
    # ten fit into the size, and of what is larger than half of it none
    assert schedule.steps_apart([one], clock, one, schedule.LARGEST / 10) == 300
    assert schedule.steps_apart([one], clock, one, 0.6 * schedule.LARGEST) == 0
    one = plan(pressure="1 kPa")
    assert schedule.steps_apart([one], Clock(dt=1e-4), one, 1000) == 0  # nothing moves
    grows = Clock(dt=1.0, start=(1.0, 1.0, 1.0), rate=(0.0, 0.0, 1e-3), volume=0.1)
    assert grows.last_step(one.stop)[0] == NEVER
    assert schedule.steps_apart([one], grows, one, 1000) == pytest.approx(1000 / 30, abs=1)


def test_a_run_keeps_them(tmp_path, toys):
    """Evenly, from the first to the last; the same bits when it is interrupted and resumed are a
    matter of the state, which has the interval."""
    method.register(spring.METHOD)
    text = toy.plain(steps=600, snapshots=250).replace("snapshots: {steps: 250}", "snapshots: auto")
    execute(from_yaml(text), tmp_path / "run")
    with xr.open_datatree(tmp_path / "run/result.nc") as tree:
        assert tree["snapshots"].step.values.tolist() == list(range(0, 601, 20))
