"""Style guard: words that readers had to ask about do not come back to pages, code and messages."""

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# Regular expression of what is refused -> what to write instead.
STANDARD = {
    r"told": "passed (arguments), stated, reported",
    r"asked(?: for)?": "requested",
    r"kept": "stored, history (of a contact)",
    r"held": "controlled, prescribed (a load), stored, fixed",
    r"anew": "again, from the start",
    r"dear(?:er|est)?": "expensive",
    r"(?<!--)knobs?": "parameter",
    r"rungs?": "level",
    r"beats?": "output step",
    r"lets? (?:\w+ )?go(?: of)?": "unloads",
    r"tak(?:es?|en|ing) over": "continues, reuses",
    r"go(?:es|ing)? on": "continues",
    r"rooms|room (?:for|of)": "subpackage, box, capacity",
    r"balls?": "sphere",
    r"crew": "workers",
    r"legs|(?:of|the) books": "segments, accounts",
    r"lean(?:s|ing)?": "sheared, tilt (of a cell), lever_factor (of a spring)",
    r"graz(?:e|es|ing)": "impact speed, normal velocity",
    r"(?:is|are|be|was|were) looked (?:at|for)": "checked, examined, searched",
    r"hangs? together": "connected",
    r"borne|bears?": "carried, supports",
    r"stands? (?:in|on|at|for|beside|there)|as (?:it|they) stands?": "is, is in, is listed",
    r"swings? by": "fluctuates",
    r"of (?:now|then)": "current, previous",
    r"unlike grains|(?:not|all) alike": "unequal, polydisperse; equal",
    r"surroundings": "environment, boundary",
    r"what it costs": "energy dissipated, run time",
    r"perhaps": "optionally",
    r"so many": "that many, the number by its name",
    r"by luck": "by chance, since errors cancel",
    r"nobody knows": "unknown",
    r"of one core": "on one core",
    r"(?:scene|run) as it is": "default, unchanged",
    r"(?-i:Of (?:the|a|an|all|each|both|two|several|others))": "the subject first",
    r'(?<=""")(?-i:Of|Such|Those|What|How|Where|Which|Why|Whether|When)': "a noun or verb phrase",
    r"neighbor\w*|(?<!Compression )behavior\w*|analyz\w+": "British spelling",
}
REFUSED = re.compile(r"\b(?:" + "|".join(f"({word})" for word in STANDARD) + r")\b", re.IGNORECASE)
INSTEAD = list(STANDARD.values())


@cache
def faults(path):
    """Refused words of a file as "file:line: word; write ..."."""
    text = re.sub(
        r".*# (?:former|foreign) name$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    name = path.relative_to(ROOT).as_posix()
    return [
        f"{name}:{text.count(chr(10), 0, word.start()) + 1}: {word[0]!r}; "
        f"write {INSTEAD[word.lastindex - 1]}"
        for word in REFUSED.finditer(text)
    ]


def pages():
    built = {"_build", "generated"}
    below = (ROOT / "docs").rglob("*.md")
    markdown_files = (p for p in below if not built & set(p.relative_to(ROOT).parts))
    return [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(markdown_files)]


def scenes():
    """The bundled scenes, and the examples of the pages."""
    files = [*(ROOT / "configs").rglob("*"), *(ROOT / "docs/examples").glob("*")]
    return sorted(p for p in files if p.suffix in (".yaml", ".py", ".sh"))


def code():
    """Python files of the package and of the benchmarks."""
    return sorted(
        p for folder in ("dusttaichi", "benchmarks") for p in (ROOT / folder).rglob("*.py")
    )


def test_pages_scenes_messages_and_code_use_the_words_of_the_field():
    faults_found = [fault for path in (*pages(), *scenes(), *code()) for fault in faults(path)]
    assert not faults_found, "\n" + "\n".join(faults_found)


@pytest.mark.parametrize(
    "text, line, word",
    [
        ("x\nThe room for contacts", 2, "room for"),
        ("A dearer step", 1, "dearer"),
        ("colour", 0, ""),
    ],
)
def test_the_guard_names_file_and_line(tmp_path, monkeypatch, text, line, word):
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    path = tmp_path / "page.md"
    path.write_text(text, encoding="utf-8")
    faults_found = faults(path)
    assert bool(faults_found) == bool(line)
    assert all(fault.startswith(f"page.md:{line}: '{word}'; write ") for fault in faults_found)
