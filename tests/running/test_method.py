"""A method of sixty lines (spring.py) goes through everything that a run of grains goes through:
nothing of the program knows of it."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import spring
import toy
import xarray as xr
from typer.testing import CliRunner

from dusttaichi import analysis, method, plots, report
from dusttaichi.analysis.plain import convert_ensemble, convert_runs
from dusttaichi.analysis.summary import format_columns
from dusttaichi.commands.app import app
from dusttaichi.continuum.dust_engine import DustEngine
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.export import export
from dusttaichi.grains.grain_engine import GrainEngine
from dusttaichi.method import Measurement, SimpleEngine, Start
from dusttaichi.plots.figure_registry import picture_of
from dusttaichi.results.plain import from_plain, plain
from dusttaichi.running import execute, ledger, loop
from dusttaichi.running.state import RunState
from dusttaichi.scene import from_yaml

HERE = Path(__file__).parent
PLAIN, STAGED = toy.plain(), toy.make_staged()


def test_from_the_yaml_to_the_result(tmp_path):
    with xr.open_datatree(execute(from_yaml(PLAIN), tmp_path / "run") / "result.nc") as tree:
        series = tree.to_dataset()
        t, dt = series.time.values * 1e6, 0.01
        # the leapfrog's own frequency, sin(w dt/2) = w0 dt/2: exact
        w = 2 / dt * np.arcsin(0.5 * dt * 2.0)
        np.testing.assert_allclose(series.place, 1e-6 * np.cos(w * t), atol=1e-17)
        assert float(abs(series.energy_residual_relative).max()) < 1e-12  # rounding of 2000 steps
        np.testing.assert_array_equal(series.step, np.arange(0, 2001, 100))
        np.testing.assert_array_equal(tree["snapshots"].step, np.arange(0, 2001, 250))
        assert series.attrs["stiffness"] == 4.0 and series.attrs["status"] == "finished: 2000 steps"
        assert set(series.variables) == {v.name for v in spring.VARIABLES if v.group == "series"}
        assert series.mean_speed[0] == 0.0 and series.mean_speed[1] > 0.0


def test_the_yaml_of_another_method_is_checked_as_any(tmp_path):
    with pytest.raises(DustError, match=r"stiffness = -1.*above 0.*line 6"):
        from_yaml(PLAIN.replace("4.0", "-1"))
    with pytest.raises(DustError, match=r"sample.*unknown key"):
        from_yaml(PLAIN + "sample: {kind: chain, grains: 3}\n")
    with pytest.raises(DustError, match=r'method = "string".*grains.*line 3'):
        from_yaml(PLAIN.replace("method: spring", "method: string"))
    scene = from_yaml(PLAIN)
    assert from_yaml(scene.to_yaml()) == scene and scene.with_value("drag", 0.1).drag == 0.1


def test_no_more_slow_steps_than_a_second_between_two_looks_at_ctrl_c(tmp_path, monkeypatch):
    made_steps, advance = [], spring.Spring.advance

    def slow(self, steps):
        made_steps.append(steps)
        advance(self, steps)

    monkeypatch.setattr(spring.Spring, "advance", slow)
    monkeypatch.setattr(
        loop, "real_time", SimpleNamespace(perf_counter=lambda: 0.5 * sum(made_steps))
    )
    execute(from_yaml(PLAIN), tmp_path / "run")
    assert made_steps[0] == 1 and max(made_steps) == 2


def test_guards(tmp_path):
    with pytest.raises(GuardStop, match="has snapped"):
        execute(from_yaml(PLAIN + "start: 11.0\n"), tmp_path / "own")
    # a drag that acts on the speed of half a step back makes energy where the step is long
    stiff = PLAIN.replace("4.0", "1.0").replace("10 ns", "1.9 us") + "drag: 0.9\n"
    with pytest.raises(GuardStop, match="ledger is open|snapped|not a number"):
        execute(from_yaml(stiff), tmp_path / "common")


@pytest.mark.parametrize("key", ["numerics.time_step", "numerics.cfl"])
@pytest.mark.parametrize("lost", [0.0, -1.0, np.nan])
def test_an_open_ledger_advises_the_key_that_shortens_the_step(key, lost):
    """Of the continuum that is cfl: numerics.time_step is no step of the method there."""
    start = Start.from_measurement(Measurement.from_energies(1.0, 0.0, [0.0]))
    measurement = Measurement.from_energies(2.0 - min(lost, 0.0), 0.0, [lost])
    sim = spring.Spring(from_yaml(PLAIN), 1.0)
    sim.validate, sim.step_key = lambda m: None, key
    with pytest.raises(GuardStop, match=f"Try a smaller {key}"):
        ledger.check(sim, measurement, start)
    sim.remedies, sim.name_invalid = ("less heat",), lambda: " (particle 7)"
    with pytest.raises(GuardStop) as stop:
        ledger.check(sim, measurement, start)
    particle = "is not a number (particle 7)" in str(stop.value)
    assert particle == ("or less heat" in str(stop.value)) == np.isnan(lost)
    assert DustEngine.step_key == "numerics.cfl"
    assert SimpleEngine.step_key == GrainEngine.step_key == "numerics.time_step"


def test_the_ledger_of_an_oscillation_is_measured_by_the_energy_exchanged():
    """A body released at rest, its potential energy counted from there: after a period only the
    residual is left, which is compared with the kinetic energy of the half period. An energy that
    comes from nowhere is as large as its own kinetic energy, so that it is never within bounds."""
    sim = spring.Spring(from_yaml(PLAIN), 1.0)
    start = Start.from_measurement(Measurement.from_energies(0.0, 0.0, [0.0]))
    half, full = (
        Measurement.from_energies(1.0, -0.996, [0.0]),
        Measurement.from_energies(1e-9, 0.005, [1e-6]),
    )
    ledger.check(sim, half, start)
    with pytest.raises(GuardStop, match="ledger is open"):
        ledger.check(sim, full, start)  # without a record of the half period
    for m in (half, full):
        start = start.include_record(m)
        ledger.check(sim, m, start)
    assert ledger.turnover(full, start) == pytest.approx((0.005, 1.0), rel=1e-3)
    assert from_plain(RunState, plain(RunState(start))).start == start
    for kinetic in (0.015, 1.015, 1e3):
        with pytest.raises(GuardStop, match="ledger is open"):
            ledger.check(sim, Measurement.from_energies(kinetic, 0.0, [0.0]), start)


def test_a_sweep_in_a_process_of_its_own(tmp_path):
    """An extension of the scene registers the method of an installed package."""
    (tmp_path / "own.py").write_text(
        "import spring\nfrom dusttaichi import method\nmethod.register(spring.METHOD)\n"
    )
    (tmp_path / "spring.yaml").write_text(PLAIN + "extensions: [own.py]\n")
    path = os.pathsep.join([str(HERE), str(HERE.parents[1])])
    command = [sys.executable, "-m", "dusttaichi", "sweep", "spring.yaml", "--set"]
    process = subprocess.run(
        [*command, "stiffness=2", "-q", "--json", "--no-figures", "-o", "out"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stdout + process.stderr
    (point,) = json.loads(process.stdout)["points"]  # the output holds nothing else
    assert point["keys"]["stiffness"]["value"] == 2.0
    assert point["numbers"]["swing"]["values"] == pytest.approx([1e-6])
    (file,) = (tmp_path / "out").glob("*/result.nc")
    with xr.open_dataset(file) as series:
        assert series.attrs["stiffness"] == 2.0


def test_its_results_have_its_numbers_and_figures(tmp_path, monkeypatch):
    """The table, figures, the report and JSON, from its rows and those of any run."""
    execute(from_yaml(PLAIN), tmp_path / "run")
    with analysis.open_run(tmp_path / "run") as run:
        numbers = analysis.summarise(run)
        assert run.method is spring.METHOD and numbers["swing"] == pytest.approx(1e-6)
        assert ("largest displacement", "1 um", "") in analysis.tabulate(numbers)
        assert not numbers["problems"] and set(plots.draw_figures(run)) == {"places"}
        data = report.collect_report_data([run])
        assert dict(format_columns(analysis.compare([run])))["swing"] == ["1 um"]
        assert convert_runs([run])["runs"][0]["numbers"]["swing"]["unit"] == "m"
        with pytest.raises(DustError, match="no pictures of method: spring"):
            picture_of(run)
        with pytest.raises(DustError, match='method: spring has no format "vtk"'):
            export(run, "vtk", tmp_path)
    (run_data,) = data["runs"]
    assert ["largest displacement", "1 um", ""] in run_data["table"] and run_data[
        "particles"
    ] is None
    titles = {figure["name"]: figure["title"] for figure in run_data["figures"]}
    assert titles == {"places": "Displacement over time"}


def test_the_commands_take_it_as_any_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("spring.yaml").write_text(PLAIN)
    result = CliRunner().invoke(app, ["run", "spring.yaml", "-q", "-o", "run", "--json"])
    assert result.exit_code == 0, result.output
    (run,) = json.loads(result.stdout)["runs"]
    assert run["method"] == "spring" and run["numbers"]["swing"]["value"] == pytest.approx(1e-6)
    assert Path("run/places.png").exists()
    for command in (["report"], ["plot"], ["compare"]):
        result = CliRunner().invoke(app, [*command, "run"])
        assert result.exit_code == 0, result.output


def test_results_of_a_method_that_is_not_here(tmp_path, monkeypatch):
    """What is so of any run is shown."""
    execute(from_yaml(PLAIN), tmp_path / "run")
    monkeypatch.setattr(method.METHODS, "added", {})
    with analysis.open_run(tmp_path / "run") as run:
        numbers = analysis.summarise(run)
        assert numbers["method"] == "spring" and "swing" not in numbers
        assert ("steps", "2,000", "") in analysis.tabulate(numbers)
        assert plots.draw_figures(run) == {}


def test_a_sweep_has_its_numbers(tmp_path):
    axes = {"start": xr.Variable("start", [1e-6, 2e-6], {"units": "m", "key": "start"})}
    for value in (1.0, 2.0):
        execute(from_yaml(PLAIN + f"start: {value}\n"), tmp_path / f"{value:g}")
    runs = [analysis.open_run(tmp_path / name) for name in "12"]
    data = analysis.gather(runs, axes, attrs={"title": "springs"})
    np.testing.assert_allclose(data.swing.values.ravel(), [1e-6, 2e-6])
    assert data.swing.attrs == {"long_name": "largest displacement", "units": "m"}
    points = convert_ensemble(data)["points"]
    assert [p["keys"]["start"]["value"] for p in points] == [1e-6, 2e-6]
    assert [p["numbers"]["swing"]["mean"] for p in points] == pytest.approx([1e-6, 2e-6])
    assert {"numbers", "sweep"} <= set(plots.draw_figures(data))
