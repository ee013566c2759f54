"""The trade between speed and accuracy: which points are free, accepted, cheapest, combined."""

import math
from dataclasses import replace

import pytest
from scenes import edited
from scenes import scene as scene_of

from dusttaichi.analysis.observables import Measured
from dusttaichi.errors import DustError
from dusttaichi.method.trade import KINDS, NUMERICAL, PHYSICAL, Point
from dusttaichi.scene import from_yaml
from dusttaichi.studies.trade import Wanted, trade
from dusttaichi.studies.trade_judge import Judge, Row, cheapest, offers, walk
from dusttaichi.studies.trade_points import base as base_of
from dusttaichi.studies.trade_report import yaml_of


class Model:
    """Runs in closed form: value 100 (1 + errors) and cost by what is changed."""

    ERRORS = {"rolling": 0.03, "speed": 0.3, "skin": 0.0}

    def __init__(self, again=1.0):
        self.asked, self.again = [], again

    def __call__(self, points):
        self.asked += [point.label for point in points]
        return {point.label: self.result(point) for point in points}

    def result(self, point):
        c = point.changes
        if point.again:
            measured = Measured({"strength": 104.0})
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
        measured = Measured({"strength": 100.0 * (1.0 + value)})
        return Row(point, 0, "finished", 10.0 * cost, cost, 100, 1e-10, 1e-4, measured)


def modelled(again=1.0, **options):
    model = Model(again)
    # wall speed 1 cm/s, so that the text of a changed one is the factor; one seed differs by 0.02
    base = base_of(scene_of(sample="{kind: rbd, grains: 100, seed: 1}"))
    names = ("step_fraction", "precision", "speed", "rolling")
    wanted = Wanted(**({"names": names, "tolerance": 0.09, "seeds": 2} | options))
    found = trade(base, model, wanted)
    return found, model


def row(label, ratio, error):
    """A Row "parameter = level" whose cost is `ratio` of the default's."""
    name, _, text = label.partition(" = ")
    point = Point(label, name, text, changes={name: (ratio, error)})
    return Row(point, 0, "", ratio, ratio, measured=Measured({"p_m": 1.0 + error}))


def test_trade_takes_the_cheapest_within_the_tolerance():
    found, model = modelled()
    judge = found.judge
    assert model.asked[0] == "default" and judge.name == "strength"
    by = {row.point.label: row for row in found.rows}
    right = 1.0 + 0.05**2
    assert judge.error(by["step_fraction = 0.3"]) == pytest.approx(
        (0.09 - 0.0025) / right, rel=1e-9
    )
    assert judge.convergence["strength"] == pytest.approx((0.0025 - 0.000625) / right, rel=1e-9)
    assert judge.scatter["strength"] == pytest.approx(0.02 / math.sqrt(2) / right, rel=1e-9)
    assert judge.converged
    # below the scatter of 0.014, not merely within the tolerance
    free = {label for label, row in by.items() if judge.free(row)}
    assert free == {"reference", "step_fraction = 0.05", "step_fraction = 0.1"}
    # 0.3 of the period errs by 0.087: accepted, and the cheapest of the numerical parameters
    assert found.numerical.point.label == "step_fraction = 0.3"
    # with the wall four times as fast it is 0.117: too much; twice as fast 0.097: too much as
    # well; and so is rolling left out. Alone, the fastest wall and no rolling err by less
    assert found.anything.point.label == "speed = 4"
    assert by["step_fraction = 0.3 + speed = 4"].ratio == pytest.approx(1 / 6)
    assert not judge.accepts(by["step_fraction = 0.3 + speed = 4"])


def test_where_the_scene_errs_too_much_the_way_begins_at_a_dearer_row():
    """It errs by 0.0375; 0.15 of the period by 0.02 at 4/3 of the cost, without rolling by 0.05."""
    found, model = modelled(tolerance=0.03, names=("step_fraction", "rolling"))
    by = {row.point.label: row for row in found.rows}
    assert not found.judge.accepts(by["default"]) and by["default"].ratio == 1.0
    assert found.anything.point.label == "step_fraction = 0.15"
    assert "step_fraction = 0.15 + rolling = off" in by
    assert not found.judge.accepts(by["step_fraction = 0.15 + rolling = off"])


def test_noise_is_that_of_a_second_run():
    """A quarter: rolling left out, at 0.8 of the cost, is not combined; the preset saves 29 %."""
    assert modelled()[0].noise == 0.02
    found, model = modelled(again=1.25)
    assert found.noise == 0.25 and "default again" in model.asked
    assert found.anything.point.label == "speed = 4"
    found, _ = modelled(again=1.25, names=("rolling",))
    assert found.anything.point.label == "fast"
    assert not any(row.point.parameter == "combined" for row in found.rows)


def test_the_cheapest_is_not_dearer_than_the_scene_as_it_is():
    judge = Judge(Measured({"p_m": 1.0}), "p_m", {"p_m": 0.001}, {"p_m": 0.0}, 0.05)
    # the default ran beside itself while the machine was busy
    rows = [row("default", 1.1, 0.01), row("skin = 0.1", 1.05, 0.01), row("skin = 0.2", 0.99, 0.0)]
    assert cheapest(rows, judge, (NUMERICAL,), 0.02) is rows[0]
    assert cheapest([*rows, row("skin = 0.3", 0.9, 0.01)], judge, (NUMERICAL,), 0.02) is not rows[0]
    # where the scene itself errs too much, what does not may be dearer
    rows[0] = row("default", 1.0, 0.3)
    assert cheapest(rows, judge, (NUMERICAL,), 0.02) is rows[2]


def test_what_is_combined_holds_together():
    found, _ = modelled(tolerance=0.12)
    assert found.anything.point.label == "step_fraction = 0.3 + speed = 4"
    assert found.anything.point.kind == PHYSICAL
    assert found.anything.ratio == pytest.approx(1 / 6)
    text = yaml_of(found, found.anything, scene_of())
    plain = "".join(
        line
        for line in edited("numerics", "").splitlines(keepends=True)
        if not line.startswith("boundary:")
    )
    pasted = from_yaml(plain + text)
    assert pasted.numerics.step_fraction == 0.3 and pasted.boundary.wall_speed == 0.04
    assert "threads" not in text


def test_refused_and_guarded_points_are_results():
    found, _ = modelled()
    bad = {row.point.label: row.status for row in found.rows if not row.ok}
    assert bad == {"precision = f64": "a guard", "precision = f32": "refused: f32"}
    guarded = next(r for r in found.rows if r.point.label == "precision = f64")
    assert not found.judge.accepts(guarded) and math.isnan(found.judge.error(guarded))


def test_scene_that_does_not_run_ends_it():
    base = base_of(scene_of())
    with pytest.raises(DustError, match="the unchanged scene does not run.*too fast"):
        trade(base, lambda points: {p.label: Row(p, 3, "too fast") for p in points}, Wanted())
    with pytest.raises(DustError, match=r"--observable sound_speed.*allowed: strength"):
        modelled(observable="sound_speed")


def test_next_level_is_tried_where_the_error_of_a_combination_is_too_large():
    """0.02 at 0.5, and 0.01 at 0.6 of the cost; errors add up, 0.04 is allowed."""
    reference = Measured({"p_m": 1.0})
    judge = Judge(reference, "p_m", {"p_m": 0.001}, {"p_m": 0.0}, 0.04)

    rows = [
        row("a = 1", 0.5, 0.02),
        row("b = 1", 0.5, 0.03),
        row("b = 2", 0.6, 0.01),
        row("b = 3", 0.99, 0.0),
        row("c = 1", 0.3, 0.05),
    ]
    ladders = offers(rows, judge, noise=0.02)
    # b = 3 saves less than the noise, c errs by too much; a saves most for its error
    assert [[r.point.label for r in found] for found in ladders] == [["a = 1"], ["b = 1", "b = 2"]]

    def run(point):
        parts = list(point.changes.values())
        of_both = row("x", math.prod(p[0] for p in parts), sum(p[1] for p in parts))
        return replace(of_both, point=point)

    tried, last = walk(None, ladders, run, judge)
    assert [r.point.label for r in tried] == ["a = 1 + b = 1", "a = 1 + b = 2"]
    assert last.ratio == pytest.approx(0.3) and last.point.label == "a = 1 + b = 2"


def test_without_seeds_nothing_is_free_but_below_the_reference_own_error():
    reference = Measured({"sound_speed": 500.0})
    judge = Judge.of(
        reference, Measured({"sound_speed": 501.0}), reference, [reference], tolerance=0.05
    )
    assert judge.floor == judge.convergence["sound_speed"] == pytest.approx(0.002)
    rows = [
        Row(Point("", ""), 0, "", measured=Measured({"sound_speed": v})) for v in (500.9, 502.0)
    ]
    assert [judge.free(row) for row in rows] == [True, False]
    stuck = Measured({"restitution": 0.0, "growth_efficiency": 0.9})
    assert Judge.of(stuck, stuck, stuck, [stuck], tolerance=0.05).name == "growth_efficiency"


def test_scatter_hides_errors_of_numerics_only():
    reference = Measured({"p_m": 1.0})
    judge = Judge(reference, "p_m", {"p_m": 0.5}, {"p_m": 0.0}, 0.05)
    wrong = Measured({"p_m": 1.3})
    rows = {kind: Row(Point("", "", kind=kind), 0, "", measured=wrong) for kind in KINDS}
    assert {kind: judge.accepts(row) for kind, row in rows.items()} == {
        "numerical": True,
        "physical": False,
        "sample": False,
    }
    assert judge.free(rows[PHYSICAL])
