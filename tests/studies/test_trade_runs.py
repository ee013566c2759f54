"""The trade between speed and accuracy: points that are kept, the command, real runs."""

import importlib
import json
import math
import sys

import numpy as np
import pytest
import xarray as xr
from scenes import PAIR_TEXT as PAIR

from dusttaichi import analysis
from dusttaichi.analysis.observables import Measured
from dusttaichi.commands.app import app
from dusttaichi.errors import DustError
from dusttaichi.scene import from_yaml
from dusttaichi.studies.trade import parameters, scenes
from dusttaichi.studies.trade.point import NUMERICAL, Point, PointResult
from dusttaichi.studies.trade.runner import Runner
from dusttaichi.studies.trade.trade import DEFAULT

MEASURE = importlib.import_module("dusttaichi.studies.trade.measure")

# -- runs that are kept --------------------------------------------------------------------------


class Counted(Runner):
    """A Runner whose runs cost nothing; `stop_at` is interrupted."""

    stop_at = None

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        self.ran = []

    def _measure(self, point, scene, folder):
        if point.label == self.stop_at:
            self.stopped.set()
            raise KeyboardInterrupt
        self.ran.append(point.label)
        fraction = scene.numerics.step_fraction
        value = Measured({"restitution": 0.5 + fraction**3})
        return PointResult(0, "finished: 40 ns", 2.0 / fraction, None, 100, 1e-10, 1e-4, value)


def test_finished_points_are_used_again(tmp_path):
    base = scenes.base(from_yaml(PAIR))
    points, _ = parameters.ladder(base, ("step_fraction",))
    first = Counted(base, tmp_path, jobs=1)
    first.stop_at = points[2].label
    first.run([DEFAULT])
    with pytest.raises(KeyboardInterrupt):
        first.run(points)
    assert first.ran == ["default", points[0].label, points[1].label]
    again = Counted(base, tmp_path, jobs=1)
    done = []
    results = again.run([DEFAULT]) | again.run(points, done=lambda p, r: done.append(p.label))
    assert again.ran == [p.label for p in points[2:]]
    assert sorted(done) == sorted(p.label for p in points)
    assert results[points[0].label].ratio == 4.0  # read again
    other = scenes.base(from_yaml(PAIR.replace("0.3 m/s", "0.4 m/s")))
    changed = Counted(other, tmp_path, jobs=1)
    changed.run([DEFAULT])
    assert changed.ran == ["default"]  # of another scene: run anew
    (changed.folder(DEFAULT) / "point.json").write_text("{")  # a file that is cut short
    mended = Counted(other, tmp_path, jobs=1)
    mended.run([DEFAULT])
    assert mended.ran == ["default"]


def test_equal_scenes_are_run_once_and_refused_ones_not_at_all(tmp_path):
    base = scenes.base(from_yaml(PAIR))
    runner = Counted(base, tmp_path, jobs=2)
    runner.run([DEFAULT])
    presets = {point.label: point for point in parameters.parameters_of(base).presets(base)}
    wrong = Point("wrong", "x", "", math.nan, NUMERICAL, {"numerics.step_fraction": 7.0})
    results = runner.run([presets["balanced"], wrong])
    assert runner.ran == ["default"]
    assert results["balanced"].ratio == 1.0  # of the two own costs
    assert results["wrong"].code == 2 and "step_fraction" in results["wrong"].status


# -- the command ---------------------------------------------------------------------------------


@pytest.fixture
def counted(monkeypatch, tmp_path):
    monkeypatch.setattr(MEASURE, "Runner", Counted)
    (tmp_path / "pair.yaml").write_text(PAIR)
    words = [
        "trade",
        str(tmp_path / "pair.yaml"),
        "-o",
        str(tmp_path / "out"),
        "--knobs",
        "step_fraction,damping",
        "--tolerance",
        "2%",
        "--jobs",
        "1",
    ]
    return lambda *more: app([*words, *more], standalone_mode=False)


def test_command_writes_file_figure_table_and_advice(counted, tmp_path, capsys, monkeypatch):
    counted("--quiet")
    said = capsys.readouterr()
    # 0.5 + f^3: 0.25 errs by 3.1 %, 0.2 by 1.6 %
    assert "cheapest within 2 %, numerical parameters only: the unchanged scene" in said.out
    assert "scatter between seeds is unknown" in said.out
    with xr.open_dataset(tmp_path / "out/trade.nc") as data:
        assert data.attrs["observable"] == "restitution" and data.attrs["tolerance"] == 0.02
        labels = data.label.values.tolist()
        assert labels[:5] == ["default", "draft", "fast", "balanced", "reference"]
        assert float(data.cost_ratio[labels.index("step_fraction = 0.05")]) == pytest.approx(4.0)
        error = float(data.error[labels.index("step_fraction = 0.3")])
        assert error == pytest.approx((0.3**3 - 0.05**3) / (0.5 + 0.05**3), rel=1e-9)
        assert data.accepted.values[labels.index("step_fraction = 0.3")] == 0
        assert "sample: {kind: pair" in np.atleast_1d(data.attrs["scene_given"])[0]
    assert (tmp_path / "out/trade.png").stat().st_size > 10_000
    # plotted again from the file alone
    monkeypatch.setitem(sys.modules, "taichi", None)
    app(["plot", str(tmp_path / "out"), "-o", str(tmp_path)], standalone_mode=False)
    assert (tmp_path / "trade.png").exists()


def test_command_tells_of_settings_to_paste_and_of_progress(counted, capsys):
    counted("--tolerance", "10%")
    said = capsys.readouterr()
    assert "numerics: {step_fraction: 0.3, time_step: auto}" in said.out.replace(
        "{time_step: auto, step_fraction: 0.3}", "{step_fraction: 0.3, time_step: auto}"
    )
    assert "1 of " in said.err and "step_fraction = 0.3: cost 0.67" in said.err


def test_command_that_is_interrupted_says_how_to_go_on(counted, tmp_path, monkeypatch):
    monkeypatch.setattr(Counted, "stop_at", "step_fraction = 0.3")
    with pytest.raises(DustError, match=r"interrupted; finished points.*Continue with: dust"):
        counted("--quiet")
    kept = {
        json.loads(p.read_text())["result"]["status"]
        for p in (tmp_path / "out/points").rglob("point.json")
    }
    assert kept == {"finished: 40 ns"}


# -- real runs -----------------------------------------------------------------------------------


def test_real_runs(tmp_path):
    base = scenes.base(from_yaml(PAIR))
    runner = Runner(base, tmp_path, jobs=2)
    shares = []
    runner.report = lambda label, share: shares.append(share)
    default = runner.run([DEFAULT])["default"]
    assert default.ok and default.status.startswith("finished")
    assert default.cost > 0.0 and default.ratio > 0.0 and shares[-1] is None
    # a pair at 0.3 m/s bounces; e is that of the run itself
    with analysis.open_run(runner.folder(DEFAULT) / "run") as run:
        assert default.measured.values["restitution"] == analysis.restitution(run).coefficient
        assert default.ledger == analysis.ledger(run).worst
        assert default.steps == int(run.series.step[-1])
    changes = {"stop": {"time": "40 ns"}, "numerics.time_step": "20 ns"}
    wild = Point("wild", "step_fraction", "", math.nan, NUMERICAL, changes)
    refused = runner.run([wild])["wild"]
    assert refused.code == 2 and "not stable" in refused.status  # the build's own words
