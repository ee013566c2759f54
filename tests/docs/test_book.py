"""The book as a whole: its length, its links and how its pages are reached."""

import csv
import re
import shlex

import pytest
import typer
from scenes import ROOT
from snapshots import collision_row
from sources import import_from_docs

from dusttaichi.analysis.collisions import AXES, build_collisions_dataset
from dusttaichi.commands.app import app

DOCS = ROOT / "docs"
PAGES = {
    path.relative_to(DOCS).as_posix(): path.read_text(encoding="utf-8")
    for path in sorted(DOCS.rglob("*.md"))
    if not {"_build", "generated"} & set(path.relative_to(DOCS).parts)
}
# Pages for those who extend or change the program; all others are the users'.
DEVELOPERS = {
    "developing.md",
    "development.md",
    "extending.md",
    "notes.md",
    "releasing.md",
    "reliability.md",
    "walk_number.md",
}
LIMITS = {"users": 30_000, "developers": 6000, "notes.md": 1500, "README.md": 500}


def count_words(pages):
    return sum(len(PAGES[page].split()) for page in pages)


def test_the_book_is_short():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    words = {
        "users": count_words(PAGES.keys() - DEVELOPERS) + len(readme.split()),
        "developers": count_words(DEVELOPERS),
        "notes.md": count_words(["notes.md"]),
        "README.md": len(readme.split()),
    }
    assert not {name: count for name, count in words.items() if count > LIMITS[name]}


def toctree(page):
    """Pages that a page has in its tables of contents."""
    trees = re.findall(r"```\{toctree\}\n(.*?)```", PAGES[page], re.DOTALL)
    entries = [
        line.split("<")[-1].rstrip(">").strip()
        for tree in trees
        for line in tree.splitlines()
        if line and line[0] != ":"
    ]
    folder = page.rpartition("/")[0]
    return [f"{folder}/{entry}.md".removeprefix("/") for entry in entries]


def test_every_page_is_reached_from_the_first():
    reached, pending = set(), {"index.md"}
    while pending:
        reached |= pending
        pending = {entry for page in pending for entry in toctree(page) if entry in PAGES} - reached
    assert reached == set(PAGES)


def slug(heading):
    """Anchor of a heading, as GitHub and MyST make it."""
    text = re.sub(r"\]\([^)]*\)", "", heading)
    text = re.sub(r"\{\w+\}", "", text).replace("*", "").replace("`", "")
    return re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", "-")


def anchors(page):
    text = re.sub(r"```.*?```", "", PAGES[page], flags=re.DOTALL)
    return {slug(heading) for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}


def links():
    rows = (DOCS / "validation/verdicts.csv").read_text(encoding="utf-8")
    tables = [("validation.md", link) for link in re.findall(r"\]\(([^)#]+\.md[^)]*)\)", rows)]
    pages = [
        (page, link)
        for page, text in PAGES.items()
        for link in re.findall(r"\]\(((?!https?:)[^)\s]*(?:\.md|#)[^)\s]*)\)", text)
    ]
    return tables + [item for item in pages if "generated/" not in item[1]]


def test_links_lead_to_pages_and_headings():
    broken = []
    for page, link in links():
        file, _, anchor = link.partition("#")
        path = (DOCS / page).parent.joinpath(file).resolve() if file else DOCS / page
        target = path.relative_to(DOCS).as_posix() if path.is_relative_to(DOCS) else ""
        if not path.is_file() or anchor and target in PAGES and anchor not in anchors(target):
            broken.append(f"{page}: {link}")
    assert not broken


# The verdicts of the validation.


@pytest.fixture(scope="module")
def verdicts():
    return import_from_docs("verdicts")


def rows():
    with open(DOCS / "validation/verdicts.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_row_of_the_validation_has_a_verdict_on_a_page(verdicts):
    assert len(rows()) > 100
    assert {row["verdict"] for row in rows()} == set(verdicts.VERDICTS)
    assert {row["page"] for row in rows()} == set(verdicts.PAGES)
    for row in rows():
        assert row["quantity"] and row["expected"] and row["here"] and row["command"], row
    for name, (_, file) in verdicts.PAGES.items():
        assert f"generated/verdicts_{name}.md" in PAGES[file.split("#")[0]]


def test_notes_of_the_rows_are_on_their_page(verdicts):
    for row in rows():
        for number in re.findall(r"\[(\d+)\]\(#caveats\)", row["link"]):
            page = PAGES[verdicts.PAGES[row["page"]][1]]
            assert re.search(rf"^{number}\. ", page.split("## Caveats")[1], re.MULTILINE), row


@pytest.mark.parametrize(
    "expected, here, error",
    [
        ("2 kPa", "3.0 ± 0.1 kPa", "+50 %"),
        ("1/2", "1/2", "0 %"),
        ("16.7 ms", "17.4 ms", "+4.2 %"),
        ("2 kPa", "2 Pa", ""),
        ("0", "0.1", ""),
        ("grows", "2", ""),
    ],
)
def test_the_error_is_the_deviation_of_numbers_of_one_unit(verdicts, expected, here, error):
    assert verdicts.compute_error(expected, here) == error


@pytest.mark.parametrize("command", sorted({row["command"] for row in rows()}))
def test_the_command_of_a_row_is_understood(command):
    if command.startswith("test_"):
        assert list((ROOT / "tests").rglob(f"{command}.py"))
        return
    words = shlex.split(command)
    for word in words:
        if word.startswith(("configs/", "docs/", "tests/")):
            assert (ROOT / word).is_file(), word
    if words[0] == "dust":
        group = typer.main.get_command(app)
        group.commands[words[1]].make_context(words[1], words[2:]).close()


def test_the_table_of_a_map_of_collisions(monkeypatch):
    """Means over pairs that touched: by filling factor, and by impact parameter."""
    monkeypatch.syspath_prepend(str(DOCS))
    import collide_map

    axes = dict.fromkeys(AXES, (1.0,)) | {"body": ("phi_0.1", "phi_0.3"), "speed": (5.0, 10.04)}
    axes |= {"impact_parameter": (0.25, 0.75), "seed": (0, 1)}
    growths = [1.0, 0.5, 0.2, 0.1, -1.0, -0.5, 0.0, 0.0, 1.0, 1.0, 0.4, None, 0.5, 0.5, 0.0, 0.0]
    rows = [
        {"outcome": "miss"} if g is None else collision_row(growth_efficiency=g) for g in growths
    ]
    table = list(collide_map.tabulate_growth(build_collisions_dataset(rows, axes)))
    assert table == [
        {"speed (m/s)": "5", "φ 0.1": "0.45", "φ 0.3": "0.80", "b 0.25": "0.88", "b 0.75": "0.23"},
        {
            "speed (m/s)": "10",
            "φ 0.1": "-0.38",
            "φ 0.3": "0.25",
            "b 0.25": "-0.12",
            "b 0.75": "0.00",
        },
    ]
