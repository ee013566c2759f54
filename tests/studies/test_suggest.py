"""Settings that are suggested for a scene, of a table by hand."""

import pandas as pd
import pytest
from scenes import CONFIGS, edited

from dusttaichi.errors import DustError
from dusttaichi.scene import from_yaml, load
from dusttaichi.studies import suggest

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
    monkeypatch.setattr(suggest, "measured", lambda: pd.DataFrame(rows, columns=columns))
    return rows


def suggested(name="omni", **how):
    return suggest.suggestions(load(CONFIGS / f"trade/{name}.yaml"), **how)


def test_the_cheapest_come_first(table):
    found = suggested()
    assert [settings for settings, _ in found] == ["soft", "fast"]
    assert found[0][1] == "cost 0.20, error 4 % ± 1 % (phi(P); scatter of seeds 3 %)"
    assert suggested(tolerance=0.5)[0][0] == "cheap"


def test_the_worst_of_what_was_measured_counts(table):
    table.append(row("soft", 0.2, 0.3, observable="ratio"))
    assert [settings for settings, _ in suggested()] == ["worse", "fast"]


def test_a_draft_has_the_errors_that_were_measured(table):
    omni = load(CONFIGS / "trade/omni.yaml")
    draft = omni.with_value("numerics", {"accuracy": "draft"})
    assert suggest.draft_rows(omni) == []
    assert suggest.draft_rows(draft) == [("error", "not measured for this kind of scene")]
    table.append(row("accuracy draft", 0.2, 0.02))
    text = "2 % ± 1 % (phi(P); within the scatter of seeds, 3 %)"
    where = "error in trade_omni (compression in a box, 400 grains)"
    assert suggest.draft_rows(draft) == [(where, text)]


def test_kinds_of_scenes(table):
    kinds = {
        "omni": BOX, "uni": "compression between plates", "tensile": "tension", "shear": "shear",
        "isotropic": "compression from all sides", "collision": "collision", "sound": None,
        "bead": None,
    }  # fmt: skip
    for name, kind in kinds.items():
        assert suggest.kind_of(load(CONFIGS / f"trade/{name}.yaml")) == kind, name
    with pytest.raises(DustError, match="no measurements for this kind of scene"):
        suggested("sound")


def test_a_scene_without_measurements_still_has_a_kind():
    text = edited("boundary", "boundary: {kind: box, pressure: 1 kPa}")
    assert suggest.kind_of(from_yaml(text)) == BOX
