"""The trade between speed and accuracy: errors, levels of parameters, settings to suggest."""

import math

import numpy as np
import pandas as pd
import pytest
from scenes import CONFIGS, edit_base
from scenes import PAIR_TEXT as PAIR
from scenes import scene as scene_of

from dusttaichi import analysis
from dusttaichi.analysis.observables import (
    CURVE,
    ObservableValues,
    compute_differences,
    measure_scatter,
)
from dusttaichi.errors import DustError
from dusttaichi.grains import grain_variants as grains
from dusttaichi.method.variants import KINDS, change_scene
from dusttaichi.scene import from_yaml, load
from dusttaichi.studies import suggest, trade_plan

TRADED = ("omni", "tensile", "collision", "sound")


# -- errors --------------------------------------------------------------------------------------


def line(slope, shift=0.0, low=3.0, high=5.0):
    """phi = 0.1 + slope lg P/kPa + shift, at points of its own."""
    decades = np.linspace(low, high, 37)
    return decades, 0.1 + slope * (decades - 3.0) + shift


def test_errors_of_numbers_and_curves_and_their_scatter():
    reference = ObservableValues({"strength": -4.0, "restitution": 0.0, "lost": 0.0})
    differences = compute_differences(
        ObservableValues({"strength": -5.0, "restitution": 0.2, "lost": 1e-20}), reference
    )
    assert differences["strength"] == (-5.0, 0.25)
    assert differences["restitution"] == (0.2, 0.2)  # without a unit: absolute
    assert differences["lost"] == (1e-20, math.inf)
    assert math.isnan(compute_differences(ObservableValues({}), reference)["strength"][1])
    # straight lines in lg P are interpolated exactly; the range in common is 10 to 30 kPa
    reference = ObservableValues({}, line(0.1, high=4.5))
    value, error = compute_differences(
        ObservableValues({}, line(0.1, shift=0.02, low=4.0)), reference
    )[CURVE]
    assert value == pytest.approx(0.02, rel=1e-12)
    assert error == pytest.approx(0.02 / (0.1 + 0.1 * 1.25), rel=1e-12)
    apart = compute_differences(ObservableValues({}, line(0.1, low=4.6)), reference)[CURVE]
    assert np.isnan(apart).all()
    runs = [ObservableValues({"p_m": v}, line(0.1, shift=s)) for v, s in ((9, -0.01), (11, 0.01))]
    differences = measure_scatter(runs, ObservableValues({"p_m": 10.0}, line(0.1)))
    assert differences["p_m"] == pytest.approx(math.sqrt(2.0) / 10.0)
    assert differences[CURVE] == pytest.approx(math.sqrt(2.0) * 0.01 / 0.2)  # mean phi 0.2
    assert all(math.isnan(v) for v in measure_scatter(runs[:1], runs[0]).values())


def test_front_is_what_no_other_point_beats():
    cost = [1.0, 0.5, 0.5, 2.0, 0.4, math.nan, 3.0]
    error = [0.1, 0.3, 0.2, 0.05, 0.9, 0.0, 0.05]
    assert analysis.find_pareto_front(cost, error) == [4, 2, 0, 3]
    assert analysis.find_pareto_front([math.nan], [0.1]) == []


# -- ladders -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TRADED)
def test_every_level_of_the_scenes_to_be_traded_is_a_scene(name):
    base = trade_plan.make_base_scene(load(CONFIGS / f"trade/{name}.yaml"))
    points, left_out = trade_plan.list_single_changes(base)
    own = {parameter.name for parameter in trade_plan.find_parameters(base).parameters}
    assert set(left_out) | {point.parameter for point in points} == own
    scenes = [change_scene(base, point.changes) for point in points]
    assert base not in scenes
    assert len({scene.to_yaml() for scene in scenes}) == len(points)
    assert len({point.label for point in points}) == len(points)
    assert all(point.kind in KINDS for point in points)
    for parameter in {point.parameter for point in points}:
        quick = trade_plan.list_single_changes(base, (parameter,), quick=True)[0]
        everything = [p for p in points if p.parameter == parameter]
        assert len(quick) == min(3, len(everything))
        assert quick[0] == everything[0] and quick[-1] == everything[-1]


def test_parameters_without_effect_have_a_reason():
    sound = trade_plan.list_single_changes(
        trade_plan.make_base_scene(load(CONFIGS / "trade/sound.yaml"))
    )[1]
    moving = {"speed", "mass_scaling", "stiffness_scaling"}
    assert set(sound) == moving | {"side_walls", "damping", "asperities", "window"}
    tensile = trade_plan.list_single_changes(
        trade_plan.make_base_scene(load(CONFIGS / "trade/tensile.yaml"))
    )[1]
    assert set(tensile) == {"side_walls", "asperities"}
    assert "kind: pair" in trade_plan.list_single_changes(from_yaml(PAIR))[1]["grains"]


def test_faster_stages_go_the_same_way():
    base = load(CONFIGS / "trade/tensile.yaml").with_value("stages.0.stop", {"time": "1 us"})
    fast = change_scene(base, grains.change_speeds(base, 4.0))
    compress, relax, stretch = fast.stage_plans
    assert compress.drive.compression_rate == 4.0 * base.stage_plans[0].drive.compression_rate
    assert compress.stop.time == 0.25e-6
    assert relax == base.stage_plans[1]  # nothing moves in it
    assert stretch.drive.face_speed == (4.0, 0.0, 0.0) and stretch.stop == base.stage_plans[2].stop
    plain = scene_of()
    assert grains.change_speeds(plain, 0.5) == {"boundary.wall_speed": "0.5 cm/s"}


def test_samples_are_made_larger_and_smaller():
    collision = load(CONFIGS / "trade/collision.yaml")
    assert grains.change_size(collision, 0.5) == {
        "sample.target.grains": 64,
        "sample.projectile.grains": 64,
    }
    sized = scene_of(sample="{kind: rbd, size: [10 um, 20 um, 30 um]}")
    larger = change_scene(sized, grains.change_size(sized, 8.0)).sample.size
    assert larger == pytest.approx((20e-6, 40e-6, 60e-6), rel=1e-12)
    roomy = scene_of(boundary="{kind: box, wall_speed: 1 cm/s, size: [40 um, 40 um, 40 um]}")
    assert "size of the domain" in grains.explain_fixed_size(roomy)


def test_a_step_that_is_given_is_traded_as_a_fraction():
    text = PAIR.replace("stop: {time: 40 ns}", "stop: {steps: 400}")
    base_scene = trade_plan.make_base_scene(from_yaml(text + "numerics: {time_step: 0.1 ns}\n"))
    # the same task at every step: steps have become a time
    assert base_scene.stop.steps is None and base_scene.stop.time == pytest.approx(40e-9, rel=1e-3)
    assert base_scene.numerics.threads == 1
    fraction = grains.compute_step_fraction(base_scene)
    auto = {"numerics.time_step": "auto", "numerics.step_fraction": fraction}
    assert grains.compute_step(change_scene(base_scene, auto)) == pytest.approx(1e-10, rel=1e-9)
    assert grains.compute_step_fraction(from_yaml(PAIR)) is None
    labels = [p.label for p in trade_plan.list_single_changes(base_scene, ("step_fraction",))[0]]
    assert len(labels) == len(grains.FRACTIONS)  # none of them is the scene's own


def test_presets_are_free_of_what_they_set():
    text = "numerics: {time_step: 0.1 ns, newton_steps: 0, skin: 0.1, mass_scaling: 4}\n"
    base = trade_plan.make_base_scene(from_yaml(edit_base("numerics", text.strip())))
    presets = [
        change_scene(base, p.changes) for p in trade_plan.find_parameters(base).presets(base)
    ]
    draft, fast, balanced, reference = presets
    for scene in (draft, fast, balanced, reference):
        assert scene.numerics.time_step == "auto"
        assert {k: getattr(scene.numerics, k) for k in scene.numerics.preset} == (
            scene.numerics.preset
        )
    assert fast.numerics.skin == 0.1 and fast.numerics.mass_scaling == 4.0
    # the reference is converged in these too
    assert reference.numerics.skin == "auto" and reference.numerics.mass_scaling == 1.0
    half = change_scene(base, trade_plan.find_parameters(base).check(base).changes)
    assert half.numerics.step_fraction == 0.5 * reference.numerics.step_fraction


def test_seeds_of_all_bodies_move():
    base = load(CONFIGS / "trade/collision.yaml")
    points = trade_plan.list_seeds(base, 3)
    assert points[1].changes == {
        "sample.seed": 3,
        "sample.target.seed": 3,
        "sample.projectile.seed": 4,
    }
    assert trade_plan.list_seeds(load(CONFIGS / "trade/sound.yaml"), 4) == []


def test_bad_options_are_refused():
    assert {trade_plan.parse_tolerance(text) for text in ("5%", "0.05", " 5 % ")} == {0.05}
    for text in ("0", "-5%", "five", "200%", "nan", ""):
        with pytest.raises(DustError, match="--tolerance"):
            trade_plan.parse_tolerance(text)
    assert trade_plan.parse_names("speed, skin") == ("skin", "speed")
    for text in ("skn", ""):
        with pytest.raises(DustError, match=r"unknown parameter; allowed: step_fraction"):
            trade_plan.parse_names(text)


def test_parameters_of_a_continuum():
    base = load(CONFIGS / "guettler2009/bead.yaml")
    points, left_out = trade_plan.list_single_changes(base, quick=True)
    assert {p.parameter for p in points} == {
        "spacing", "h_over_spacing", "cfl", "viscosity_grid", "viscosity_contact",
    }  # fmt: skip
    assert not left_out
    assert trade_plan.list_single_changes(base, ("cfl", "skin"))[1] == {
        "skin": "no parameter of method: continuum"
    }
    with pytest.raises(
        DustError, match="precision: no parameter of method: continuum; allowed: spacing"
    ):
        trade_plan.list_single_changes(base, ("precision",))
    # a lattice has no seed that would change anything
    assert not trade_plan.list_seeds(base, 2)
    glass = base.with_value("sample.target.lattice", "glass")
    assert trade_plan.list_seeds(glass, 2)[0].changes == {"sample.target.seed": 2}
    reference = change_scene(base, trade_plan.find_parameters(base).presets(base)[-1].changes)
    check = change_scene(base, trade_plan.find_parameters(base).check(base).changes)
    assert reference.numerics.spacing == pytest.approx(0.25 * base.numerics.spacing)
    assert reference.numerics.cfl == check.numerics.cfl == 0.25
    assert check.numerics.spacing == pytest.approx(2.0 * reference.numerics.spacing)
    # in space the reference is half as fine, and no level is as fine as it
    space = load(CONFIGS / "guettler2009/bounce.yaml")
    reference = change_scene(space, trade_plan.find_parameters(space).presets(space)[-1].changes)
    assert reference.numerics.spacing == pytest.approx(0.5 * space.numerics.spacing)
    assert "spacing = 0.5" not in {p.label for p in trade_plan.list_single_changes(space)[0]}


BOX = "compression in a box"


def row(settings, cost, error, *, scatter=0.03, grains=400, observable="phi(P)"):
    numbers = cost, error, 0.01, scatter, 4
    return BOX, "trade_omni", grains, settings, observable, *numbers


@pytest.fixture
def table(monkeypatch):
    rows = [
        row("as it is", 1.0, 0.0),
        row("cheap", 0.1, 0.2),  # errs by more than both
        row("soft", 0.2, 0.04),
        row("worse", 0.3, 0.045),  # beaten
        row("fast", 0.5, 0.01),
    ]
    columns = suggest.COLUMNS
    monkeypatch.setattr(suggest, "read_measurements", lambda: pd.DataFrame(rows, columns=columns))
    return rows


def suggest_settings(name="omni", **options):
    return suggest.list_suggestions(load(CONFIGS / f"trade/{name}.yaml"), **options)


def test_the_cheapest_come_first(table):
    suggestion = suggest_settings()
    assert [settings for settings, _ in suggestion] == ["soft", "fast"]
    assert suggestion[0][1] == "cost 0.20, error 4 % ± 1 % (phi(P); scatter of seeds 3 %)"
    assert suggest_settings(tolerance=0.5)[0][0] == "cheap"
    table.append(row("soft", 0.2, 0.3, observable="ratio"))
    assert [settings for settings, _ in suggest_settings()] == ["worse", "fast"]


def test_a_draft_has_the_errors_that_were_measured(table):
    omni = load(CONFIGS / "trade/omni.yaml")
    draft = omni.with_value("numerics", {"accuracy": "draft"})
    assert suggest.list_draft_errors(omni) == []
    assert suggest.list_draft_errors(draft) == [("error", "not measured for this kind of scene")]
    table.append(row("accuracy draft", 0.2, 0.02))
    text = "2 % ± 1 % (phi(P); within the scatter of seeds, 3 %)"
    location = "error in trade_omni (compression in a box, 400 grains)"
    assert suggest.list_draft_errors(draft) == [(location, text)]


def test_kinds_of_scenes_also_without_measurements(table):
    kinds = {
        "omni": BOX, "uni": "compression between plates", "tensile": "tension", "shear": "shear",
        "isotropic": "compression from all sides", "collision": "collision", "sound": None,
        "bead": None,
    }  # fmt: skip
    for name, kind in kinds.items():
        assert suggest.classify_scene(load(CONFIGS / f"trade/{name}.yaml")) == kind, name
    with pytest.raises(DustError, match="no measurements for this kind of scene"):
        suggest_settings("sound")
    text = edit_base("boundary", "boundary: {kind: box, pressure: 1 kPa}")
    assert suggest.classify_scene(from_yaml(text)) == BOX
