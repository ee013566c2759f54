"""The parts of the pages that are made from the program have everything in them."""

import sys

import pytest
import typer
from scenes import ROOT, extensions_forgotten

from dusttaichi.commands.app import app
from dusttaichi.grains.variables import VARIABLES
from dusttaichi.scene import NAMED, shipped
from dusttaichi.scene.keys import rows

DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def generate():
    """docs/generate.py, which is no part of the package."""
    sys.path.insert(0, str(DOCS))
    try:
        import generate

        yield generate
    finally:
        sys.path.remove(str(DOCS))


def included():
    """Names of the generated parts that the pages include."""
    texts = [p.read_text(encoding="utf-8") for p in DOCS.glob("*.md")]
    return {line.split()[-1] for text in texts for line in text.split("\n") if "include}" in line}


def test_every_key_is_in_a_table_of_a_page(generate):
    tables = "\n".join(generate.keys(block) for block in generate.blocks())
    for key in rows():
        assert f"| `{key.path}` |" in tables, key.path
        assert key.default in tables, key.path
    assert {f"generated/keys_{block}.md" for block in generate.blocks()} <= included()


def test_every_variable_is_in_a_table(generate):
    for variable in VARIABLES.values():
        row = f"| `{variable.name}` |"
        assert row in generate.variables(variable.group, VARIABLES.values()), variable.key
    assert set(generate.GROUPS) == {variable.group for variable in VARIABLES.values()}
    assert {f"generated/variables_{group}.md" for group in generate.GROUPS} <= included()
    # the features that they need have words
    needed = set().union(*(variable.needs for variable in VARIABLES.values()))
    assert needed <= set(generate.FEATURES) | {"profiles", "snapshots", "contacts"}


def test_named_materials_are_in_the_table(generate):
    assert all(f"`{name}`" in generate.materials() for name in NAMED)


def test_numbers_of_bundled_extensions_are_in_a_table_of_their_own(generate):
    with extensions_forgotten():
        text, own = generate.numbers(*generate.bundled()), generate.numbers(generate.built_in())
        assert "| `spin_rate` |" in text and "`reissl2024/spin_up.py`" in text
        assert "spin_rate" not in own and "| `strength` |" in own and "`strength`" not in text


def test_every_bundled_extension_is_named_on_the_page():
    page = (DOCS / "extending.md").read_text(encoding="utf-8")
    for path in shipped.extensions_named("*.py"):
        assert f"`configs/{path.relative_to(shipped.folder()).as_posix()}`" in page, path


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
