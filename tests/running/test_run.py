"""Runs from YAML to NetCDF: cadence, interruption, guards, refusals. One compiled scene."""

import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from bits import assert_same_bits
from program import wait_for

from dusttaichi.analysis import open_run, summarise, tabulate
from dusttaichi.commands.app import app, main
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.running import execute, interrupts
from dusttaichi.scene import from_yaml, load

BOX = """
name: small
material: silicate_s12
interaction: {{rolling: {{modifier: 8}}, sliding: {{modifier: 2.5}}, damping: viscous}}
sample: {{kind: rbd, grains: 60, seed: 3}}
boundary: {{kind: box, wall_speed: {speed}}}
stop: {stop}
# a gas of 60 fast grains: what its ledger leaves open is some 1 %, and chaotic
numerics: {{time_step: 0.3 ns, threads: 1, ledger_tolerance: 0.05}}
output:
  series: {series}
  profiles: {{filling_factor: 0.05}}
  snapshots: {{steps: 400}}
  checkpoint: {checkpoint}
"""


def box(stop="{steps: 1500}", series="{steps: 50}", speed="1 m/s", checkpoint="1000 s"):
    return BOX.format(stop=stop, series=series, speed=speed, checkpoint=checkpoint)


def dust(*args, cwd, **kwargs):
    command = [
        sys.executable,
        "-c",
        "from dusttaichi.commands.app import main; main()",
        *map(str, args),
    ]
    return subprocess.Popen(
        command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **kwargs
    )


@pytest.fixture(scope="module")
def finished_run(tmp_path_factory):
    """A run of 1500 steps to its end."""
    directory = tmp_path_factory.mktemp("run") / "whole"
    return execute(from_yaml(box()), directory)


def test_series_and_snapshots_stand_at_the_steps_asked_for(finished_run):
    with xr.open_dataset(finished_run / "result.nc") as series:
        np.testing.assert_array_equal(series.step, np.arange(0, 1501, 50))
        assert series.attrs["status"] == "finished: 1500 steps"
        # the filling factor is that of a box whose lid sinks by 1 m/s, S12 eq 28: exact
        height = series.height[0] - 1.0 * series.time
        np.testing.assert_allclose(
            series.filling_factor * height, series.filling_factor[0] * series.height[0], rtol=1e-12
        )
        assert series.pressure.dims == ("time", "wall") and series.pressure.attrs["units"] == "Pa"
    with xr.open_datatree(finished_run / "result.nc") as t:
        # every 400 steps, the first and the last
        np.testing.assert_array_equal(t["snapshots"].step, [0, 400, 800, 1200, 1500])
        phi = t["profiles"].box_filling_factor.to_numpy()
        assert np.all(np.abs(phi[1:] / 0.05 - np.round(phi[1:] / 0.05)) < 0.02)
        # slices of exact volume add up to all grains
        profile = t["profiles"].filling_factor.to_numpy()[0]
        edges = t["profiles"].bin_upper.to_numpy().clip(max=float(t["profiles"].height[0]))
        heights = np.diff(edges, prepend=0.0)
        mean = np.nansum(profile * heights) / heights.sum()
        # less the caps that overlap the walls by a fraction of a nanometre
        assert mean == pytest.approx(phi[0], rel=1e-6)
    with xr.open_dataset(finished_run / "result.nc") as series:
        # leapfrog at 0.2 of the stiffest period: some 1e-3 of the energy that went through;
        # a channel booked wrongly would show as several per cent
        assert float(np.abs(series.energy_residual_relative).max()) < 5e-3
        assert float(series.wall_work[-1]) > 0.0


def test_window_of_some_steps_only(finished_run, tmp_path):
    scene = from_yaml(box().replace("output:", "output:\n  window: 10"))
    with xr.open_dataset(execute(scene, tmp_path / "w") / "result.nc") as windowed:
        with xr.open_dataset(finished_run / "result.nc") as stored:
            # the same motion, another average of the force
            np.testing.assert_array_equal(windowed.wall_work, stored.wall_work)
            assert not np.array_equal(windowed.pressure, stored.pressure)


def test_kill_9_leaves_a_result_and_resume_ends_with_the_same_bits(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").write_text(
        box(
            stop="{filling_factor: 0.3}",
            series="{filling_factor: 0.01}",
            speed="60 cm/s",
            checkpoint="0.1 s",
        )
    )
    process = dust("run", "a.yaml", "-q", "-o", "parts", cwd=tmp_path)
    checkpoint = tmp_path / "parts/checkpoint.bin"
    wait_for(checkpoint, process)
    time.sleep(0.1)
    process.kill()
    process.communicate()
    assert checkpoint.exists()
    with xr.open_dataset(tmp_path / "parts/result.nc") as series:
        count_before = series.sizes["time"]
    monkeypatch.chdir(tmp_path)
    app(["run", "a.yaml", "-q", "-o", "parts", "--resume"], standalone_mode=False)
    execute(load(tmp_path / "a.yaml"), tmp_path / "whole")
    assert_same_bits(tmp_path / "whole/result.nc", tmp_path / "parts/result.nc")
    assert count_before >= 1
    for figure in ("compression.png", "ledger.png", "profile.png"):
        assert (tmp_path / "parts" / figure).stat().st_size > 10_000


def test_resume_of_a_finished_run_with_a_later_stop_is_one_longer_run(finished_run, tmp_path):
    longer = from_yaml(box(stop="{steps: 2000}"))
    execute(from_yaml(box()), tmp_path / "grown")
    execute(longer, tmp_path / "grown", resume=True)
    uninterrupted = execute(longer, tmp_path / "whole")
    assert_same_bits(uninterrupted / "result.nc", tmp_path / "grown/result.nc")


def test_another_scene_a_result_and_a_place_that_cannot_be_are_refused(finished_run, tmp_path):
    with pytest.raises(DustError, match=r"boundary\.wall_speed"):
        execute(from_yaml(box(speed="2 m/s")), finished_run, resume=True)
    modified_before = (finished_run / "result.nc").stat().st_mtime_ns
    with pytest.raises(DustError, match="--force"):
        execute(from_yaml(box()), finished_run)
    assert (finished_run / "result.nc").stat().st_mtime_ns == modified_before
    (tmp_path / "file").write_text("not a directory")
    with pytest.raises(DustError, match="Cannot write"):
        execute(from_yaml(box()), Path(tmp_path / "file" / "run"))


def test_a_runaway_stops_with_one_sentence_and_keeps_the_result(tmp_path):
    # the lid is driven until the grains would have to overlap
    scene = from_yaml(box(stop="{filling_factor: 0.74}", speed="20 m/s"))
    with pytest.raises(GuardStop, match=r"At .* µs .*[Tt]ry"):
        execute(scene, tmp_path / "runaway")
    with xr.open_dataset(tmp_path / "runaway/result.nc") as series:
        assert series.attrs["status"].startswith("stopped by guard")
        assert series.sizes["time"] > 3
        assert np.isfinite(series.pressure).all()


def test_pressure_ends_a_run(tmp_path):
    # so many grains spinning in so dense a cake open the ledger by 1 % at 0.3 ns
    text = box(stop="{pressure: 20 kPa, filling_factor: 0.6}").replace("0.3 ns", "0.2 ns")
    scene = from_yaml(text)
    with xr.open_dataset(execute(scene, tmp_path / "p") / "result.nc") as series:
        assert float(series.pressure.sel(wall="top")[-1]) >= 20e3
        assert (series.pressure.sel(wall="top")[:-1] < 20e3).all()


def test_last_frame_is_a_sample(finished_run, tmp_path):
    repeated_scene = from_yaml(
        box(stop="{steps: 20}")
        .replace(
            "sample: {kind: rbd, grains: 60, seed: 3}",
            f"sample: {{kind: explicit, file: {finished_run}}}",
        )
        .replace("wall_speed: 1 m/s", "wall_speed: 0 m/s")
        .replace("profiles: {filling_factor: 0.05}", "profiles: off")
    )
    with xr.open_datatree(execute(repeated_scene, tmp_path / "again") / "result.nc") as new_tree:
        with xr.open_datatree(finished_run / "result.nc") as old_tree:
            for name in ("position", "velocity", "spin"):
                last, first = old_tree["snapshots"][name][-1], new_tree["snapshots"][name][0]
                # through half a step back and forth: rounding of the speeds involved
                np.testing.assert_allclose(first, last, rtol=1e-9, atol=1e-12)
            assert int(new_tree["snapshots"].contact_count[0]) == int(
                old_tree["snapshots"].contact_count[-1]
            )


def test_one_floor_is_a_scene(tmp_path):
    scene = from_yaml(
        box(stop="{steps: 200}")
        .replace(
            "kind: box, wall_speed: 1 m/s", "kind: box, omit: [x_min, x_max, y_min, y_max, top]"
        )
        .replace("profiles: {filling_factor: 0.05}", "profiles: off")
    )
    with xr.open_dataset(execute(scene, tmp_path / "floor") / "result.nc") as series:
        assert "height" not in series and "filling_factor" not in series
        force = series.wall_force.sel(wall=["x_min", "x_max", "y_min", "y_max", "top"])
        assert (force == 0).all()
        pressure = series.pressure.sel(wall=["x_min", "x_max", "y_min", "y_max", "top"])
        assert pressure.isnull().all() and series.pressure.sel(wall="bottom").notnull().all()
    assert "pressure on the top wall" not in str(tabulate(summarise(open_run(tmp_path / "floor"))))


def test_bad_input_is_a_sentence_without_traceback(tmp_path, monkeypatch, capsys):
    (tmp_path / "bad.yaml").write_text(box().replace("1 m/s", "1 cm"))
    for file, words in (("bad.yaml", ("boundary.wall_speed", "1 cm")), ("missing.yaml", ())):
        monkeypatch.setattr(sys, "argv", ["dust", "run", str(tmp_path / file)])
        with pytest.raises(SystemExit) as end:
            main()
        output = capsys.readouterr().err
        assert end.value.code == 2 and "Traceback" not in output
        assert all(word in output for word in (*words, file))


def test_a_run_that_does_not_come_to_a_pause_is_ended_by_a_further_signal(monkeypatch):
    """No loop is deaf to signals; one that is on its way to its pause is not cut short."""
    current_time = 0.0
    monkeypatch.setattr(interrupts, "real_time", SimpleNamespace(monotonic=lambda: current_time))
    with interrupts.Interrupts() as interruption:
        interruption.collect()
        signal.raise_signal(signal.SIGTERM)
        current_time = interrupts.PATIENCE - 1.0
        signal.raise_signal(signal.SIGTERM)
        current_time = interrupts.PATIENCE + 1.0
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert interruption.requested
        signal.raise_signal(signal.SIGINT)  # the run has seen it: it writes its checkpoint now
