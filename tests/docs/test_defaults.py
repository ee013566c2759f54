"""The table of defaults: its scenes are valid, and each of their settings has a row."""

import csv

import pytest
import yaml
from scenes import ROOT, extensions_forgotten

from dusttaichi.scene import Scene

CASES = yaml.safe_load((ROOT / "docs/defaults.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", CASES)
def test_scenes_of_the_table_are_valid(name):
    with extensions_forgotten():
        Scene.from_dict({"name": name} | CASES[name]["scene"], ROOT / "docs")


def test_each_setting_has_a_row():
    with open(ROOT / "docs/validation/defaults.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = [name for name, case in CASES.items() for _ in case["careful"]]
    assert [row["scene"] for row in rows] == names
    known = {"agrees", "within the scatter", "differs", "no number"}
    assert {row["verdict"] for row in rows} <= known
