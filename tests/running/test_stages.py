"""Stages of one run; plates. One compiled scene each."""

import os
import signal

import numpy as np
import pytest
import xarray as xr
from bits import assert_same_bits

from dusttaichi.errors import DustError, Interrupted
from dusttaichi.physics import geometry
from dusttaichi.running import execute
from dusttaichi.running import loop as running
from dusttaichi.running.identity import check_same
from dusttaichi.scene import from_yaml

CELL = """
name: {name}
material: ice_t19
interaction: {{damping: viscoelastic}}
sample: {{kind: bcca, grains: 64, seed: 2}}
boundary: {{kind: periodic, size: cube}}
stages:
  - {{name: press, drive: {{compression_rate: 1.0e-4}}, stop: {{filling_factor: 0.08}}}}
  - {{name: relax, stop: {{steps: 500}}}}
  - {{name: pull, drive: {{face_speed: [2 m/s, 0 m/s, 0 m/s]}}, stop: {{{end}}},
      output: {{snapshots: {{strain: 0.1}}}}}}
numerics: {{threads: 1}}
output: {{series: {{steps: 200}}, snapshots: off}}
"""


def cell(end="strain: 0.3", name="cell"):
    return from_yaml(CELL.format(end=end, name=name))


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    return execute(cell(), tmp_path_factory.mktemp("whole") / "run")


def test_stages_follow_each_other(uninterrupted):
    with xr.open_datatree(uninterrupted / "result.nc") as t:
        series = t.to_dataset()
        assert series.attrs["stages"] == "press relax pull"
        assert series.attrs["status"] == "finished: strain 0.3"
        stage = series.stage.values
        np.testing.assert_array_equal(np.unique(stage), [0, 1, 2])
        assert np.all(np.diff(stage) >= 0) and np.all(np.diff(series.step) > 0)
        ends = [np.flatnonzero(stage == k)[-1] for k in range(3)]
        phi, edges = series.filling_factor.values, series.box_length.values
        # the end of a stage is a whole step: one changes the filling factor by 6 C_v dt/t_c = 2e-4
        assert phi[ends[0]] == pytest.approx(0.08, rel=3e-4) and phi[ends[0]] >= 0.08
        assert int(series.step[ends[1]] - series.step[ends[0]]) == 500
        np.testing.assert_array_equal(edges[ends[0]], edges[ends[1]])
        assert edges[-1, 0] / edges[ends[1], 0] == pytest.approx(1.3, rel=1e-3)  # one step again
        np.testing.assert_allclose(edges[-1, 1:], edges[ends[1], 1:], rtol=1e-14)  # re-anchored
        # the ledger goes on over the changes of the drive
        assert float(abs(series.energy_residual_relative).max()) < 5e-3
        # a frame at the start, at the end of every stage, and every 0.1 of strain in the last
        steps = t["snapshots"].step.values
        assert set(series.step.values[ends]) | {0} <= set(steps) and len(steps) == 6
        inside = t["snapshots"].position.values
        box = t["snapshots"].box.values
        assert np.all(inside >= box[:, None, 0::2]) and np.all(inside <= box[:, None, 1::2])


def test_resume_across_stages_ends_with_the_same_bits(uninterrupted, tmp_path, monkeypatch):
    monkeypatch.setattr(running, "BURST_SECONDS", 0.001)
    with xr.open_dataset(uninterrupted / "result.nc") as series:
        ends = [int(series.step[series.stage == k][-1]) for k in range(3)]
    directory = tmp_path / "parts"
    begun = {}
    moments = ends[0] - 300, ends[0] + 200, ends[1] + 600
    for moment, number in zip(moments, (signal.SIGINT, signal.SIGTERM, signal.SIGINT), strict=True):
        done = []

        def interrupt(progress, moment=moment, done=done, number=number):
            if progress.step > moment and not done:
                done.append(True)
                os.kill(os.getpid(), number)

        with pytest.raises(Interrupted):
            execute(cell(), directory, report=interrupt, **begun)
        with xr.open_dataset(directory / "result.nc") as series:
            assert series.attrs["status"] == "interrupted" and 0 < series.step[-1] < ends[2]
        begun = {"resume": True}
    execute(cell(), directory, resume=True)
    assert_same_bits(uninterrupted / "result.nc", directory / "result.nc")


def test_resume_with_other_stages_to_come(uninterrupted, tmp_path):
    messages = []
    directory = execute(cell("strain: 0.1"), tmp_path / "grown", log=messages.append)
    assert messages == [
        "stage press finished: filling factor 0.08",
        "stage relax finished: 500 steps",
    ]
    with pytest.raises(DustError, match=r"stages\.0\.drive\.compression_rate"):
        execute(cell().with_value("stages.0.drive.compression_rate", 2e-4), directory, resume=True)
    execute(cell(), directory, resume=True)
    with xr.open_dataset(directory / "result.nc") as grown:
        with xr.open_dataset(uninterrupted / "result.nc") as series:
            # the record at the earlier end is one more
            assert grown.attrs["status"] == series.attrs["status"]
            np.testing.assert_array_equal(grown.kinetic_rotation[-1], series.kinetic_rotation[-1])
    check_same({"scene": cell(name="other").to_yaml(), "inputs": []}, cell(), [], 0)


PLATES = """
name: plates
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, shape: cylinder, grains: 120, seed: 3}
boundary: {kind: plates, glue: 8}
stages:
  - {name: press, drive: {wall_speed: 20 cm/s}, stop: {strain: 0.5}}
  - {name: relax, stop: {time: 1 us}}
  - {name: pull, drive: {wall_speed: -10 cm/s}, stop: {strain: 0.8, past_maximum: 0.9}}
numerics: {threads: 1}
output: {snapshots: {strain: 0.25}}
"""


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    return execute(from_yaml(PLATES), tmp_path_factory.mktemp("plates") / "run")


def test_plates_measure_the_shadow_of_the_grains(plates):
    with xr.open_datatree(plates / "result.nc") as t:
        series, frames = t.to_dataset(), t["snapshots"].to_dataset()
        radius = float(frames.radius[0])
        volume = 120 * 4 / 3 * np.pi * radius**3
        filling = volume / (series.projected_area * series.height)
        np.testing.assert_allclose(series.filling_factor, filling, rtol=1e-12)
        top, bottom = series.pressure.sel(wall="top"), series.pressure.sel(wall="bottom")
        force = series.wall_force.sel(wall="top", xyz="z")
        np.testing.assert_allclose(top, -force / series.projected_area, rtol=1e-12)
        assert float(bottom[5]) != 0.0
        at = {int(step): k for k, step in enumerate(series.step.values)}
        for frame in frames.step.values:
            x = frames.position[list(frames.step.values).index(frame)].values
            area = geometry.union_area(x[:, :2], radius)
            # the area of positions in m and of those in um: rounding of the conversion
            assert float(series.projected_area[at[int(frame)]]) == pytest.approx(area, rel=1e-9)
        # pressed to half its height the cake has spread, and none is lost
        pressed = int(np.flatnonzero(series.stage.values == 0)[-1])
        assert int(series.outside_count[0]) == 0 and int(series.outside_count[pressed]) > 3
        assert float(series.projected_area[pressed]) > 1.02 * float(series.projected_area[0])
        assert np.isfinite(frames.position.values).all()
    with xr.open_dataset(plates / "result.nc") as series:
        assert "tension has fallen by 90%" in series.attrs["status"]
        pulled = series.pressure.sel(wall="top").values[series.stage.values == 2]
        assert pulled.min() < -1e3  # some pull-off forces of 57 nN on the shadow of 120 grains
        assert float(abs(series.energy_residual_relative).max()) < 1e-2  # 2 m/s
