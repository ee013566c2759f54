"""Drafts say that they are drafts: names, figures, and runs side by side."""

from types import SimpleNamespace

from matplotlib.figure import Figure
from scenes import edited

from dusttaichi.analysis.kind import draft_of, mixture, named
from dusttaichi.plots.registry import marked
from dusttaichi.scene import from_yaml
from dusttaichi.scene.numerics import PRESETS


def run(name, **numerics):
    return SimpleNamespace(name=name, scene={"numerics": numerics})


DRAFT = {"accuracy": "draft", "stiffness_scaling": 0.1}


def test_names_say_it():
    assert named("omni", {"numerics": DRAFT}) == "omni (draft)"
    assert named("omni", {"numerics": {"stiffness_scaling": 0.3}}) == "omni (softened, 0.3)"
    for scene in ({}, {"numerics": {"accuracy": "fast", "stiffness_scaling": 1.0}}):
        assert named("omni", scene) == "omni" and draft_of(scene) == ""


def test_drafts_beside_others_are_told():
    text = mixture([run("one", **DRAFT), run("two", accuracy="balanced")])
    assert "drafts beside others: one." in text
    assert mixture([run("one", **DRAFT), run("two", **DRAFT)]) == ""
    assert mixture([run("one"), run("two")]) == ""


def test_figures_say_it():
    drawn = marked(Figure(), run("one", **DRAFT))
    assert [text.get_text() for text in drawn.texts] == ["draft"]
    assert marked(None, run("one", **DRAFT)) is None
    assert not marked(Figure(), run("one")).texts


def test_a_draft_has_the_numbers_of_its_preset():
    numerics = from_yaml(edited("numerics", "numerics: {accuracy: draft}")).numerics
    assert {key: getattr(numerics, key) for key in PRESETS["draft"]} == PRESETS["draft"]
    own = from_yaml(edited("numerics", "numerics: {accuracy: draft, mass_scaling: 1}")).numerics
    assert own.mass_scaling == 1.0 and own.stiffness_scaling == 0.1
