"""The trade between speed and accuracy: ladders, errors, front, path, what is kept, the command."""

import json
import math
import sys

import numpy as np
import pytest
import xarray as xr
from scenes import CONFIGS, edited
from scenes import scene as scene_of

from dusttaichi import analysis
from dusttaichi.analysis.observables import CURVE, Measured, differences, scatter
from dusttaichi.commands.app import app
from dusttaichi.errors import DustError
from dusttaichi.scene import from_yaml, load
from dusttaichi.studies.trade import knobs, scenes
from dusttaichi.studies.trade.judge import Judge
from dusttaichi.studies.trade.measure import share_of
from dusttaichi.studies.trade.path import Row, cheapest, offers, walk
from dusttaichi.studies.trade.point import KINDS, NUMERICAL, PHYSICAL, Point, PointResult
from dusttaichi.studies.trade.runner import Runner
from dusttaichi.studies.trade.trade import DEFAULT, trade, yaml_of
from dusttaichi.studies.workers import Answer

TRADED = ("omni", "tensile", "collision", "sound")
PAIR = """
name: pair
material: silicate_s12
interaction: {damping: viscoelastic}
sample: {kind: pair, gap: 1 nm, speed: 0.3 m/s}
boundary: {kind: open}
stop: {time: 40 ns}
output: {series: {steps: 10}}
"""


# -- errors --------------------------------------------------------------------------------------


def line(slope, shift=0.0, low=3.0, high=5.0):
    """phi = 0.1 + slope lg P/kPa + shift, at points of its own."""
    decades = np.linspace(low, high, 37)
    return decades, 0.1 + slope * (decades - 3.0) + shift


def test_errors_of_numbers_are_relative():
    reference = Measured({"strength": -4.0, "restitution": 0.0, "lost": 0.0})
    found = differences(Measured({"strength": -5.0, "restitution": 0.2, "lost": 1e-20}), reference)
    assert found["strength"] == (-5.0, 0.25)
    assert found["restitution"] == (0.2, 0.2)  # without a unit: absolute
    assert found["lost"] == (1e-20, math.inf)
    assert math.isnan(differences(Measured({}), reference)["strength"][1])


def test_error_of_a_curve_is_the_rms_over_the_mean_where_both_are():
    # straight lines in lg P are interpolated exactly; the range in common is 10 to 30 kPa
    reference = Measured({}, line(0.1, high=4.5))
    value, error = differences(Measured({}, line(0.1, shift=0.02, low=4.0)), reference)[CURVE]
    assert value == pytest.approx(0.02, rel=1e-12)
    assert error == pytest.approx(0.02 / (0.1 + 0.1 * 1.25), rel=1e-12)
    apart = differences(Measured({}, line(0.1, low=4.6)), reference)[CURVE]
    assert np.isnan(apart).all()


def test_scatter_is_the_standard_deviation_between_seeds():
    runs = [Measured({"p_m": v}, line(0.1, shift=s)) for v, s in ((9, -0.01), (11, 0.01))]
    found = scatter(runs, Measured({"p_m": 10.0}, line(0.1)))
    assert found["p_m"] == pytest.approx(math.sqrt(2.0) / 10.0)
    assert found[CURVE] == pytest.approx(math.sqrt(2.0) * 0.01 / 0.2)  # mean phi 0.2
    assert all(math.isnan(v) for v in scatter(runs[:1], runs[0]).values())


def test_front_is_what_no_other_point_beats():
    cost = [1.0, 0.5, 0.5, 2.0, 0.4, math.nan, 3.0]
    error = [0.1, 0.3, 0.2, 0.05, 0.9, 0.0, 0.05]
    assert analysis.front(cost, error) == [4, 2, 0, 3]
    assert analysis.front([math.nan], [0.1]) == []


# -- ladders -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TRADED)
def test_every_rung_of_the_scenes_to_be_traded_is_a_scene(name):
    base = scenes.base(load(CONFIGS / f"trade/{name}.yaml"))
    points, left_out = knobs.ladder(base)
    own = {knob.name for knob in knobs.knobs_of(base)}
    assert set(left_out) | {point.knob for point in points} == own
    changed = [scenes.changed(base, point.changes) for point in points]
    assert base not in changed
    assert len({scene.to_yaml() for scene in changed}) == len(points)
    assert len({point.label for point in points}) == len(points)
    assert all(point.kind in KINDS for point in points)
    for knob in {point.knob for point in points}:
        quick = knobs.ladder(base, (knob,), quick=True)[0]
        everything = [p for p in points if p.knob == knob]
        assert len(quick) == min(3, len(everything))
        assert quick[0] == everything[0] and quick[-1] == everything[-1]


def test_what_a_scene_has_no_knob_for_is_told():
    sound = knobs.ladder(scenes.base(load(CONFIGS / "trade/sound.yaml")))[1]
    assert set(sound) == {"speed", "mass_scaling", "side_walls", "damping", "asperities", "window"}
    tensile = knobs.ladder(scenes.base(load(CONFIGS / "trade/tensile.yaml")))[1]
    assert set(tensile) == {"side_walls", "asperities"}
    assert "kind: pair" in knobs.ladder(from_yaml(PAIR))[1]["grains"]


def test_faster_stages_go_the_same_way():
    base = load(CONFIGS / "trade/tensile.yaml").with_value("stages.0.stop", {"time": "1 us"})
    fast = scenes.changed(base, scenes.faster(base, 4.0))
    compress, relax, stretch = fast.stage_plans
    assert compress.drive.compression_rate == 4.0 * base.stage_plans[0].drive.compression_rate
    assert compress.stop.time == 0.25e-6
    assert relax == base.stage_plans[1]  # nothing moves in it
    assert stretch.drive.face_speed == (4.0, 0.0, 0.0) and stretch.stop == base.stage_plans[2].stop
    plain = scene_of()
    assert scenes.faster(plain, 0.5) == {"boundary.wall_speed": "0.5 cm/s"}


def test_samples_are_made_larger_and_smaller():
    collision = load(CONFIGS / "trade/collision.yaml")
    assert scenes.resized(collision, 0.5) == {
        "sample.target.grains": 64,
        "sample.projectile.grains": 64,
    }
    sized = scene_of(sample="{kind: rbd, size: [10 um, 20 um, 30 um]}")
    larger = scenes.changed(sized, scenes.resized(sized, 8.0)).sample.size
    assert larger == pytest.approx((20e-6, 40e-6, 60e-6), rel=1e-12)
    roomy = scene_of(boundary="{kind: box, wall_speed: 1 cm/s, size: [40 um, 40 um, 40 um]}")
    assert "size of the room" in scenes.resized(roomy, 0.5)


def test_a_step_that_is_given_is_traded_as_a_fraction():
    text = PAIR.replace("stop: {time: 40 ns}", "stop: {steps: 400}")
    given = scenes.base(from_yaml(text + "numerics: {time_step: 0.1 ns}\n"))
    # the same task at every step: steps have become a time
    assert given.stop.steps is None and given.stop.time == pytest.approx(40e-9, rel=1e-3)
    assert given.numerics.threads == 1
    fraction = scenes.own_fraction(given)
    auto = {"numerics.time_step": "auto", "numerics.step_fraction": fraction}
    assert scenes.own_step(scenes.changed(given, auto)).dt == pytest.approx(1e-10, rel=1e-9)
    assert scenes.own_fraction(from_yaml(PAIR)) == 0.2
    labels = [p.label for p in knobs.ladder(given, ("step_fraction",))[0]]
    assert len(labels) == len(knobs.FRACTIONS)  # none of them is the scene's own


def test_presets_are_free_of_what_they_set():
    text = "numerics: {time_step: 0.1 ns, newton_steps: 0, skin: 0.1, mass_scaling: 4}\n"
    base = scenes.base(from_yaml(edited("numerics", text.strip())))
    fast, balanced, reference = (scenes.changed(base, p.changes) for p in knobs.presets(base))
    for scene in (fast, balanced, reference):
        assert scene.numerics.time_step == "auto"
        assert {k: getattr(scene.numerics, k) for k in scene.numerics.preset} == (
            scene.numerics.preset
        )
    assert fast.numerics.skin == 0.1 and fast.numerics.mass_scaling == 4.0
    # the reference is converged in these too
    assert reference.numerics.skin == "auto" and reference.numerics.mass_scaling == 1.0
    half = scenes.changed(base, knobs.halved(base).changes)
    assert half.numerics.step_fraction == 0.5 * reference.numerics.step_fraction


def test_seeds_of_all_bodies_move():
    base = load(CONFIGS / "trade/collision.yaml")
    points = knobs.seeds(base, 3)
    assert points[1].changes == {
        "sample.seed": 3,
        "sample.target.seed": 3,
        "sample.projectile.seed": 4,
    }
    assert knobs.seeds(load(CONFIGS / "trade/sound.yaml"), 4) == []


def test_bad_options_are_refused():
    assert share_of("5%") == share_of("0.05") == share_of(" 5 % ") == 0.05
    for text in ("0", "-5%", "five", "200%", "nan", ""):
        with pytest.raises(DustError, match="--tolerance"):
            share_of(text)
    assert knobs.chosen("speed, skin") == ("skin", "speed")
    for text in ("skn", ""):
        with pytest.raises(DustError, match=r"no such knob; allowed: step_fraction"):
            knobs.chosen(text)


# -- the whole, with a model of the runs ---------------------------------------------------------


class Model:
    """Runs in closed form: value 100 (1 + errors) and cost by what is changed."""

    ERRORS = {"rolling": 0.03, "speed": 0.3, "skin": 0.0}

    def __init__(self):
        self.asked = []

    def __call__(self, points):
        self.asked += [point.label for point in points]
        return {point.label: self.result(point) for point in points}

    def result(self, point):
        c = point.changes
        if point.again:
            return PointResult(0, "finished", 12.5, 1.25, measured=Measured({"strength": 104.0}))
        if c.get("numerics.precision") == "f32":
            return PointResult(2, "refused: f32")
        if c.get("numerics.precision") == "f64":
            return PointResult(3, "a guard", cost=1.0, ratio=0.1)
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
        return PointResult(0, "finished", 10.0 * cost, cost, 100, 1e-10, 1e-4, measured)


def modelled(**options):
    model = Model()
    # wall speed 1 cm/s, so that the text of a changed one is the factor; one seed differs by 0.02
    base = scenes.base(scene_of(sample="{kind: rbd, grains: 100, seed: 1}"))
    names = ("step_fraction", "precision", "speed", "rolling")
    found = trade(base, model, **({"names": names, "tolerance": 0.09, "seeds": 2} | options))
    return found, model


def test_trade_takes_the_cheapest_within_the_tolerance():
    found, model = modelled()
    judge = found.judge
    assert model.asked[0] == "default" and judge.name == "strength"
    by = {row.point.label: row for row in found.rows}
    right = 1.0 + 0.05**2
    assert judge.error(by["step_fraction = 0.3"].result) == pytest.approx(
        (0.09 - 0.0025) / right, rel=1e-9
    )
    assert judge.convergence["strength"] == pytest.approx((0.0025 - 0.000625) / right, rel=1e-9)
    assert judge.scatter["strength"] == pytest.approx(0.02 / math.sqrt(2) / right, rel=1e-9)
    assert judge.converged
    # below the scatter of 0.014, not merely within the tolerance
    free = {label for label, row in by.items() if judge.free(row.result)}
    assert free == {"reference", "step_fraction = 0.05", "step_fraction = 0.1"}
    # 0.3 of the period errs by 0.087: accepted, and the cheapest of the numerical knobs
    assert found.numerical.point.label == "step_fraction = 0.3"
    # with the wall four times as fast it is 0.117: too much; twice as fast 0.097: too much as
    # well; and so is rolling left out. Alone, the fastest wall and no rolling err by less
    assert found.anything.point.label == "speed = 4"
    assert by["step_fraction = 0.3 + speed = 4"].result.ratio == pytest.approx(1 / 6)
    assert not judge.accepts(by["step_fraction = 0.3 + speed = 4"])


def test_noise_without_companions_is_that_of_a_second_run():
    """A quarter: rolling left out, at 0.8 of the cost, is not combined; the preset saves 29 %."""
    assert modelled()[0].noise == 0.02
    found, model = modelled(paired=False)
    assert found.noise == 0.25 and "default again" in model.asked
    assert found.anything.point.label == "speed = 4"
    found, _ = modelled(paired=False, names=("rolling",))
    assert found.anything.point.label == "fast"
    assert not any(row.point.knob == "combined" for row in found.rows)


def test_the_cheapest_is_not_dearer_than_the_scene_as_it_is():
    def row(label, ratio, error):
        measured = Measured({"p_m": 1.0 + error})
        result = PointResult(0, "", ratio, ratio, measured=measured, ledger=0.0)
        return Row(Point(label, label.split()[0], "", 0.0, NUMERICAL), result)

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
    assert found.anything.result.ratio == pytest.approx(1 / 6)
    text = yaml_of(found, found.anything, {})
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
    bad = {row.point.label: row.result.status for row in found.rows if not row.result.ok}
    assert bad == {"precision = f64": "a guard", "precision = f32": "refused: f32"}
    guarded = next(r for r in found.rows if r.point.label == "precision = f64")
    assert not found.judge.accepts(guarded) and math.isnan(found.judge.error(guarded.result))


def test_scene_that_does_not_run_ends_it():
    base = scenes.base(scene_of())
    with pytest.raises(DustError, match="the scene as it is does not run.*too fast"):
        trade(base, lambda points: {p.label: PointResult(3, "too fast") for p in points})
    with pytest.raises(DustError, match=r"--observable sound_speed.*allowed: strength"):
        modelled(observable="sound_speed")


def test_next_rung_is_tried_where_a_combination_errs_too_much():
    """0.02 at 0.5, and 0.01 at 0.6 of the cost; errors add up, 0.04 is allowed."""
    reference = Measured({"p_m": 1.0})
    judge = Judge(reference, "p_m", {"p_m": 0.001}, {"p_m": 0.0}, 0.04)

    def row(knob, text, ratio, error):
        out = PointResult(0, "", ratio, ratio, measured=Measured({"p_m": 1.0 + error}), ledger=0.0)
        return Row(
            Point(f"{knob} = {text}", knob, text, 0.0, NUMERICAL, {knob: (ratio, error)}), out
        )

    rows = [
        row("a", "1", 0.5, 0.02),
        row("b", "1", 0.5, 0.03),
        row("b", "2", 0.6, 0.01),
        row("b", "3", 0.99, 0.0),
        row("c", "1", 0.3, 0.05),
    ]
    ladders = offers(rows, judge, noise=0.02)
    # b = 3 saves less than the noise, c errs by too much; a saves most for its error
    assert [[r.point.label for r in found] for found in ladders] == [
        ["a = 1"],
        ["b = 1", "b = 2"],
    ]

    def run(point):
        parts = list(point.changes.values())
        return row("x", "", math.prod(p[0] for p in parts), sum(p[1] for p in parts)).result

    tried, last = walk(None, ladders, run, judge)
    assert [r.point.label for r in tried] == ["a = 1 + b = 1", "a = 1 + b = 2"]
    assert last.result.ratio == pytest.approx(0.3) and last.point.label == "a = 1 + b = 2"


def test_without_seeds_nothing_is_free_but_below_the_reference_own_error():
    reference = Measured({"sound_speed": 500.0})
    judge = Judge.of(
        reference, Measured({"sound_speed": 501.0}), reference, [reference], tolerance=0.05
    )
    assert judge.floor == judge.convergence["sound_speed"] == pytest.approx(0.002)
    out = [PointResult(0, "", measured=Measured({"sound_speed": v})) for v in (500.9, 502.0)]
    assert [judge.free(o) for o in out] == [True, False]
    stuck = Measured({"restitution": 0.0, "growth_efficiency": 0.9})
    assert Judge.of(stuck, stuck, stuck, [stuck], tolerance=0.05).name == "growth_efficiency"


def test_scatter_hides_errors_of_numerics_only():
    reference = Measured({"p_m": 1.0})
    judge = Judge(reference, "p_m", {"p_m": 0.5}, {"p_m": 0.0}, 0.05)
    out = PointResult(0, "", measured=Measured({"p_m": 1.3}))
    rows = {kind: Row(Point("", "", "", 0.0, kind), out) for kind in KINDS}
    assert {kind: judge.accepts(row) for kind, row in rows.items()} == {
        "numerical": True,
        "physical": False,
        "sample": False,
    }
    assert judge.free(out)


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
        ratio = 0.2 / fraction if point.paired and self.pairs else None
        return PointResult(0, "finished: 40 ns", 2.0 / fraction, ratio, 100, 1e-10, 1e-4, value)


def test_finished_points_are_used_again(tmp_path):
    base = scenes.base(from_yaml(PAIR))
    points, _ = knobs.ladder(base, ("step_fraction",))
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
    runner = Counted(base, tmp_path, jobs=2, pairs=False)
    runner.run([DEFAULT])
    balanced = knobs.presets(base)[1]
    wrong = Point("wrong", "x", "", math.nan, NUMERICAL, {"numerics.step_fraction": 7.0})
    results = runner.run([balanced, wrong])
    assert runner.ran == ["default"]
    assert results["balanced"].ratio == 1.0  # of the two own costs
    assert results["wrong"].code == 2 and "step_fraction" in results["wrong"].status


def test_noise_of_the_machine_is_divided_out(tmp_path):
    """The base took 10 s; beside a point of 4 s half of its steps took 10 s instead of 5 s."""
    runner = Runner(scenes.base(from_yaml(PAIR)), tmp_path)
    own = PointResult(0, "", 10.0)
    assert runner._ratio(own, Answer(0, "", {"cost": 8.0})) == 1.25  # the base beside itself
    assert not runner._long  # the base itself is not stopped on its way
    runner.default = PointResult(0, "", 1e-3)
    assert not runner._long  # nor one that is over in a moment
    runner.default = PointResult(0, "", 10.0, costs=((0, 50, 100), (0.0, 5.0, 10.0)))
    assert runner._long
    cut = Answer(130, "", {"cost": 10.0, "costs": [[0, 50], [0.0, 10.0]]})
    assert runner._ratio(PointResult(0, "", 4.0), cut) == pytest.approx(0.2)
    assert runner._ratio(PointResult(0, "", 4.0), Answer(0, "", {"cost": 16.0})) == 0.25
    assert runner._ratio(own, Answer(1)) is None


# -- the command ---------------------------------------------------------------------------------


@pytest.fixture
def counted(monkeypatch, tmp_path):
    monkeypatch.setattr(sys.modules["dusttaichi.studies.trade.measure"], "Runner", Counted)
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
    assert "cheapest within 2 %, numerical knobs only: the scene as it is" in said.out
    assert "no scatter between seeds" in said.out
    with xr.open_dataset(tmp_path / "out/trade.nc") as data:
        assert data.attrs["observable"] == "restitution" and data.attrs["tolerance"] == 0.02
        labels = data.label.values.tolist()
        assert labels[:4] == ["default", "fast", "balanced", "reference"]
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
    counted("--tolerance", "10%", "--no-pairs")
    said = capsys.readouterr()
    assert "numerics: {step_fraction: 0.3, time_step: auto}" in said.out.replace(
        "{time_step: auto, step_fraction: 0.3}", "{step_fraction: 0.3, time_step: auto}"
    )
    assert "1 of " in said.err and "step_fraction = 0.3: cost 0.67" in said.err


def test_command_that_is_interrupted_says_how_to_go_on(counted, tmp_path, monkeypatch):
    monkeypatch.setattr(Counted, "stop_at", "step_fraction = 0.3")
    with pytest.raises(DustError, match=r"interrupted; the points.*Go on with: dust"):
        counted("--quiet")
    kept = {
        json.loads(p.read_text())["result"]["status"]
        for p in (tmp_path / "out/points").rglob("point.json")
    }
    assert kept == {"finished: 40 ns"}


# -- real runs -----------------------------------------------------------------------------------


def test_real_runs_side_by_side_and_alone(tmp_path):
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
    wild = Point("wild", "step_fraction", "", math.nan, NUMERICAL, changes, paired=False)
    refused = runner.run([wild])["wild"]
    assert refused.code == 2 and "not stable" in refused.status  # the build's own words
    assert [p.name for p in runner.folder(DEFAULT).glob(".beside*")] == []


def test_knobs_of_a_continuum():
    base = load(CONFIGS / "guettler2009/bead.yaml")
    points, left_out = knobs.ladder(base, quick=True)
    assert {p.knob for p in points} == {
        "spacing", "h_over_spacing", "cfl", "viscosity_grid", "viscosity_contact",
    }  # fmt: skip
    assert not left_out
    reference = scenes.changed(base, knobs.presets(base)[-1].changes)
    half = scenes.changed(base, knobs.halved(base).changes)
    assert reference.numerics.spacing == pytest.approx(0.5 * base.numerics.spacing)
    assert half.numerics.cfl == 0.5 * reference.numerics.cfl
