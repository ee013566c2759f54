"""The README holds: its commands, files, keys, defaults and code are those of the program."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from dusttaichi.commands.app import app
from dusttaichi.results.variables import VARIABLES
from dusttaichi.scene import Scene, from_yaml, json_schema, load
from dusttaichi.scene.yaml_text import read

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Code of the fenced blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)


# Commands.

PARTS = [part for block in blocks("sh") for line in block.splitlines() for part in line.split("&&")]
COMMANDS = sorted({part.split("#")[0].strip() for part in PARTS if part.strip()})
DUST = [command for command in COMMANDS if command.startswith("dust ")]


def test_the_two_commands_are_there():
    assert blocks("sh")[0].splitlines() == [
        "pip install -e '.[test]' && dust run configs/omni_static.yaml",
        "pip install -e '.[test]' && pytest",
    ]


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


def test_every_command_is_described():
    shown = {shlex.split(command)[1] for command in DUST}
    assert set(typer.main.get_command(app).commands) <= shown


def test_extras_are_those_of_the_package():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    extras = project.split("[project.optional-dependencies]")[1].split("[project.scripts]")[0]
    for extra in re.findall(r"'\.\[(\w+)\]'", TEXT):
        assert re.search(rf"^{extra} = ", extras, re.MULTILINE), extra


# Files.

LINKS = re.findall(r"\]\((?!https?:|#)([^)]+)\)", TEXT)
CONFIGS = re.findall(r"\bconfigs/[\w./]+\.yaml", TEXT)


@pytest.mark.parametrize("path", sorted({*LINKS, *CONFIGS}))
def test_file_exists(path):
    assert (ROOT / path).is_file()


def test_headings_that_are_linked_exist():
    headings = re.findall(r"^#+ (.+)$", TEXT, re.MULTILINE)
    anchors = {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}
    assert set(re.findall(r"\]\(#([^)]+)\)", TEXT)) <= anchors


# YAML.

EXAMPLE, *FRAGMENTS = blocks("yaml")


def test_example_is_the_config():
    assert from_yaml(EXAMPLE) == load(ROOT / "configs/omni_static.yaml")


@pytest.mark.parametrize("fragment", FRAGMENTS)
def test_fragment_fits_into_the_example(fragment):
    example, own = read(EXAMPLE).data, read(fragment).data
    if "stages" in own:
        del example["stop"]
    Scene.from_dict({**example, **own})


ROWS = re.findall(r"^\| `([a-z_.]+)` \| (?:`(.*?)`)? *\|", TEXT, re.MULTILINE)
BLOCKS = json_schema()["properties"]
DEFAULTS = {key: text for key, text in ROWS if text and key.split(".")[0] in BLOCKS}
PLAIN = {
    "name": "cake",
    "material": "silicate_s12",
    "sample": {"kind": "rbd", "grains": 100},
    "boundary": {"kind": "box"},
    "stop": {"steps": 10},
}
COMPRESSING = {"boundary": {"kind": "box", "wall_speed": "1 cm/s"}}
# What a scene must have besides, for a key to have its place or this default.
PLACE = {
    "interaction.damping.coefficient": {"interaction": {"damping": "scaled"}},
    "interaction.damping.time": {"interaction": {"damping": "viscoelastic"}},
    "interaction.damping.kappa": {"interaction": {"damping": "viscous"}},
    "interaction.asperities.yield_strength": {
        "material": "silica_pd08",
        "interaction": {"asperities": "on"},
    },
    "sample.filling_factor": {"sample": {"kind": "random_packing", "grains": 9}},
    "sample.axis": {"sample": {"kind": "chain", "grains": 9}},
    "sample.speed": {"sample": {"kind": "pair"}},
    "sample.impact_parameter": {"sample": {"kind": "pair"}},
    "sample.orientation": {
        "sample": {
            "kind": "collision",
            "target": {"kind": "pair"},
            "projectile": {"kind": "pair"},
            "speed": "1 m/s",
        }
    },
    "sample.units": {"sample": {"kind": "explicit", "file": "grains.csv"}},
    **{
        f"boundary.{key}": {"boundary": {"kind": "plates"}}
        for key in ("gap", "glue", "inner_radius")
    },
    **{f"boundary.{key}": {"boundary": {"kind": "periodic"}} for key in ("axes", "walls")},
    **{
        f"stages.output.{key}": {"stages": [{"name": "a", "stop": {"steps": 1}}], "stop": None}
        for key in ("series", "profiles", "snapshots")
    },
}


def test_every_key_is_described():
    schema = json_schema()
    for block in [schema, *schema["$defs"].values()]:
        for name in block.get("properties", {}):
            assert re.search(rf"`(\w+\.)*{name}[`.]|\{{{name}: ", TEXT), name


@pytest.mark.parametrize("key", DEFAULTS)
def test_default_is_what_the_table_says(key):
    value = read("value: " + DEFAULTS[key].replace("<name>", "cake")).data["value"]
    scene = Scene.from_dict({**PLAIN, **PLACE.get(key, {})})
    assert scene.with_value(key.replace("stages.", "stages.0."), value) == scene


def test_the_table_has_every_default():
    resolved = read(Scene.from_dict({**PLAIN, **COMPRESSING}).to_yaml()).data
    for block in ("interaction", "boundary", "numerics", "output"):
        assert {f"{block}.{key}" for key in resolved[block]} <= {key for key, _ in ROWS}, block


# Python.


@pytest.fixture(scope="module")
def folder_with_a_run(tmp_path_factory):
    """A folder with runs/omni_static, which is the smoke config with few steps."""
    folder = tmp_path_factory.mktemp("readme")
    scene = load(ROOT / "configs/smoke.yaml").with_value("stop.steps", 300)
    (folder / "short.yaml").write_text(scene.to_yaml(), encoding="utf-8")
    # A process of its own: Taichi keeps one set of fields a process, which other tests share.
    python(
        folder,
        "from dusttaichi.commands.app import main; main()",
        "run",
        "short.yaml",
        "--output",
        "runs/omni_static",
        "--quiet",
    )
    return folder


def python(folder, code, *arguments):
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "MPLBACKEND": "Agg"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_python_blocks_run(folder_with_a_run):
    checks = """
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
    printed = python(folder_with_a_run, "\n".join([*blocks("python"), checks]))
    assert "wall_speed: 5 m/s" in printed


def test_what_a_run_leaves(folder_with_a_run):
    left = {path.name for path in (folder_with_a_run / "runs/omni_static").iterdir()}
    section = TEXT.split("## What a run prints and leaves")[1].split("##")[0]
    named = {
        name
        for row in re.findall(r"^\| (`.+?) \|", section, re.MULTILINE)
        for name in re.findall(r"`([^`]+)`", row)
    }
    assert named == left


def test_every_variable_of_the_series_is_named():
    for variable in VARIABLES.values():
        if variable.group == "series" and variable.grows:
            assert f"`{variable.name}`" in TEXT, variable.name
