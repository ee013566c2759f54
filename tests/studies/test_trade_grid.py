"""`dust trade --grid`: which settings it runs, and that it goes on where it was."""

import csv
from types import SimpleNamespace

import pytest
from scenes import CONFIGS

from dusttaichi import analysis
from dusttaichi.errors import DustError
from dusttaichi.scene import load
from dusttaichi.scene.numerics import PRESETS
from dusttaichi.studies.trade import grid, scenes


def omni():
    return load(CONFIGS / "trade/omni.yaml")


def test_all_combinations_and_the_scene_as_it_is():
    text = "stiffness_scaling 1 0.1; mass_scaling 1 4 | speed 2"
    found = grid.settings_of(scenes.base(omni()), text)
    assert [setting.text for setting in found] == [
        "as it is",
        "mass_scaling 4",
        "stiffness_scaling 0.1",
        "stiffness_scaling 0.1, mass_scaling 4",
        "speed 2",
    ]
    between = grid.settings_of(scenes.base(omni()), "stiffness_scaling 0.2")[1]
    assert between.changes["numerics.stiffness_scaling"] == 0.2
    both = scenes.changed(scenes.base(omni()), found[3].changes).numerics
    assert (both.stiffness_scaling, both.mass_scaling) == (0.1, 4.0)


def test_a_preset_is_a_level():
    found = grid.settings_of(scenes.base(omni()), "accuracy draft fast")
    assert [setting.text for setting in found] == ["as it is", "accuracy draft", "accuracy fast"]
    numerics = scenes.changed(scenes.base(omni()), found[1].changes).numerics
    assert (numerics.accuracy, numerics.mass_scaling) == ("draft", 4.0)


@pytest.mark.parametrize(
    "text, why",
    [
        ("colour 1 2", "needs a parameter and its levels"),
        ("stiffness_scaling", "needs a parameter and its levels"),
        ("precision f16", "precision f16: allowed: 1, f64, mixed, f32"),
        ("accuracy rough", "accuracy rough: allowed: 1, draft, fast, balanced, reference"),
    ],
)
def test_unknown_levels_are_refused(text, why):
    with pytest.raises(DustError, match=why):
        grid.settings_of(scenes.base(omni()), text)


def test_it_goes_on_with_what_is_left(monkeypatch, tmp_path):
    ran = []

    def row(base, folder, setting, seed):
        ran.append((setting.text, seed))
        if len(ran) == 4:
            raise KeyboardInterrupt
        return {"scene": base.name, "settings": setting.text, "seed": seed} | {
            "steps": 1,
            "seconds": "1.0",
            "status": "finished",
        }

    monkeypatch.setattr(grid, "_row", row)
    with pytest.raises(KeyboardInterrupt):
        grid.grid(omni(), tmp_path, "mass_scaling 4", 3)
    path = grid.grid(omni(), tmp_path, "mass_scaling 4", 3)
    assert ran == [(s, n) for n in range(3) for s in ("as it is", "mass_scaling 4")][:4] + [
        ("mass_scaling 4", 1),
        ("as it is", 2),
        ("mass_scaling 4", 2),
    ]
    with open(path, newline="") as file:
        assert len(list(csv.DictReader(file))) == 6


def test_scenes_share_a_table(monkeypatch, tmp_path):
    """With force, a scene runs again and rows of others stay."""
    ran = []

    def row(base, folder, setting, seed):
        ran.append(base.name)
        return {"scene": base.name, "settings": setting.text, "seed": seed} | {
            "steps": len(ran),
            "seconds": "1.0",
            "status": "finished",
        }

    monkeypatch.setattr(grid, "_row", row)
    other = load(CONFIGS / "trade/uni.yaml")
    for scene, force in ((omni(), False), (other, False), (omni(), False), (other, True)):
        path = grid.grid(scene, tmp_path, "", 1, force=force)
    assert ran == ["trade_omni", "trade_uni", "trade_uni"]
    with open(path, newline="") as file:
        assert [(r["scene"], r["steps"]) for r in csv.DictReader(file)] == [
            ("trade_omni", "1"),
            ("trade_uni", "3"),
        ]


@pytest.fixture
def ran(monkeypatch):
    """Settings that `grid` runs, with an empty run in place of each."""
    found = []

    def row(base, folder, setting, seed):
        found.append(setting.text)
        row = {"scene": base.name, "settings": setting.text, "seed": seed, "steps": 1}
        return row | {"seconds": "1.0", "status": "finished"}

    monkeypatch.setattr(grid, "_row", row)
    return found


def test_an_edited_scene_does_not_continue_a_table(ran, tmp_path):
    grid.grid(omni(), tmp_path, "accuracy draft", 1)
    edited = omni().with_value("boundary.wall_speed", "10 cm/s")
    with pytest.raises(DustError, match=r"differs in boundary\.wall_speed\. .* --force"):
        grid.grid(edited, tmp_path, "accuracy draft", 2)
    assert ran == ["as it is", "accuracy draft"]
    grid.grid(edited, tmp_path, "accuracy draft", 1, force=True)
    assert ran == ["as it is", "accuracy draft"] * 2
    # neither threads nor the folder of the results change a number
    same = edited.with_value("numerics.threads", 2).with_value("output.directory", "elsewhere")
    grid.grid(same, tmp_path, "accuracy draft", 1)
    grid.grid(edited.with_value("name", "slower"), tmp_path, "accuracy draft", 1)
    assert ran == ["as it is", "accuracy draft"] * 3


def test_a_changed_preset_does_not_continue_a_table(ran, monkeypatch, tmp_path):
    grid.grid(omni(), tmp_path, "accuracy draft", 1)
    monkeypatch.setitem(PRESETS, "draft", PRESETS["draft"] | {"mass_scaling": 6.0})
    with pytest.raises(DustError, match=r"\(accuracy draft\) .* differs in numerics\.mass_scaling"):
        grid.grid(omni(), tmp_path, "accuracy draft", 2)
    grid.grid(omni(), tmp_path, "mass_scaling 4", 2)


def test_rows_of_an_unknown_scene_are_refused(ran, tmp_path):
    grid.grid(omni(), tmp_path, "", 1)
    (tmp_path / grid.SCENES).unlink()
    with pytest.raises(DustError, match="unknown scene"):
        grid.grid(omni(), tmp_path, "", 2)


def test_a_load_that_was_missed_gives_no_number(monkeypatch):
    def load(stage, pressure):
        numbers = {"overshoot": 0.0, "filling_factor": 0.3, "creep": 0.0, "time": 1e-5}
        return analysis.ControlledLoad(stage=stage, wanted=5e3, pressure=pressure, **numbers)

    run = SimpleNamespace(series={}, unloads=False)
    monkeypatch.setattr(analysis, "is_triaxial", lambda run: False)
    loads = [load("first", 1.8e3), load("second", 4.9e3)]
    assert grid._of_stages(run, loads) == {"filling factor under load second": 0.3}
