"""The registry of numbers: one file adds a number with its figure, and it is shown everywhere."""

import json
from types import SimpleNamespace

import pytest
import synthetic
from matplotlib.figure import Figure
from program import dust
from scenes import EXAMPLES, edit_base, extensions_forgotten

from dusttaichi import analysis, plots, report
from dusttaichi.analysis import ensemble_tables as tables
from dusttaichi.analysis import numbers
from dusttaichi.analysis.kind import add_draft_reason, explain_draft, warn_of_mixed_drafts
from dusttaichi.analysis.numbers import Family, Observable
from dusttaichi.analysis.plain import convert_ensemble, convert_runs
from dusttaichi.analysis.summary import format_columns
from dusttaichi.commands import options
from dusttaichi.plots.figure_registry import mark_draft
from dusttaichi.report import page
from dusttaichi.results import shown
from dusttaichi.scene import from_yaml
from dusttaichi.scene.numerics import PRESETS

OWN = EXAMPLES / "loss_per_grain.py"


@pytest.fixture
def extension():
    """This process forgets the rows of the file again."""
    with extensions_forgotten():
        yield


def write_run(path, seed=0):
    path.parent.mkdir(parents=True, exist_ok=True)
    return synthetic.compression_run(path, seed=seed)


def test_one_file_adds_a_number_with_its_figure(extension, tmp_path, monkeypatch):
    monkeypatch.setattr(page, "collect_particles", lambda run: None)
    options.import_files([OWN])
    runs = [
        analysis.open_run(write_run(tmp_path / name / "result.nc", n))
        for n, name in enumerate("ab")
    ]
    lost = sum(float(loss[-1]) for loss in analysis.compute_ledger(runs[0]).losses.values()) / 1000
    value = f"{lost * 1e15:.4g} fJ"
    assert analysis.summarise(runs[0])["loss_per_grain"] == pytest.approx(lost)
    assert ("energy lost per grain", value, "") in analysis.tabulate(analysis.summarise(runs[0]))
    assert dict(format_columns(analysis.compare(runs)))["loss per grain"][0] == value
    (run_data,) = report.collect_report_data(runs[:1])["runs"]
    assert ["energy lost per grain", value, ""] in run_data["table"]
    assert {f["name"]: f["title"] for f in run_data["figures"]}[
        "loss_per_grain"
    ] == "Energy lost per grain"
    assert "loss_per_grain" in plots.draw_figures(runs[0])
    entry = convert_runs(runs)["runs"][1]["numbers"]["loss_per_grain"]
    assert entry["unit"] == "J" and entry["value"] == pytest.approx(lost)
    data = analysis.gather(runs, attrs={"title": "made"})
    assert data.loss_per_grain.attrs["units"] == "J"
    assert data.loss_per_grain.attrs["long_name"] == "energy lost per grain"
    assert "loss per grain" in [column.name for column in tables.columns(data)]
    assert convert_ensemble(data)["points"][0]["numbers"]["loss_per_grain"]["runs"] == 2


def test_the_file_is_named_to_the_commands(extension, tmp_path, capsys):
    paths = [write_run(tmp_path / name / "result.nc", n) for n, name in enumerate("ab")]
    dust("compare", *paths, "--json", "--extension", OWN)
    data = json.loads(capsys.readouterr().out)
    assert data["schema"] == 1 and [run["name"] for run in data["runs"]] == ["test", "test"]
    numbers = data["runs"][0]["numbers"]
    assert numbers["loss_per_grain"]["unit"] == "J"
    assert numbers["p_m"]["error"] > 0.0 and "p_m_sigma" not in numbers
    assert numbers["ledger_worst"]["value"] < 1.0 and "strength" not in numbers


def test_an_error_is_named_and_the_rest_is_measured(tmp_path, monkeypatch):
    def wrong(run):
        raise IndexError("index 3 is out of bounds")

    rows = (
        Observable(name="broken", title="a broken row", value=wrong),
        Observable(name="whole", title="a whole row", value=lambda run: 3),
    )
    monkeypatch.setitem(
        shown.NUMBERS.added, "mine", Family(name="mine", title="mine", order=1, numbers=rows)
    )
    lost = Family(name="lost", title="a lost family", order=2, numbers=(), measure=wrong)
    monkeypatch.setitem(shown.NUMBERS.added, "lost", lost)
    run = analysis.open_run(write_run(tmp_path / "result.nc"))
    found = analysis.tabulate(analysis.summarise(run))
    assert ("a whole row", "3", "") in found
    assert [row[1] for row in found if row[0] == "not computed"] == [
        "a broken row: IndexError: index 3 is out of bounds",
        "a lost family: IndexError: index 3 is out of bounds",
    ]
    assert len(convert_runs([run])["runs"][0]["problems"]) == 2
    assert len(analysis.compare([run])[0]["problems"]) == 2
    ((title, _, count, reason),) = tables.list_missing_numbers(
        analysis.gather([run], attrs={"title": "made"})
    )
    assert (title, count) == ("number", "1 of 1 runs") and "a lost family: IndexError" in reason


def test_why_there_is_none(tmp_path):
    """A curve too short for a fit says so in place of the number."""
    run = analysis.open_run(write_run(tmp_path / "result.nc"))
    short = run.beyond(0.95 * float(run.series.filling_factor.max()))
    numbers = convert_runs([short])["runs"][0]["numbers"]
    assert numbers["p_m"]["value"] is None and numbers["p_m"]["why"]
    data = analysis.gather([short], attrs={"title": "made"})
    assert tables.list_missing_numbers(data) == [("fit", "", "1 of 1 runs", numbers["p_m"]["why"])]


def test_names_are_unique_and_what_rows_refer_to_is_there():
    names = [number.name for family in numbers.families() for number in family.numbers]
    assert len(names) == len(set(names))
    with pytest.raises(ValueError, match="there is a number p_m"):
        numbers.register(
            Family(name="x", title="x", order=1, numbers=(Observable(name="p_m", title="x"),))
        )
    observables, figures = numbers.index_observables(), {row.name for row in plots.list_figures()}
    for number in observables.values():
        assert {number.error, number.reason_row} - {""} <= observables.keys(), number.name
        assert not number.figure or number.figure in figures, number.name
        assert number.sweeps in ("tables", "ensembles", "file")


def run(name, **numerics):
    return SimpleNamespace(name=name, scene={"numerics": numerics})


DRAFT = {"accuracy": "draft", "stiffness_scaling": 0.1}


def test_names_figures_and_runs_side_by_side_say_that_they_are_drafts():
    assert add_draft_reason("omni", {"numerics": DRAFT}) == "omni (draft)"
    assert (
        add_draft_reason("omni", {"numerics": {"stiffness_scaling": 0.3}}) == "omni (softened, 0.3)"
    )
    for scene in ({}, {"numerics": {"accuracy": "fast", "stiffness_scaling": 1.0}}):
        assert add_draft_reason("omni", scene) == "omni" and explain_draft(scene) == ""
    text = warn_of_mixed_drafts([run("one", **DRAFT), run("two", accuracy="balanced")])
    assert "drafts beside others: one." in text
    assert warn_of_mixed_drafts([run("one", **DRAFT), run("two", **DRAFT)]) == ""
    assert warn_of_mixed_drafts([run("one"), run("two")]) == ""
    drawn = mark_draft(Figure(), run("one", **DRAFT))
    assert [text.get_text() for text in drawn.texts] == ["draft"]
    assert mark_draft(None, run("one", **DRAFT)) is None
    assert not mark_draft(Figure(), run("one")).texts


def test_a_draft_has_the_numbers_of_its_preset():
    numerics = from_yaml(edit_base("numerics", "numerics: {accuracy: draft}")).numerics
    assert {key: getattr(numerics, key) for key in PRESETS["draft"]} == PRESETS["draft"]
    own = from_yaml(edit_base("numerics", "numerics: {accuracy: draft, mass_scaling: 1}")).numerics
    assert own.mass_scaling == 1.0 and own.stiffness_scaling == 0.1


def test_columns_of_a_sweep_say_of_what_a_distance_is():
    names = ("rms", "rms_mean", "largest", "inner_mean")
    assert all("distance in phi" in tables.title_of(name) for name in names)
