"""Names of the code that stand in the pages are those of the code."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs/studies").glob("*.md")]
TEXT = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
NAMES = sorted(set(re.findall(r"`(dusttaichi(?:\.\w+)+)`", TEXT)))


def found(name):
    """The object of a dotted name: a module, or what is in it. Raises where there is none."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            value = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError as error:
            if error.name not in name:
                raise
            continue
        for part in parts[length:]:
            fields = getattr(value, "model_fields", {})
            value = fields[part] if part in fields else getattr(value, part)
        return value
    raise ModuleNotFoundError(name)


@pytest.mark.parametrize("name", NAMES)
def test_name_is_there(name):
    assert found(name) is not None


def test_the_walks_name_the_code():
    for page in ("walk_number.md", "walk_force.md"):
        names = set(re.findall(r"`(dusttaichi(?:\.\w+)+)`", (ROOT / "docs" / page).read_text()))
        assert len(names) >= 8


def test_every_room_is_in_the_tour():
    tour = (ROOT / "docs/developing.md").read_text(encoding="utf-8")
    rooms = {p.parent.name for p in (ROOT / "dusttaichi").glob("*/__init__.py")}
    for room in rooms:
        assert f"| `{room}` |" in tour and f"{room}/</text>" in tour, room
