"""The Python interface: the examples of the docs, and that it is the run of `dust run`."""

import re
import runpy
import subprocess
import sys
import typing
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import toy
import xarray as xr
from bits import assert_same_bits, tree
from scenes import law_of_the_docs

import dusttaichi as dt
from dusttaichi.errors import GuardStop
from dusttaichi.results.files import RESULT
from dusttaichi.running import execute, progress
from dusttaichi.running.present import PresentValues

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
PLAIN, STAGED = toy.plain(), toy.make_staged()


def place(simulation):
    return simulation.measure().place


# -- the examples --------------------------------------------------------------------------------


def test_a_measurement_of_ones_own(tmp_path):
    names = runpy.run_path(str(EXAMPLES / "measurement.py"))
    own, scene = names["records"], names["scene"]
    np.testing.assert_allclose(own["record_time"], np.arange(11) * 2e-9, atol=1e-10)  # half a step
    # before they meet the clusters draw near each other: the root of the mean square shrinks
    assert own["gyration"].shape == (11,) and own["gyration"][1] < own["gyration"][0]
    # pushed towards each other at 2 m/s, half of it each
    assert own["fastest"][0] == pytest.approx(1.0, rel=1e-6)
    plain = execute(scene, tmp_path / "plain")
    with names["simulation"] as simulation:
        a, b = tree(simulation.directory / RESULT), tree(plain / RESULT)
    assert {f"/spread/{name}" for name in own} <= a.keys() - b.keys()
    assert all(name.startswith("/spread/") for name in a.keys() - b.keys())
    for name, values in b.items():
        np.testing.assert_array_equal(a[name], values, err_msg=name)


def test_a_sample_of_ones_own():
    names = runpy.run_path(str(EXAMPLES / "grains.py"))
    assert names["simulation"].measure is not None
    assert names["positions"].shape == (12, 3)
    with (
        dt.simulate(dt.from_yaml(PLAIN)) as simulation,
        pytest.raises(dt.DustError, match="another method"),
    ):
        simulation.forces()


@pytest.fixture
def law():
    with law_of_the_docs():
        yield


def test_a_law_of_ones_own(law):
    scene = dt.from_yaml("""
name: law
material: silicate_s12
interaction: {rolling: {law: speed_dependent, speed: 1 mm/s}, damping: none}
sample: {kind: chain, grains: 3}
push: [{grains: [0], velocity: [0 m/s, 3 m/s, 0 m/s]}]
boundary: {kind: box, omit: [x_min, x_max, y_min, y_max, bottom], size: [1 cm, 1 cm, 1 cm]}
stop: {time: 20 ns}
numerics: {threads: 1}
""")
    slow = scene.with_value("interaction.rolling", "on")
    losses = []
    for item in (scene, slow):
        with dt.simulate(item) as simulation:
            losses.append(simulation.run().measure().loss[3])
    assert losses[0] != losses[1]


# -- the same run --------------------------------------------------------------------------------


@pytest.mark.parametrize("text", [PLAIN, STAGED])
def test_advanced_in_pieces_it_is_the_run_of_the_command(tmp_path, text):
    scene = dt.from_yaml(text)
    uninterrupted = execute(scene, tmp_path / "whole")
    with dt.simulate(scene, directory=tmp_path / "run", log=lambda text: None) as simulation:
        simulation.advance(137)
        assert simulation.step == 137
        simulation.advance("2.5 us")
        assert simulation.time == pytest.approx(137e-8 + 2.5e-6)
        simulation.advance(600).run()
    assert_same_bits(uninterrupted / RESULT, tmp_path / "run" / RESULT)
    assert simulation.scene is scene


def test_it_goes_on_after_the_end_and_after_it_was_closed(tmp_path):
    """The last frame of the shorter run is no frame of the longer one."""
    short = dt.from_yaml(PLAIN.replace("2000", "600"))
    uninterrupted = execute(dt.from_yaml(PLAIN), tmp_path / "whole")
    with dt.simulate(short, directory=tmp_path / "run") as simulation:
        simulation.run()
        assert simulation.records("snapshots")["step"].tolist() == [0, 250, 500, 600]
        simulation.advance(900)
        assert simulation.records("snapshots")["step"].tolist() == list(range(0, 1501, 250))
    log = []
    scene = dt.from_yaml(PLAIN)
    with dt.simulate(scene, directory=tmp_path / "run", resume=True, log=log.append) as resumed:
        assert resumed.step == 1500 and "continuing" in log[0]
        resumed.run()
    assert_same_bits(uninterrupted / RESULT, tmp_path / "run" / RESULT)


def test_own_records_go_on_with_a_resumed_run(tmp_path):
    scene = dt.from_yaml(PLAIN)
    for resume in (False, True):
        with dt.simulate(scene, directory=tmp_path / "run", resume=resume, log=list) as simulation:
            simulation.every(300, place, "spot")
            simulation.every({"time": "5 us"}, lambda s: {"pair": [s.step, 1.0]}, "pairs")
            simulation.advance(950) if not resume else simulation.run()
    with xr.open_datatree(tmp_path / "run" / RESULT) as stored:
        assert stored["spot"].step.values.tolist() == [0, 300, 600, 900, 1200, 1500, 1800]
        # a cosine of frequency 2/us, at 10 ns: the leapfrog's is greater by (w dt)^2/24
        t = stored["spot"].record_time.values * 1e6
        np.testing.assert_allclose(stored["spot"].spot, 1e-6 * np.cos(2 * t), atol=1e-9)
        assert stored["pairs"].pair.values.tolist() == [[0, 1.0], [500, 1.0], [1000, 1.0],
                                                       [1500, 1.0], [2000, 1.0]]  # fmt: skip


def test_averages_at_the_step_of_a_record_are_those_of_the_record(tmp_path):
    scene = dt.from_yaml(PLAIN)
    with dt.simulate(scene, directory=tmp_path / "run") as simulation:
        simulation.advance(200)
        mean = simulation.measure().mean_speed
        assert mean == simulation.records("series")["mean_speed"][-1] > 0.0
        simulation.advance(40)
        speed = simulation.measure().mean_speed
        assert speed > 0.0 and speed != mean
        simulation.advance(60)
        mean = simulation.measure().mean_speed
    with dt.simulate(scene, directory=tmp_path / "run", resume=True, log=list) as resumed:
        assert resumed.step == 300 and resumed.measure().mean_speed == mean > 0.0


def test_a_guard_stops_it_with_the_result_kept(tmp_path):
    scene = dt.from_yaml(PLAIN + "start: 9.0\n").with_value("numerics.time_step", "0.99 us")
    with dt.simulate(scene, directory=tmp_path / "run", log=list) as simulation:
        with pytest.raises(GuardStop):
            simulation.every(1, lambda s: None, "nothing")
            spring_in_motion = simulation._run.sim
            spring_in_motion.x = 20.0
            simulation.advance(10)
        with dt.open_run(simulation.flush()) as result:
            assert result.status.startswith("stopped by guard")


def test_what_cannot_be_is_refused(tmp_path):
    with dt.simulate(dt.from_yaml(PLAIN), directory=tmp_path / "run") as simulation:
        for value in ("1 m", 0, {"steps": 1, "time": "1 us"}):
            with pytest.raises(dt.DustError, match="interval"):
                simulation.every(value, place, "spot")
        with pytest.raises(dt.DustError, match="cannot name"):
            simulation.every(1, place, "a/b")
        with pytest.raises(dt.DustError, match="has snapshots already"):
            simulation.every(1, place, "snapshots")
        with pytest.raises(dt.DustError, match="has place already"):
            simulation.every(1, place)
        with pytest.raises(dt.DustError, match="allowed: numbers"):
            simulation.every(1, lambda s: "text", "text")
        with pytest.raises(dt.DustError, match="exists already|Another run"):
            dt.simulate(dt.from_yaml(PLAIN), directory=tmp_path / "run")


@pytest.mark.parametrize("duration", [-5, 2.5, True, "-1 us", "1 m", None, float("nan")])
def test_a_simulation_only_goes_forwards(duration):
    with dt.simulate(dt.from_yaml(PLAIN)) as simulation:
        with pytest.raises(dt.DustError, match="duration"):
            simulation.advance(duration)
        assert simulation.advance(0).step == 0 and simulation.advance(3.0).step == 3


def test_measured_values_are_a_typed_mapping():
    """Declared attributes are variables of the series; any of these is an attribute and an item."""
    declared = typing.get_type_hints(PresentValues, localns={"xr": xr})
    with dt.simulate(dt.load("smoke"), progress=False) as simulation:
        values = simulation.measure()
    assert set(values) == set(values.units) and len(values) == len(values.units)
    assert set(declared) - {"units"} - set(values) <= {"stage", "box_length", "stress"}
    for name, value in values.items():
        assert value is getattr(values, name) and name in dir(values)
        assert isinstance(value, declared.get(name, (int, float, xr.DataArray))), name
    with pytest.raises(AttributeError, match="no presure; it has time, step"):
        values.presure  # noqa: B018
    with pytest.raises(KeyError):
        values["units"]


def test_the_state_is_labelled_and_read_only():
    with dt.simulate(dt.load("smoke"), progress=False) as simulation:
        measurement = simulation.measure()
        assert (
            measurement.pressure.sel(wall="top") == measurement.pressure[5] > 0.0
            and measurement.units["pressure"] == "Pa"
        )
        assert (
            measurement.wall_force.dims == ("wall", "xyz")
            and measurement.loss.sel(channel="rolling") == 0.0
        )
        assert isinstance(measurement.filling_factor, float) and "bottom 0, top 89" in repr(
            measurement
        )
        arrays = (measurement.pressure, simulation.positions, simulation.contacts["overlap"])
        for array in (*arrays, *simulation.forces()):
            with pytest.raises(ValueError, match="read-only|is a view"):
                array[...] = 0.0
        words = "Simulation smoke: 60 grains, step 0 of 4,000, t = 0 s, φ = 0.1279"
        assert words in repr(simulation)


def test_the_progress_of_a_run_is_one_output_of_a_notebook(monkeypatch):
    outputs = []

    class Shell:
        kernel = object()

    class Handle:
        def update(self, shown, raw):
            outputs[-1].append(shown["text/plain"])

    def display(shown, raw, display_id):
        outputs.append([shown["text/plain"]])
        assert "<progress" in shown["text/html"] and display_id
        return Handle()

    ipython = SimpleNamespace(get_ipython=Shell, display=SimpleNamespace(display=display))
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", ipython.display)
    monkeypatch.setattr(progress, "REDRAW", 0.0)
    with dt.simulate(dt.from_yaml(STAGED)) as simulation:
        simulation.run()
    (lines,) = outputs
    assert len(lines) > 2 and re.fullmatch(r"step [\d,]+  100%.*  \d+\.\d s", lines[-1])
    with dt.simulate(dt.from_yaml(PLAIN), progress=False) as simulation:
        simulation.run()
    assert len(outputs) == 1


def test_names_wait_for_nothing():
    code = (
        "import sys, dusttaichi as dt; dt.load; dt.Scene; assert 'make_sample' in dir(dt);"
        "print([m for m in ('taichi', 'xarray', 'netCDF4') if m in sys.modules])"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == "[]"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        dt.nothing  # noqa: B018


# What takes 0.3 s and more to import, and is for results or for units out of the list.
LATER = (
    "pandas", "xarray", "dask", "matplotlib", "pint", "dusttaichi.analysis", "dusttaichi.plots",
)  # fmt: skip


def test_a_run_imports_what_its_steps_need(tmp_path):
    """What analyses results is imported at the end of a run."""
    words = ["run", "smoke", "--set", "stop.steps=40", "--output", str(tmp_path / "out")]
    code = (
        "import sys; from dusttaichi import running; from dusttaichi.commands.app import main\n"
        "execute = running.execute\n"
        "def end(*arguments, **options):\n"
        "    execute(*arguments, **options)\n"
        f"    sys.exit(repr([name for name in {LATER} if name in sys.modules]))\n"
        f"running.execute, sys.argv[1:] = end, {words}\n"
        "main()\n"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (tmp_path / "out" / RESULT).exists(), process.stderr
    assert process.stderr.splitlines()[-1] == "[]"
