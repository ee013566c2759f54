"""README and pages hold: commands, files, scenes and code are those of the program."""

import json
import os
import re
import shlex

import pytest
import typer
from program import dust, python
from scenes import ROOT, extensions_forgotten

from benchmarks.__main__ import app as benchmarks
from dusttaichi.commands.app import app
from dusttaichi.scene import Scene, from_yaml, load, shipped
from dusttaichi.scene.yaml_text import read

DOCS = ROOT / "docs"
BUILT = {"_build", "generated"}  # made by Sphinx, not written by anyone
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
    if not BUILT & set(path.relative_to(ROOT).parts)
}
README = PAGES["README.md"]
EVERYTHING = "\n".join(PAGES.values())


def blocks(language, text):
    """Code of the fenced blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def test_the_readme_is_short_and_has_the_two_commands():
    assert len(README.splitlines()) <= 150
    assert blocks("sh", README)[0].splitlines() == [
        "pip install -e . && dust run configs/omni_static.yaml",
        "pip install -e '.[test]' && pytest",
    ]


# Commands.

LINES = [
    line for text in PAGES.values() for block in blocks("sh", text) for line in block.split("\n")
]
LINES += re.findall(r"^!(dust .+)$", EVERYTHING, re.MULTILINE)  # cells of the tutorial
PARTS = {part.split("#")[0].strip() for line in LINES for part in line.split("&&")}
DUST = sorted(part for part in PARTS if part.startswith("dust "))


@pytest.mark.parametrize("command", DUST)
def test_command_is_understood(command):
    # Brackets only say that an option may be left out; ">" is the shell's.
    words = shlex.split(re.sub(r"[\[\]]", "", command.split(">")[0]))[1:]
    words = ["1" if word == "N" else word for word in words]
    group = typer.main.get_command(app)
    if words[0].startswith("--"):
        assert words[0] in {name for option in group.params for name in option.opts}
        return
    assert words[0] in group.commands
    # Parsing refuses unknown options and surplus arguments; nothing is run.
    group.commands[words[0]].make_context(words[0], words[1:]).close()


@pytest.mark.parametrize(
    "command",
    sorted(
        {
            *re.findall(r"`(python\s-m\sbenchmarks[^`]+)`", EVERYTHING),
            *(part for part in PARTS if part.startswith("python -m benchmarks")),
        }
    ),
)
def test_benchmark_is_understood(command):
    words = command.split()[3:]
    group = typer.main.get_command(benchmarks)
    group.commands[words[0]].make_context(words[0], words[1:]).close()


def test_every_command_is_described():
    shown = {shlex.split(command)[1] for command in DUST}
    assert set(typer.main.get_command(app).commands) <= shown


def test_extras_are_those_of_the_package():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    extras = project.split("[project.optional-dependencies]")[1].split("[project.scripts]")[0]
    for extra in re.findall(r"'\.\[(\w+)\]'", EVERYTHING):
        assert re.search(rf"^{extra} = ", extras, re.MULTILINE), extra


# Files. Links between the pages of the site are checked by Sphinx.

LINKS = re.findall(r"\]\((?!https?:|#)([^)#]+)\)", README)
FILES = re.findall(r"\b(?:configs|docs|tests|dusttaichi)/[\w./]+\.(?:yaml|csv|png|py)", EVERYTHING)


@pytest.mark.parametrize("path", sorted({*LINKS, *FILES}))
def test_file_exists(path):
    assert (ROOT / path).is_file()


@pytest.mark.parametrize("page", PAGES)
def test_every_figure_is_there(page):
    folder = (ROOT / page).parent
    for figure in re.findall(r"!\[[^\]]*\]\(([^)]+)\)|```\{figure\} (\S+)", PAGES[page]):
        assert (folder / "".join(figure)).is_file(), figure


# YAML.

CONFIGS = {path.stem for path in (ROOT / "configs").glob("*.yaml")}
SCENES = [
    (page, block)
    for page, text in PAGES.items()
    for block in blocks("yaml", text)
    if (name := re.search(r"^name: (\w+)", block, re.MULTILINE)) and name[1] in CONFIGS
]
FRAGMENTS = [
    (page, block)
    for page, text in PAGES.items()
    for block in blocks("yaml", text)
    if (page, block) not in SCENES
]


@pytest.mark.parametrize("page, text", SCENES)
def test_scene_is_the_config(page, text):
    scene = from_yaml(text)
    assert scene == load(ROOT / f"configs/{scene.name}.yaml")


@pytest.mark.parametrize("page, fragment", FRAGMENTS)
def test_fragment_fits_into_the_example(page, fragment):
    example, fragment_data = read(SCENES[0][1]).data, read(fragment).data
    if "method" in fragment_data:  # a whole scene, which a reader can copy
        assert "name" in fragment_data, "give the scene a name"
        example = {}
    if "stages" in fragment_data:
        example.pop("stop", None)
    with extensions_forgotten():
        Scene.from_dict({**example, **fragment_data})


@pytest.mark.parametrize("path", sorted((DOCS / "examples").glob("*.yaml")), ids=lambda p: p.name)
def test_scene_of_an_example_is_understood(path):
    with extensions_forgotten():
        assert load(path)


# Python.

RUN = [page for page, text in PAGES.items() if blocks("python", text)]
# What must hold after the blocks of a page.
CHECKS = {
    "docs/results.md": """
assert phi.dims == ("time",) and phi.size > 1 and pressure.dims == ("time",)
assert rolling.attrs["units"] == "J" and contacts_per_grain.max() < 6
assert profiles.filling_factor.dims == ("profile", "bin")
assert frames.position.dims == ("snapshot", "grain", "xyz")
assert height_of_grains.sizes == {"grain": series.attrs["grains"]}
assert contacts.sizes["contact"] == int(last.contact_count)
assert walls.sizes["wall_contact"] == int(last.wall_contact_count)
assert len(curve.raw_pressure) > 1 and set(shares) == set(series.channel.values)
assert numbers["grains"] == 60
"""
}


@pytest.fixture(scope="module")
def folder_with_a_run(tmp_path_factory):
    """A folder with runs/omni_static, which is the smoke config with few steps."""
    folder = tmp_path_factory.mktemp("pages")
    scene = load(ROOT / "configs/smoke.yaml").with_value("stop.steps", 300)
    (folder / "short.yaml").write_text(scene.to_yaml(), encoding="utf-8")
    (folder / "configs").symlink_to(ROOT / "configs")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        dust("run", "short.yaml", "-o", "runs/omni_static", "-q")
    return folder


PAGE_AFTER_PAGE = """
import contextlib, io, json, sys, traceback
for page, code in json.load(sys.stdin).items():
    printed, error = io.StringIO(), ""
    try:
        with contextlib.redirect_stdout(printed):
            exec(compile(code, page, "exec"), {"__name__": "__main__"})
    except BaseException:
        error = traceback.format_exc()
    print(json.dumps([page, printed.getvalue(), error]))
"""


@pytest.fixture(scope="module")
def ran(folder_with_a_run):
    """Page -> what its blocks have printed, and the error that has ended them or "". All in one
    process, each with names of its own."""
    codes = {
        page: "\n".join([*blocks("python", PAGES[page]), CHECKS.get(page, "")]) for page in RUN
    }
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    env = {**os.environ, "PYTHONPATH": path, "MPLBACKEND": "Agg"}
    options = {"cwd": folder_with_a_run, "env": env, "timeout": 300}
    process = python("-c", PAGE_AFTER_PAGE, input=json.dumps(codes), **options)
    assert process.returncode == 0, process.stdout + process.stderr
    answers = (json.loads(line) for line in process.stdout.splitlines())
    return {page: (printed, error) for page, printed, error in answers}


@pytest.mark.parametrize("page", RUN)
def test_python_blocks_run(page, ran):
    printed, error = ran[page]
    assert not error, printed + error
    if page in ("README.md", "docs/results.md"):
        assert "wall_speed: 5 m/s" in printed


def test_what_a_run_leaves(folder_with_a_run):
    names = {path.name for path in (folder_with_a_run / "runs/omni_static").iterdir()}
    section = PAGES["docs/running.md"].split("## What a run leaves")[1].split("##")[0]
    named = {
        name
        for row in re.findall(r"^\| (`.+?) \|", section, re.MULTILINE)
        for name in re.findall(r"`([^`]+)`", row)
    }
    # the checkpoint before the last is there if the run took long enough for two
    previous = {"checkpoint.bin.previous"}
    assert previous <= named and named - previous == names - previous


def test_tests_that_are_named_exist():
    files = list((ROOT / "tests").rglob("test_*.py"))
    test_names = {
        name for file in files for name in re.findall(r"^def (test_\w+)", file.read_text(), re.M)
    }
    test_names |= {file.stem for file in files}
    named = set(re.findall(r"`(test_\w+)", EVERYTHING))
    assert named and not named - test_names


def test_cards_of_the_gallery_run_the_scene_they_name_and_say_how_long():
    cards = PAGES["docs/gallery.md"].split(":::{grid-item-card} ")[1:]
    assert len(cards) > 10
    for card in cards:
        ran = re.findall(r"^dust (?:run|sweep|sticking|collide) (\S+)", card, re.M)
        assert not [name for name in ran if shipped.find_scene(name) is None], "not bundled"
        if not ran:  # what is shown is of another card
            continue
        assert f"`configs/{ran[0]}.yaml`" in card, card
        size, time, verdict = card.split("\n+++\n")[1].split("\n:::")[0].split(" · ")[-3:]
        assert re.search(r"\b(second|minute|hour)s?\b", time, re.I), card
        assert re.search(r"agrees|differs|fitted|laboratory|no experiment", verdict), card
