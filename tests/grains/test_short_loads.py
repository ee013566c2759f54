"""Stages in which load control has too few steps to reach the load."""

from scenes import CONFIGS

from dusttaichi.grains.preview import preview
from dusttaichi.grains.time_step import short_loads
from dusttaichi.scene import load


def test_a_draft_has_too_few_steps_for_a_load_of_the_same_time():
    """12 us are 39,786 steps of 0.30 ns, and 7,878 of a draft."""
    scene = load(CONFIGS / "trade/unseen/load_steps.yaml")
    draft = scene.with_value("numerics.accuracy", "draft")
    assert "Controlled loads" not in dict(preview(scene).sections)
    found = [text for _, text in dict(preview(draft).sections)["Controlled loads"]]
    assert [text.split(" controls")[0] for text in found] == ["stage hold_5", "stage hold_20"]
    assert "for 7,878 steps" in found[0] and "stop.time at least 23 µs" in found[0]


def test_only_stages_that_nothing_else_ends_have_a_remark():
    scene = load(CONFIGS / "trade/unseen/load_steps.yaml")
    settling = scene.with_value("stages.1.stop", {"creep": "200 s^-1", "time": "12 us"})
    counted = settling.with_value("stages.3.stop", {"steps": 20_000})
    assert len(short_loads(scene, 2e-9)) == 2
    assert len(short_loads(settling, 2e-9)) == 1
    assert short_loads(counted, 2e-9) == []
