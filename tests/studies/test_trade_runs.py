"""The trade between speed and accuracy as a study: which points are accepted and combined; runs."""

import math
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import xarray as xr
from program import dust
from scenes import PAIR_TEXT as PAIR
from scenes import edit_base
from scenes import scene as scene_of

from dusttaichi import analysis
from dusttaichi.analysis.observables import ObservableValues
from dusttaichi.errors import DustError
from dusttaichi.method.variants import KINDS, NUMERICAL, PHYSICAL, Variant
from dusttaichi.scene import from_yaml
from dusttaichi.studies import points
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies.study_types import PointResult, ResultStore
from dusttaichi.studies.trade_judge import (
    Judge,
    Row,
    combine_offers,
    find_cheapest,
    rank_offers,
)
from dusttaichi.studies.trade_plan import TradePlan, make_base_scene
from dusttaichi.studies.trade_report import write_yaml
from dusttaichi.studies.trade_study import TradeStudy, measure_trade
from dusttaichi.studies.workers import Answer

# -- points --------------------------------------------------------------------------------------


class Counted:
    """An engine whose runs cost nothing."""

    def __init__(self):
        self.ran = []

    def __call__(self, study, **_):
        values = {}
        while points := study.points(values):
            for point in points:
                self.ran.append(point.label)
                fraction = point.scene.numerics.step_fraction
                value = ObservableValues({"restitution": 0.5 + fraction**3})
                result = {"status": "finished: 40 ns", "steps": 100, "ledger": 1e-10}
                result |= {"time_step": 1e-4, "measured": value}
                values[point.label] = PointResult(point, measured=result, cost=2.0 / fraction)
        return values


def test_equal_scenes_are_run_once_and_refused_ones_not_at_all(tmp_path):
    """`balanced` is the scene itself, and a draft of a collision is refused."""
    expected = TradePlan(names=("step_fraction",), seeds=1)
    study, counted = TradeStudy(from_yaml(PAIR), tmp_path, expected), Counted()
    counted(study)
    assert counted.ran[0] == "default" and "balanced" not in counted.ran
    assert len(set(counted.ran)) == len(counted.ran) and "default_again" in counted.ran
    rows = {row.variant.label: row for row in study.trade.rows}
    assert rows["balanced"].ratio == rows["default"].ratio == 1.0
    assert rows["step_fraction = 0.05"].ratio == pytest.approx(4.0)
    assert rows["draft"].code == 2 and "kinetic energy" in rows["draft"].status


def test_threads_are_those_of_every_run(tmp_path):
    """Also of the reference, whose numerics are its own; the YAML to paste has none."""
    study = TradeStudy(from_yaml(PAIR), tmp_path, TradePlan(("step_fraction",), seeds=1), threads=2)
    counted = Counted()
    answers = counted(study)
    assert {answer.point.scene.numerics.threads for answer in answers.values()} == {2}
    assert "threads" not in study.dataset(answers).attrs["cheapest_yaml"]


def mode(point, **options):
    return point.choose_mode(
        ResultStore(**({"force": False, "resume": True, "timed": True} | options))
    )


def test_a_cost_is_that_of_this_code(tmp_path, monkeypatch):
    study = TradeStudy(from_yaml(PAIR), tmp_path, TradePlan())
    (point,) = study.points({})
    monkeypatch.setattr(points.Point, "_read_status", lambda point, timed: "finished: 40 ns")
    assert mode(point, timed=False) is None
    assert mode(point) == "force"
    point.directory.mkdir()
    timed = ResultStore(force=False, resume=True, timed=True)
    point.save_answer(Answer(values={"cost": 2.5}), timed)
    assert point.cost == 2.5
    assert mode(point) is None
    monkeypatch.setattr(points, "package_hash", lambda: "another version")
    assert mode(point) == "force"
    (point.directory / points.COST).write_text("{")  # a file that is cut short
    assert point.cost is None


def test_a_run_that_a_guard_has_stopped_is_a_result(tmp_path, monkeypatch):
    """It would be stopped again: the next call of the command does not repeat it."""
    study = TradeStudy(from_yaml(PAIR), tmp_path, TradePlan())
    (point,) = study.points({})
    point.directory.mkdir()
    monkeypatch.setattr(points.Point, "_read_status", lambda point, timed: "At 3 ns: a guard")
    assert mode(point) == "force"
    timed = ResultStore(force=False, resume=True, timed=True)
    point.save_answer(Answer(3, "a guard"), timed)
    assert mode(point) is None
    assert mode(point, force=True, resume=False) == "force"  # the user may want it

    class Asked:
        scene, directory, file, timed = study.scene, tmp_path, tmp_path / "none.nc", True
        points = staticmethod(lambda answers: [point])

    found = engine.run(Asked, resume=True)[point.label]
    assert (found.code, found.text) == (3, "a guard")
    monkeypatch.setattr(points, "package_hash", lambda: "another version")
    assert mode(point) == "force"


# -- the command ---------------------------------------------------------------------------------


@pytest.fixture
def counted_runs(monkeypatch, tmp_path):
    monkeypatch.setattr(engine, "run", Counted())
    (tmp_path / "pair.yaml").write_text(PAIR)
    words = ["trade", tmp_path / "pair.yaml", "-o", tmp_path / "out", "--jobs", 1]
    words += ["--parameters", "step_fraction,damping", "--tolerance", "2%"]
    return partial(dust, *words)


def test_command_writes_file_figure_table_and_advice(counted_runs, tmp_path, capsys, monkeypatch):
    counted_runs("--quiet")
    output = capsys.readouterr()
    # 0.5 + f^3: 0.25 errs by 3.1 %, 0.2 by 1.6 %
    assert "cheapest within 2 %, numerical parameters only: the unchanged scene" in output.out
    assert "scatter between seeds is unknown" in output.out
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


def test_command_tells_of_settings_to_paste(counted_runs, capsys):
    counted_runs("--tolerance", "10%")
    output = capsys.readouterr()
    assert "numerics: {step_fraction: 0.3, time_step: auto}" in output.out.replace(
        "{time_step: auto, step_fraction: 0.3}", "{step_fraction: 0.3, time_step: auto}"
    )


# -- real runs -----------------------------------------------------------------------------------


class Default(TradeStudy):
    """The unchanged scene alone, and one that its build refuses."""

    def points(self, answers):
        changes = {"stop": {"time": "40 ns"}, "numerics.time_step": "20 ns"}
        wild = points.Point.from_changes(self.scene, self.directory, "wild", changes)
        return [*super().points({}), wild]


def test_real_runs(tmp_path, monkeypatch):
    study = Default(from_yaml(PAIR), tmp_path, TradePlan())
    answers = engine.run(study, jobs=1, resume=True)
    study.results = answers
    default, wild = (study._make_row(None, answers[name].point) for name in ("default", "wild"))
    assert default.ok and default.status.startswith("finished")
    assert default.cost > 0.0 and default.ratio == 1.0
    # a pair at 0.3 m/s bounces; e is that of the run itself
    with analysis.open_run(tmp_path / "default") as run:
        assert (
            default.measured.values["restitution"] == analysis.measure_restitution(run).coefficient
        )
        assert default.ledger == analysis.compute_ledger(run).worst
        assert default.steps == int(run.series.step[-1])
    assert wild.code == 2 and "not stable" in wild.status  # the build's own words
    # a finished point is read again, with its cost
    seen = []

    def refused(runner, left):
        seen.extend(left)
        return {label: Answer(2) for label in left}

    monkeypatch.setattr(engine.PointRunner, "_run_points", refused)
    repeated_answers = engine.run(study, jobs=1, resume=True)
    assert seen == ["wild"] and repeated_answers["default"].cost == default.cost


def end_of(stages):
    """What a generator of stages returns."""

    def ended():
        ends.append((yield from stages))

    ends = []
    assert not any(ended())
    return ends[0]


class Model:
    """Runs in closed form: value 100 (1 + errors) and cost by what is changed."""

    ERRORS = {"rolling": 0.03, "speed": 0.3, "skin": 0.0}

    def __init__(self, again=1.0):
        self.asked, self.again = [], again

    def run(self, variants):
        self.asked += [variant.label for variant in variants]
        yield []
        return [self.result(variant) for variant in variants]

    def result(self, point):
        c = point.changes
        if point.repeats:
            measured = ObservableValues({"strength": 104.0})
            return Row(point, 0, "finished", 10.0 * self.again, self.again, measured=measured)
        if c.get("numerics.precision") == "f32":
            return Row(point, 2, "refused: f32")
        if c.get("numerics.precision") == "f64":
            return Row(point, 3, "a guard", cost=1.0, ratio=0.1)
        block = c.get("numerics", {})
        preset = {"reference": 0.05, "fast": 0.28}.get(block.get("accuracy"), 0.2)
        fraction = c.get("numerics.step_fraction", preset)
        value, cost = fraction**2, 0.2 / fraction  # of second order
        if c.get("interaction.rolling") == "off":
            value, cost = value + 0.03, 0.8 * cost
        if "boundary.wall_speed" in c:
            factor = float(c["boundary.wall_speed"].split()[0])
            value, cost = value + 0.01 * (factor - 1.0), cost / factor
        value += 0.02 * c.get("sample.seed", 1) - 0.02
        measured = ObservableValues({"strength": 100.0 * (1.0 + value)})
        return Row(point, 0, "finished", 10.0 * cost, cost, 100, 1e-10, 1e-4, measured)


def model_trade(again=1.0, **options):
    model = Model(again)
    # wall speed 1 cm/s, so that the text of a changed one is the factor; one seed differs by 0.02
    base = make_base_scene(scene_of(sample="{kind: rbd, grains: 100, seed: 1}"))
    names = ("step_fraction", "precision", "speed", "rolling")
    expected = TradePlan(**({"names": names, "tolerance": 0.09, "seeds": 2} | options))
    return end_of(measure_trade(base, model.run, expected)), model


def row(label, ratio, error):
    """A Row "parameter = level" whose cost is `ratio` of the default's."""
    name, _, text = label.partition(" = ")
    point = Variant(label, name, text, changes={name: (ratio, error)})
    return Row(point, 0, "", ratio, ratio, measured=ObservableValues({"p_m": 1.0 + error}))


def test_trade_takes_the_cheapest_within_the_tolerance():
    outcome, model = model_trade()
    judge = outcome.judge
    assert model.asked[0] == "default" and judge.name == "strength"
    by = {row.variant.label: row for row in outcome.rows}
    right = 1.0 + 0.05**2
    assert judge.error(by["step_fraction = 0.3"]) == pytest.approx(
        (0.09 - 0.0025) / right, rel=1e-9
    )
    assert judge.convergence["strength"] == pytest.approx((0.0025 - 0.000625) / right, rel=1e-9)
    assert judge.scatter["strength"] == pytest.approx(0.02 / math.sqrt(2) / right, rel=1e-9)
    assert judge.converged
    # below the scatter of 0.014, not merely within the tolerance
    free = {label for label, row in by.items() if judge.is_free(row)}
    assert free == {"reference", "step_fraction = 0.05", "step_fraction = 0.1"}
    # 0.3 of the period errs by 0.087: accepted, and the cheapest of the numerical parameters
    assert outcome.numerical.variant.label == "step_fraction = 0.3"
    # with the wall four times as fast it is 0.117: too much; twice as fast 0.097: too much as
    # well; and so is rolling left out. Alone, the fastest wall and no rolling err by less
    assert outcome.anything.variant.label == "speed = 4"
    assert by["step_fraction = 0.3 + speed = 4"].ratio == pytest.approx(1 / 6)
    assert not judge.accepts(by["step_fraction = 0.3 + speed = 4"])


def test_where_the_scene_errs_too_much_the_way_begins_at_a_dearer_row():
    """It errs by 0.0375; 0.15 of the period by 0.02 at 4/3 of the cost, without rolling by 0.05."""
    outcome, model = model_trade(tolerance=0.03, names=("step_fraction", "rolling"))
    by = {row.variant.label: row for row in outcome.rows}
    assert not outcome.judge.accepts(by["default"]) and by["default"].ratio == 1.0
    assert outcome.anything.variant.label == "step_fraction = 0.15"
    assert "step_fraction = 0.15 + rolling = off" in by
    assert not outcome.judge.accepts(by["step_fraction = 0.15 + rolling = off"])


def test_noise_is_that_of_a_second_run():
    """A quarter: rolling left out, at 0.8 of the cost, is not combined; the preset saves 29 %."""
    assert model_trade()[0].noise == 0.02
    outcome, model = model_trade(again=1.25)
    assert outcome.noise == 0.25 and "default again" in model.asked
    assert outcome.anything.variant.label == "speed = 4"
    outcome, _ = model_trade(again=1.25, names=("rolling",))
    assert outcome.anything.variant.label == "fast"
    assert not any(row.variant.parameter == "combined" for row in outcome.rows)


def test_the_cheapest_is_not_dearer_than_the_scene_as_it_is():
    judge = Judge(ObservableValues({"p_m": 1.0}), "p_m", {"p_m": 0.001}, {"p_m": 0.0}, 0.05)
    # the default ran beside itself while the machine was busy
    rows = [row("default", 1.1, 0.01), row("skin = 0.1", 1.05, 0.01), row("skin = 0.2", 0.99, 0.0)]
    assert find_cheapest(rows, judge, (NUMERICAL,), 0.02) is rows[0]
    assert (
        find_cheapest([*rows, row("skin = 0.3", 0.9, 0.01)], judge, (NUMERICAL,), 0.02)
        is not rows[0]
    )
    # where the scene itself errs too much, what does not may be dearer
    rows[0] = row("default", 1.0, 0.3)
    assert find_cheapest(rows, judge, (NUMERICAL,), 0.02) is rows[2]


def test_what_is_combined_holds_together():
    outcome, _ = model_trade(tolerance=0.12)
    assert outcome.anything.variant.label == "step_fraction = 0.3 + speed = 4"
    assert outcome.anything.variant.kind == PHYSICAL
    assert outcome.anything.ratio == pytest.approx(1 / 6)
    text = write_yaml(outcome, outcome.anything, scene_of())
    plain = "".join(
        line
        for line in edit_base("numerics", "").splitlines(keepends=True)
        if not line.startswith("boundary:")
    )
    pasted = from_yaml(plain + text)
    assert pasted.numerics.step_fraction == 0.3 and pasted.boundary.wall_speed == 0.04
    assert "threads" not in text


def test_refused_and_guarded_points_are_results():
    outcome, _ = model_trade()
    failed = {row.variant.label: row.status for row in outcome.rows if not row.ok}
    assert failed == {"precision = f64": "a guard", "precision = f32": "refused: f32"}
    guarded = next(r for r in outcome.rows if r.variant.label == "precision = f64")
    assert not outcome.judge.accepts(guarded) and math.isnan(outcome.judge.error(guarded))
    base = make_base_scene(scene_of())

    def run(variants):
        yield []
        return [Row(variant, 3, "too fast") for variant in variants]

    with pytest.raises(DustError, match="the unchanged scene does not run.*too fast"):
        end_of(measure_trade(base, run, TradePlan()))
    with pytest.raises(DustError, match=r"--observable sound_speed.*allowed: strength"):
        model_trade(observable="sound_speed")


def test_next_level_is_tried_where_the_error_of_a_combination_is_too_large():
    """0.02 at 0.5, and 0.01 at 0.6 of the cost; errors add up, 0.04 is allowed."""
    reference = ObservableValues({"p_m": 1.0})
    judge = Judge(reference, "p_m", {"p_m": 0.001}, {"p_m": 0.0}, 0.04)

    rows = [
        row("a = 1", 0.5, 0.02),
        row("b = 1", 0.5, 0.03),
        row("b = 2", 0.6, 0.01),
        row("b = 3", 0.99, 0.0),
        row("c = 1", 0.3, 0.05),
    ]
    ladders = rank_offers(rows, judge, noise=0.02)
    # b = 3 saves less than the noise, c errs by too much; a saves most for its error
    assert [[r.variant.label for r in ladder_rows] for ladder_rows in ladders] == [
        ["a = 1"],
        ["b = 1", "b = 2"],
    ]

    def run(variants):
        yield []
        (variant,) = variants
        changes = list(variant.changes.values())
        of_both = row("x", math.prod(p[0] for p in changes), sum(p[1] for p in changes))
        return [replace(of_both, variant=variant)]

    offers, last = end_of(combine_offers(None, ladders, run, judge))
    assert [r.variant.label for r in offers] == ["a = 1 + b = 1", "a = 1 + b = 2"]
    assert last.ratio == pytest.approx(0.3) and last.variant.label == "a = 1 + b = 2"


def test_without_seeds_nothing_is_free_but_below_the_reference_own_error():
    reference = ObservableValues({"sound_speed": 500.0})
    judge = Judge.from_runs(
        reference, ObservableValues({"sound_speed": 501.0}), reference, [reference], tolerance=0.05
    )
    assert judge.floor == judge.convergence["sound_speed"] == pytest.approx(0.002)
    rows = [
        Row(Variant("", ""), 0, "", measured=ObservableValues({"sound_speed": v}))
        for v in (500.9, 502.0)
    ]
    assert [judge.is_free(row) for row in rows] == [True, False]
    stuck = ObservableValues({"restitution": 0.0, "growth_efficiency": 0.9})
    assert Judge.from_runs(stuck, stuck, stuck, [stuck], tolerance=0.05).name == "growth_efficiency"


def test_scatter_hides_errors_of_numerics_only():
    reference = ObservableValues({"p_m": 1.0})
    judge = Judge(reference, "p_m", {"p_m": 0.5}, {"p_m": 0.0}, 0.05)
    wrong = ObservableValues({"p_m": 1.3})
    rows = {kind: Row(Variant("", "", kind=kind), 0, "", measured=wrong) for kind in KINDS}
    assert {kind: judge.accepts(row) for kind, row in rows.items()} == {
        "numerical": True,
        "physical": False,
        "sample": False,
    }
    assert judge.is_free(rows[PHYSICAL])
