"""The trade between speed and accuracy as a study: its points, the command, real runs."""

import sys
from functools import partial

import numpy as np
import pytest
import xarray as xr
from program import dust
from scenes import PAIR_TEXT as PAIR

from dusttaichi import analysis
from dusttaichi.analysis.observables import Measured
from dusttaichi.errors import DustError
from dusttaichi.scene import from_yaml
from dusttaichi.studies import engine, points
from dusttaichi.studies.engine import Found, Shelf
from dusttaichi.studies.trade import TradeStudy, Wanted
from dusttaichi.studies.workers import Answer

# -- points --------------------------------------------------------------------------------------


class Counted:
    """An engine whose runs cost nothing; one is interrupted."""

    def __init__(self, stop_at=None):
        self.ran, self.stop_at = [], stop_at

    def __call__(self, study, **_):
        found = {}
        while points := study.points(found):
            for point in points:
                if point.label == self.stop_at:
                    raise KeyboardInterrupt
                self.ran.append(point.label)
                fraction = point.scene.numerics.step_fraction
                value = Measured({"restitution": 0.5 + fraction**3})
                result = {"status": "finished: 40 ns", "steps": 100, "ledger": 1e-10}
                result |= {"time_step": 1e-4, "measured": value}
                found[point.label] = Found(point, measured=result, cost=2.0 / fraction)
        return found


def test_equal_scenes_are_run_once_and_refused_ones_not_at_all(tmp_path):
    """`balanced` is the scene itself, and a draft of a collision is refused."""
    wanted = Wanted(names=("step_fraction",), seeds=1)
    study, counted = TradeStudy(from_yaml(PAIR), tmp_path, wanted), Counted()
    counted(study)
    assert counted.ran[0] == "default" and "balanced" not in counted.ran
    assert len(set(counted.ran)) == len(counted.ran) and "default_again" in counted.ran
    rows = {row.point.label: row for row in study.found.rows}
    assert rows["balanced"].ratio == rows["default"].ratio == 1.0
    assert rows["step_fraction = 0.05"].ratio == pytest.approx(4.0)
    assert rows["draft"].code == 2 and "kinetic energy" in rows["draft"].status


def test_threads_are_those_of_every_run(tmp_path):
    """Also of the reference, whose numerics are its own; the YAML to paste has none."""
    study = TradeStudy(from_yaml(PAIR), tmp_path, Wanted(("step_fraction",), seeds=1), threads=2)
    counted = Counted()
    found = counted(study)
    assert {one.point.scene.numerics.threads for one in found.values()} == {2}
    assert "threads" not in study.dataset(found).attrs["cheapest_yaml"]


def mode(point, **how):
    return point.mode(Shelf(**({"force": False, "resume": True, "timed": True} | how)))


def test_a_cost_is_that_of_this_code(tmp_path, monkeypatch):
    study = TradeStudy(from_yaml(PAIR), tmp_path, Wanted())
    (point,) = study.points({})
    monkeypatch.setattr(points.Point, "_status", lambda point, timed: "finished: 40 ns")
    assert mode(point, timed=False) is None
    assert mode(point) == "force"
    point.directory.mkdir()
    timed = Shelf(force=False, resume=True, timed=True)
    point.store(Answer(found={"cost": 2.5}), timed)
    assert point.cost == 2.5
    assert mode(point) is None
    monkeypatch.setattr(points, "package_hash", lambda: "another version")
    assert mode(point) == "force"
    (point.directory / points.COST).write_text("{")  # a file that is cut short
    assert point.cost is None


def test_a_run_that_a_guard_has_stopped_is_a_result(tmp_path, monkeypatch):
    """It would be stopped again: the next call of the command does not repeat it."""
    study = TradeStudy(from_yaml(PAIR), tmp_path, Wanted())
    (point,) = study.points({})
    point.directory.mkdir()
    monkeypatch.setattr(points.Point, "_status", lambda point, timed: "At 3 ns: a guard")
    assert mode(point) == "force"
    timed = Shelf(force=False, resume=True, timed=True)
    point.store(Answer(3, "a guard"), timed)
    assert mode(point) is None
    assert mode(point, force=True, resume=False) == "force"  # the user may want it

    class Asked:
        scene, directory, file, timed = study.scene, tmp_path, tmp_path / "none.nc", True
        points = staticmethod(lambda found: [point])

    found = engine.run(Asked, resume=True)[point.label]
    assert (found.code, found.text) == (3, "a guard")
    monkeypatch.setattr(points, "package_hash", lambda: "another version")
    assert mode(point) == "force"


# -- the command ---------------------------------------------------------------------------------


@pytest.fixture
def counted(monkeypatch, tmp_path):
    monkeypatch.setattr(engine, "run", Counted())
    (tmp_path / "pair.yaml").write_text(PAIR)
    words = ["trade", tmp_path / "pair.yaml", "-o", tmp_path / "out", "--jobs", 1]
    words += ["--knobs", "step_fraction,damping", "--tolerance", "2%"]
    return partial(dust, *words)


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
    dust("plot", tmp_path / "out", "-o", tmp_path)
    assert (tmp_path / "trade.png").exists()


def test_command_tells_of_settings_to_paste(counted, capsys):
    counted("--tolerance", "10%")
    said = capsys.readouterr()
    assert "numerics: {step_fraction: 0.3, time_step: auto}" in said.out.replace(
        "{time_step: auto, step_fraction: 0.3}", "{step_fraction: 0.3, time_step: auto}"
    )


def test_command_that_is_interrupted_says_how_to_go_on(counted, monkeypatch):
    monkeypatch.setattr(engine, "run", Counted(stop_at="step_fraction_=_0.3"))
    with pytest.raises(DustError, match=r"interrupted; finished points.*Continue with: dust"):
        counted("--quiet")


# -- real runs -----------------------------------------------------------------------------------


class Default(TradeStudy):
    """The unchanged scene alone, and one that its build refuses."""

    def points(self, found):
        changes = {"stop": {"time": "40 ns"}, "numerics.time_step": "20 ns"}
        wild = points.Point.of(self.scene, self.directory, "wild", changes)
        return [*super().points({}), wild]


def test_real_runs(tmp_path, monkeypatch):
    study = Default(from_yaml(PAIR), tmp_path, Wanted())
    found = engine.run(study, jobs=1, resume=True)
    default, wild = (study._row(None, found[name], found) for name in ("default", "wild"))
    assert default.ok and default.status.startswith("finished")
    assert default.cost > 0.0 and default.ratio == 1.0
    # a pair at 0.3 m/s bounces; e is that of the run itself
    with analysis.open_run(tmp_path / "default") as run:
        assert default.measured.values["restitution"] == analysis.restitution(run).coefficient
        assert default.ledger == analysis.ledger(run).worst
        assert default.steps == int(run.series.step[-1])
    assert wild.code == 2 and "not stable" in wild.status  # the build's own words
    # a finished point is read again, with its cost
    seen = []

    def refused(left, *_, **__):
        seen.extend(left)
        return {label: Answer(2) for label in left}

    monkeypatch.setattr(engine, "_do", refused)
    again = engine.run(study, jobs=1, resume=True)
    assert seen == ["wild"] and again["default"].cost == default.cost
