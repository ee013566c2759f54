"""Files of the user's own that a scene names: errors, what they register, runs, resume."""

import hashlib
import shutil
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import pytest
import xarray as xr
import yaml
from program import dust, invoke
from scenes import BASE, CONFIGS, EXAMPLES, extensions_forgotten, write_spring

from dusttaichi import method
from dusttaichi.commands import options
from dusttaichi.errors import DustError
from dusttaichi.physics.contact import effect_registry
from dusttaichi.results import shown
from dusttaichi.running import execute
from dusttaichi.running.identity import code_hash
from dusttaichi.samples import sample_registry
from dusttaichi.scene import extensions, from_yaml, json_schema, load, load_extensions
from dusttaichi.scene.yaml_text import read
from dusttaichi.studies.result_store import ResultStore
from dusttaichi.studies.scene_settings import list_input_files
from dusttaichi.studies.sweep_study import replicas, sweep

ROLLING = "{rolling: {law: speed_dependent, modifier: 8, speed: 1 cm/s}}"
LAW = BASE.replace("{rolling: on}", ROLLING) + "extensions: [rolling_with_speed.py]\n"
CHAIN = """
name: chain
extensions: [rolling_with_speed.py]
material: silicate_s12
interaction: {rolling: {law: speed_dependent}, damping: none}
sample: {kind: chain, grains: 3}
boundary: {kind: box, omit: [x_min, x_max, y_min, y_max, bottom], size: [1 cm, 1 cm, 1 cm]}
stop: {steps: 40}
numerics: {time_step: 0.1 ns}
output: {profiles: off, snapshots: off}
"""
SPRING = """
name: spring
extensions: [spring.py]
method: spring
boundary: {kind: open}
stages:
  - {name: swing, stop: {steps: 100}}
  - {name: on, stop: {steps: 100}}
numerics: {time_step: 10 ns}
output: {series: {steps: 50}}
"""
RING = """
from typing import Literal
from dusttaichi import samples

class Ring(samples.SampleBlock):
    kind: Literal["ring"]
    grains: int = 3

@samples.register(Ring)
def make(spec, materials):
    return samples.Sample.at_rest([[2 * materials.radius * n, 0, 0] for n in range(spec.grains)])
"""


@pytest.fixture(autouse=True)
def leave_nothing_behind():
    with extensions_forgotten():
        yield


@pytest.fixture
def folder(tmp_path):
    """The example of the docs, and the method of the tests as a file of the user's own."""
    shutil.copy(EXAMPLES / "rolling_with_speed.py", tmp_path)
    write_spring(tmp_path)
    return tmp_path


# -- errors --------------------------------------------------------------------------------------

WRONG = {
    "[none.py]": r'extensions\[0\] = "none.py": there is no such file \(.*none.py\); a Python file',
    "[sub.py]": r"extensions\[0\] = .*is a directory.*; a Python file is needed, relative",
    "[law.txt]": r'extensions\[0\] = "law.txt": a Python file is needed, whose name ends in .py',
    "[3]": r"extensions\[0\] = 3: a Python file is needed",
    "law.py": r'extensions = "law.py": a list of Python files is needed, for example \[rolling_w',
    "[spring.py, raises.py]": r"extensions\[1\] = .*its code raises ValueError: no such"
    r" thing \(.*raises.py, line 4\)  \(line 9\)",
    "[leaves.py]": r"its code raises SystemExit: 3 \(.*leaves.py, line 1\)",
    "[syntax.py]": r"not valid Python: .*\(.*syntax.py, line 2\)",
    "[moved.py]": r"No module named 'dusttaichi.names' \(",
    "[effect.py]": r"raises ValueError: effect = 'roling': one of .* \(.*effect.py, line 2\)",
    "[grains.py]": r"raises ValueError: grains is a method of this package",
}


@pytest.mark.parametrize("written", WRONG)
def test_what_cannot_be_imported(folder, written):
    (folder / "sub.py").mkdir()
    files = {
        "raises": "def f():\n    # the place\n    # that is told\n    raise ValueError('no such"
        "\\nthing')\n\nf()\n",
        "leaves": "raise SystemExit(3)\n",
        "moved": "from dusttaichi.names import WALLS\n",
        "syntax": "a = 1\nb = = 2\n",
        "effect": "from dusttaichi.physics.contact import register\nregister('roling', 'a', 1)\n",
        "grains": "from dusttaichi import method\nmethod.register(method.load_method('grains'))\n",
    }
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    path = folder / "my.yaml"
    path.write_text(f"{BASE}extensions: {written}\n")
    with pytest.raises(DustError, match=WRONG[written]) as error:
        load(path)
    assert len(str(error.value).splitlines()) == 2 and "Traceback" not in str(error.value)


def test_a_misspelt_key_of_a_registered_law_gets_the_keys_of_that_law(folder):
    text = LAW.replace("speed: 1 cm/s", "speeed: 1 cm/s")
    with pytest.raises(DustError, match=r'did you mean "speed"\? allowed: law, modifier, speed '):
        from_yaml(text, folder)
    linear = LAW.replace("law: speed_dependent, modifier: 8, speed: 1 cm/s", "modifer: 8")
    with pytest.raises(DustError, match=r"allowed: law, modifier  \("):
        from_yaml(linear, folder)


def test_what_files_have_registered_is_taken_back_where_one_fails(folder):
    (folder / "late.py").write_text(RING + "\n1 / 0\n")
    with pytest.raises(DustError, match="ZeroDivisionError"):
        from_yaml(BASE + "extensions: [late.py]\n", folder)
    assert "ring" not in sample_registry.GRAINS
    with pytest.raises(DustError, match=r"sample.*ring"):
        from_yaml(BASE.replace("kind: rbd", "kind: ring"))
    with pytest.raises(DustError) as error:
        from_yaml(BASE + "extensions: [a.py, rolling_with_speed.py, b.py]\n", folder)
    assert len(str(error.value).splitlines()) == 3


def test_two_files_for_one_name_are_refused(folder):
    text = (folder / "rolling_with_speed.py").read_text()
    (folder / "other.py").write_text(text.replace("1.0 +", "2.0 +"))
    scene = from_yaml(LAW, folder)
    law = effect_registry.law_of("rolling", "speed_dependent")
    refused = r"registers the law rolling.speed_dependent, as .*rolling_with_speed.py does, which"
    with pytest.raises(DustError, match=r"extensions\[1\] = .*" + refused):
        from_yaml(LAW.replace("speed.py]", "speed.py, other.py]"), folder)
    assert effect_registry.law_of("rolling", "speed_dependent") is law
    assert scene.with_value("interaction.rolling.speed", "2 cm/s").interaction.rolling.speed == 0.02


# -- registration --------------------------------------------------------------------------------


def test_law_kind_and_method_are_known(folder):
    (folder / "ring.py").write_text(RING)
    scene = from_yaml(LAW, folder)
    assert scene.interaction.rolling.law == "speed_dependent"
    assert from_yaml(SPRING, folder).method == "spring" and "spring" in method.METHODS
    ring = BASE.replace("{kind: rbd, grains: 100}", "{kind: ring}") + "extensions: [ring.py]\n"
    assert len(method.make_sample(from_yaml(ring, folder))) == 3


def test_twice_is_harmless(folder):
    """A file once more, a link to it, a copy of it."""
    first = from_yaml(LAW, folder)
    law = effect_registry.law_of("rolling", "speed_dependent")
    (folder / "link.py").symlink_to(folder / "rolling_with_speed.py")
    shutil.copy(folder / "rolling_with_speed.py", folder / "copy.py")
    for names in ("rolling_with_speed.py", "link.py", "copy.py", "copy.py, link.py"):
        repeated_scene = from_yaml(LAW.replace("rolling_with_speed.py", names), folder)
        assert effect_registry.law_of("rolling", "speed_dependent") is law
        assert type(repeated_scene.interaction.rolling) is type(first.interaction.rolling)
        assert code_hash(repeated_scene) == code_hash(first)


def test_a_changed_file_needs_another_process(folder):
    """A scene goes on with what was imported; reading the YAML anew says that it has changed."""
    path = folder / "my.yaml"
    path.write_text(LAW)
    scene = load(path)
    code = code_hash(scene)
    with (folder / "rolling_with_speed.py").open("a") as file:
        file.write("# changed\n")
    assert code_hash(scene.with_value("stop.filling_factor", 0.5)) == code
    with pytest.raises(DustError, match=r"has changed since this process imported it; restart"):
        load(path)


def test_paths_are_found_from_anywhere(folder, monkeypatch):
    (folder / "runs").mkdir()
    monkeypatch.chdir(folder / "runs")
    scene = from_yaml(LAW, "..")
    absolute_text = scene.to_yaml(absolute=True)
    (path,) = yaml.safe_load(absolute_text)["extensions"]
    assert Path(path) == folder / "runs/../rolling_with_speed.py"
    monkeypatch.chdir("/")
    assert from_yaml(absolute_text).interaction == scene.interaction


def test_a_cluster_is_sent_the_file(folder, monkeypatch):
    monkeypatch.chdir(folder)
    plan = replicas(from_yaml(LAW + "replicas: 1\n", folder), folder / "runs")
    assert list_input_files(plan.members[0].scene) == ["rolling_with_speed.py"]


def test_the_schema_has_what_a_file_registers(folder):
    path = folder / "my.yaml"
    path.write_text("# not finished yet\nextensions: [rolling_with_speed.py, spring.py]\n")
    schema_before, data = json_schema(), read(LAW).data
    assert not jsonschema.Draft202012Validator(schema_before).is_valid(data)
    load_extensions(path)
    schema = jsonschema.Draft202012Validator(json_schema())
    schema.validate(data)
    schema.validate(read(SPRING).data)
    data["interaction"]["rolling"]["speed"] = 3
    assert not schema.is_valid(data)


def test_a_bundled_file_is_named_from_anywhere(folder, monkeypatch):
    """In no need of permission; a file of the user's own at that place comes first."""
    (folder / "my.yaml").write_text(BASE + "extensions: [reissl2024/spin_up.py]\n")
    with options.importing(None):
        scene = load(folder / "my.yaml")
    assert scene.extensions[0].samefile(CONFIGS / "reissl2024/spin_up.py")
    assert (
        "spin_up" in shown.NUMBERS
        and extensions.import_extension("configs/reissl2024/spin_up.py").SPIN_UP
    )
    monkeypatch.chdir(folder)
    (folder / "reissl2024").mkdir()
    (folder / "reissl2024/spin_up.py").write_text("MINE = True\n")
    assert extensions.import_extension("reissl2024/spin_up.py").MINE
    with pytest.raises(DustError, match="there is no such file"):
        extensions.import_extension("../docs/examples/loss_per_grain.py")  # nothing below configs


def test_only_the_content_that_a_result_names_is_imported():
    file = CONFIGS / "reissl2024/spin_up.py"
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    text = f"spin_up.py sha256:{'0' * 64}"
    named = f"mine.py sha256:{'1' * 64}\nspin_up.py sha256:{digest}, {text}"
    extensions.import_bundled(text)
    assert not shown.NUMBERS.added
    extensions.import_bundled(named)
    assert "spin_up" in shown.NUMBERS and "spin_up" in shown.FIGURES
    assert extensions.list_missing(named) == ["mine.py", "spin_up.py"]


# -- runs ----------------------------------------------------------------------------------------


def test_a_law_runs_in_a_worker(folder, capsys):
    """In a process that knows the law only from its YAML."""
    (folder / "my.yaml").write_text(CHAIN)
    values = "interaction.rolling.speed=1cm/s"
    dust("sweep", folder / "my.yaml", "--set", values, "-q", "-o", folder / "s")
    with xr.open_dataset(folder / "s/sweep.nc") as data:
        assert data.interaction_rolling_speed.values.tolist() == [0.01]
        assert data.attrs["extensions"].startswith("rolling_with_speed.py sha256:")
    dust("check", folder / "my.yaml")
    assert "slowness" in capsys.readouterr().out


def change(file):
    """Another content, as a new process would find it."""
    with file.open("a") as text:
        text.write("# changed\n")
    extensions._imported.clear()
    extensions._owners.clear()


def test_resume_is_refused_after_the_file_has_changed(folder):
    (folder / "my.yaml").write_text(SPRING)
    words = ("run", folder / "my.yaml", "-q", "-o", folder / "runs/one")
    dust(*words)
    with xr.open_dataset(folder / "runs/one/result.nc") as result:
        assert result.attrs["extensions"].startswith("spring.py sha256:")
    change(folder / "spring.py")
    with pytest.raises(DustError, match="spring.py differs. Restore it, or start again"):
        dust(*words, "--resume")


def test_members_of_another_file_do_not_count(folder, monkeypatch):
    """Finished members are those of the content of the file."""
    monkeypatch.chdir(folder)
    scene = from_yaml(SPRING, folder)
    plan = sweep(scene, ["stiffness=2"], folder / "sweep")
    (member,) = plan.members
    execute(member.scene, member.directory)

    with (folder / "spring.py").open("a") as file:
        file.write("# changed\n")
    store = ResultStore(force=False, resume=True, timed=False)
    assert member.choose_mode(store) is None
    change(folder / "spring.py")
    anew = sweep(from_yaml(SPRING, folder), ["stiffness=2"], folder / "sweep")
    (member,) = anew.members
    assert member.choose_mode(store) == "resume"
    with pytest.raises(DustError, match="spring.py differs"):
        execute(member.scene, member.directory, resume=True)


# -- which files the command imports -------------------------------------------------------------


MARKED = "open('ran', 'w').close()\n"


@pytest.fixture
def placed_scene(tmp_path, monkeypatch):
    """A scene whose extension is beside it, in it by a link, or elsewhere: its text of `path`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "near.py").write_text(MARKED + f"# {tmp_path}\n")
    (tmp_path / "far.py").write_text(MARKED + f"# {tmp_path}, far\n")
    (tmp_path / "scene" / "link.py").symlink_to(tmp_path / "far.py")

    def check(name, *words):
        text = f"name: a\nextensions: [{name}]\nmaterial: silicate_s12\nstop: {{steps: 1}}\n"
        text += "sample: {kind: chain, grains: 3}\nboundary: {kind: open}\n"
        (tmp_path / "scene" / "a.yaml").write_text(text)
        result = invoke("check", "scene/a.yaml", *words)
        return result.exception, (tmp_path / "ran").exists()

    return check


@pytest.mark.parametrize("name", ("../far.py", "link.py"))
def test_code_from_outside_of_the_folder_is_asked_for(placed_scene, name):
    error, ran = placed_scene(name)
    assert isinstance(error, DustError) and not ran
    assert "(line 2)" in str(error) and "allow it with --extensions" in str(error)
    assert placed_scene(name, "--extensions") == (None, True)


def test_code_in_the_folder_is_imported_unless_none_is(placed_scene):
    error, ran = placed_scene("near.py", "--no-extensions")
    assert isinstance(error, DustError) and not ran and "--no-extensions" in str(error)
    assert placed_scene("near.py") == (None, True)


@pytest.mark.parametrize("answer", (True, False))
def test_the_question_at_a_terminal(placed_scene, monkeypatch, answer):
    questions = []
    monkeypatch.setattr(
        options, "sys", SimpleNamespace(stdin=_Terminal, stderr=_Terminal, argv=["dust"])
    )
    monkeypatch.setattr(
        options.typer, "confirm", lambda text, err: questions.append(text) or answer
    )
    error, ran = placed_scene("../far.py")
    assert ran is answer and len(questions) == 1 and "far.py is outside" in questions[0]


class _Terminal:
    @staticmethod
    def isatty():
        return True
