"""The parts of the pages that are made from the program have everything in them."""

import csv
import math
import runpy

import pandas as pd
import pytest
import typer
import yaml
from scenes import ROOT, extensions_forgotten
from sources import import_from_docs

from dusttaichi.analysis import outcome
from dusttaichi.analysis.collisions import FAILED, MISS
from dusttaichi.analysis.thresholds import FRAGMENT, STICK
from dusttaichi.commands.app import app
from dusttaichi.grains.grain_variables import VARIABLES
from dusttaichi.scene import NAMED, Scene, shipped
from dusttaichi.scene.keys import list_keys

DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def generate():
    return import_from_docs("generate")


def list_included():
    """Names of the generated parts that the pages include."""
    texts = [p.read_text(encoding="utf-8") for p in DOCS.glob("*.md")]
    return {line.split()[-1] for text in texts for line in text.split("\n") if "include}" in line}


def test_every_key_variable_and_material_is_in_a_table_of_a_page(generate):
    tables = "\n".join(generate.keys(block) for block in generate.blocks())
    for key in list_keys():
        assert f"| `{key.path}` |" in tables, key.path
        assert key.default in tables, key.path
    assert {f"generated/keys_{block}.md" for block in generate.blocks()} <= list_included()
    for variable in VARIABLES.values():
        row = f"| `{variable.name}` |"
        assert row in generate.variables(variable.group, VARIABLES.values()), variable.key
    assert set(generate.GROUPS) == {variable.group for variable in VARIABLES.values()}
    assert {f"generated/variables_{group}.md" for group in generate.GROUPS} <= list_included()
    # the features that they need have words
    features = set().union(*(variable.needs for variable in VARIABLES.values()))
    assert features <= set(generate.FEATURES) | {"profiles", "snapshots", "contacts"}
    assert all(f"`{name}`" in generate.materials() for name in NAMED)


def test_outcomes_are_defined_on_one_page():
    """Each outcome with its limits in mass, and each threshold."""
    page = (DOCS.parent / outcome.PAGE).read_text(encoding="utf-8")
    for name in (*outcome.DEFINITIONS, MISS, FAILED):
        assert f"| `{name}` |" in page
    for limit in (outcome.WHOLE, outcome.HALF):
        assert f"{limit:.0%}".replace("%", " %") in page
    assert all(
        rf"$v_\mathrm{{{one.name}}}$ | {one.meaning.split(' (')[0]}" in page
        for one in (STICK, FRAGMENT)
    )
    paths = [*DOCS.rglob("*.md"), *(DOCS / "validation/pages").glob("*.csv")]
    linked = "\n".join(path.read_text(encoding="utf-8") for path in paths)
    assert linked.count("outcomes.md") > 6


def test_numbers_of_bundled_extensions_are_in_a_table_of_their_own(generate):
    with extensions_forgotten():
        text, bundled_numbers = (
            generate.numbers(*generate.list_bundled()),
            generate.numbers(generate.built_in()),
        )
        assert "| `spin_rate` |" in text and "`reissl2024/spin_up.py`" in text
        assert (
            "spin_rate" not in bundled_numbers
            and "| `strength` |" in bundled_numbers
            and "`strength`" not in text
        )


def test_every_bundled_scene_is_in_a_table_with_its_summary(generate):
    text = generate.scenes()
    for path in sorted((ROOT / "configs").rglob("*.yaml")):
        assert f"| `{path.relative_to(ROOT).as_posix()}` |" in text
    assert "|  |" not in text
    assert "generated/scenes.md" in list_included()


def test_every_bundled_extension_is_named_on_the_page():
    page = (DOCS / "extending.md").read_text(encoding="utf-8")
    for path in shipped.find_extensions("*.py"):
        assert f"`configs/{path.relative_to(shipped.get_folder()).as_posix()}`" in page, path


def test_every_command_and_option_is_listed(generate):
    text = generate.interface.commands()
    for name, command in typer.main.get_command(app).commands.items():
        assert f"### dust {name}" in text
        for option in command.params:
            words = [] if getattr(option, "hidden", False) else option.opts
            assert all(word in text for word in words if word.startswith("-")), option.name


def test_every_row_of_a_table_of_numbers_has_the_columns_of_its_head(generate):
    for path in (DOCS / "validation").glob("*.csv"):
        lines = [line for line in generate.csv_table(path).split("\n") if line.startswith("|")]
        assert len({line.replace("\\|", "").count("|") for line in lines}) == 1, path.name


def test_every_table_of_a_page_is_on_one_and_names_its_command(generate):
    texts = {path: path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md")}
    written = "\n".join(text for path, text in texts.items() if "generated" not in path.parts)
    for path in (DOCS / "validation/pages").glob("*.csv"):
        text = path.read_text(encoding="utf-8")
        assert text.startswith("# ") and generate.page_table(path).count("| --- |") >= 1, path.name
        assert f"generated/{path.stem}.md" in written, path.name


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
    verdicts_allowed = {"agrees", "within the scatter", "differs", "no number"}
    assert {row["verdict"] for row in rows} <= verdicts_allowed


NAMES = runpy.run_path(str(ROOT / "docs/outcomes.py"))
CURVE = NAMES["CURVE"]


def outcomes(table):
    return list(NAMES["outcomes"](table).itertuples())


def row(settings, seed, steps, **values):
    common = {"scene": "omni", "grains": 400, "status": "finished: pressure 100 kPa"}
    return common | {"settings": settings, "seed": seed, "steps": steps} | values


def phi(*values):
    return dict(zip(("phi at 1 kPa", "phi at 3 kPa"), values, strict=True))


TABLE = [
    row("as it is", 0, 100, **phi(0.2, 0.3), ratio=1.0),
    row("as it is", 1, 300, **phi(0.2, 0.5), ratio=2.0),
    row("softer", 0, 20, **phi(0.2, 0.4), ratio=1.0),
    row("softer", 1, 60, **phi(0.4, 0.4), ratio=2.5),
    row("faster", 0, 20, **phi(0.3, 0.4), ratio=1.5),
]


def test_errors_are_those_of_means():
    """By hand: means of `as it is` 0.2 and 0.4, of `softer` 0.3 and 0.4."""
    outcome_table = {(o.settings, o.observable): o for o in outcomes(pd.DataFrame(TABLE))}
    curve = outcome_table["softer", CURVE]
    assert curve.cost == pytest.approx(0.2) and curve.seeds == 2
    assert curve.error == pytest.approx((0.1**2 / 2) ** 0.5 / 0.3)
    # of the seeds of `as it is`: 0 and 0.2/sqrt(2)
    assert curve.scatter == pytest.approx((0.2**2 / 2 / 2) ** 0.5 / 0.3)
    assert curve.hidden
    ratio = outcome_table["softer", "ratio"]
    assert (ratio.error, ratio.value) == (pytest.approx(0.25 / 1.5), pytest.approx(1.75))
    # differences of the same seeds: of the curve 0 and 0.2, 0.1 and -0.1; of the ratio 0 and 0.5
    assert curve.shift == pytest.approx(0.05 / 0.3) and ratio.shift == pytest.approx(0.25 / 1.5)
    assert curve.uncertainty == pytest.approx(0.1 / 0.3)
    assert ratio.uncertainty == pytest.approx(0.25 / 1.5) and not ratio.resolved
    assert outcome_table["as it is", CURVE].error == 0.0


def test_a_pressure_that_one_seed_of_many_misses_counts():
    """At 3 kPa the pairs 0 and 1 differ by 0.1; at half of the pairs a pressure is left out."""
    nan = math.nan
    table = [row("as it is", n, 100, **phi(0.2, 0.4 if n < 2 else nan)) for n in range(3)]
    table += [row("softer", n, 20, **phi(0.2, 0.3)) for n in range(3)]
    found = outcomes(pd.DataFrame(table))[-1]
    assert found.seeds == 3 and found.uncertainty == pytest.approx(0.0, abs=1e-9)
    assert found.value == pytest.approx(0.25) and found.shift == pytest.approx(-0.05 / 0.3)
    table[4] |= phi(0.2, nan)
    assert outcomes(pd.DataFrame(table))[-1].error == 0.0


def test_seeds_that_did_not_end_are_left_out():
    """Steps and values are compared with those of the same seeds."""
    found = outcomes(pd.DataFrame(TABLE))
    faster = {o.observable: o for o in found if o.settings == "faster"}["ratio"]
    assert faster.cost == pytest.approx(0.2) and faster.seeds == 1
    assert faster.error == pytest.approx(0.5)  # 1.5 against 1.0 of seed 0
    assert math.isnan(faster.uncertainty) and not faster.resolved  # a single difference
    assert faster.scatter == pytest.approx(2**-0.5 / 1.0)
    refused = [r | {"status": "too soft"} for r in TABLE if r["settings"] == "softer"]
    found = outcomes(pd.DataFrame([*TABLE[:2], *refused]))
    assert found[-1].refused == "too soft" and found[-1].seeds == 0


def test_seeds_that_differ_alike_are_a_resolved_shift():
    """The differences 0.11 and 0.09 have a standard error of 0.01, the seeds scatter by 0.7."""
    table = [*TABLE[:2], row("alike", 0, 9, ratio=1.11), row("alike", 1, 9, ratio=2.09)]
    alike = outcomes(pd.DataFrame(table))[-1]
    assert (alike.settings, alike.observable) == ("alike", "ratio")
    assert alike.uncertainty == pytest.approx(0.01 / 1.5)
    assert alike.resolved and alike.hidden


def test_pressures_that_a_seed_does_not_reach_are_left_out():
    low = row("low", 0, 20, **phi(0.2, 0.3)), row("low", 1, 20, **phi(0.3, math.nan))
    found = outcomes(pd.DataFrame([*TABLE[:2], *low]))[-1]
    assert found.observable == CURVE and found.value == pytest.approx(0.25)
    assert found.error == pytest.approx(0.05 / 0.2)
