"""`dust trade --grid`: which settings it runs, and that it goes on where it was."""

import csv

import pytest
from scenes import CONFIGS

from dusttaichi.errors import DustError
from dusttaichi.scene import load
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


@pytest.mark.parametrize(
    "text, why",
    [
        ("colour 1 2", "needs a parameter and its levels"),
        ("stiffness_scaling", "needs a parameter and its levels"),
        ("precision f16", "precision f16: allowed: 1, f64, mixed, f32"),
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
