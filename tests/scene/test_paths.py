"""A path that begins with ~ is in the home folder, wherever a user writes it."""

import inspect
import shutil
from pathlib import Path

import pytest
import synthetic
from program import invoke
from scenes import CONFIGS, scene, text_of

from dusttaichi.analysis import open_run
from dusttaichi.commands import completion
from dusttaichi.commands.app import COMMANDS
from dusttaichi.commands.options import with_user_paths
from dusttaichi.continuum.scene import dusts
from dusttaichi.running import run_directory
from dusttaichi.running.interface import simulate
from dusttaichi.scene import from_yaml, load
from dusttaichi.scene.paths import user_path


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """The home folder of the test, which is not the current one."""
    folder, current = tmp_path / "home", tmp_path / "current"
    folder.mkdir()
    current.mkdir()
    monkeypatch.setenv("HOME", str(folder))
    monkeypatch.setenv("USERPROFILE", str(folder))
    monkeypatch.chdir(current)
    yield folder
    assert not list(current.iterdir())


def test_keys_of_the_yaml(home):
    assert scene(output="{directory: ~/runs}").output.directory == home / "runs"
    assert run_directory(scene().with_value("output.directory", "~/x")) == home / "x"
    (home / "a.csv").write_text("x,y,z\n0,0,0\n3e-6,0,0\n")
    (home / "law.py").write_text("VALUE = 1\n")
    text = text_of(sample="{kind: explicit, file: ~/a.csv}", extensions="[~/law.py]")
    read = from_yaml(text, "elsewhere", check_files=True)
    assert read.sample.file == home / "a.csv" and read.extensions == (home / "law.py",)
    assert "~" not in read.to_yaml()


def test_the_dust_of_a_continuum_from_a_file(home):
    (home / "dust.yaml").write_text("exponent: 4\n")
    assert dusts.read_dust("~/dust.yaml", "elsewhere") == {"exponent": 4}


def test_the_command_line(home):
    result = invoke("new", "omni_static", "--output=~/copy.yaml")
    assert result.exit_code == 0 and (home / "copy.yaml").exists(), result.output
    assert completion.complete_scenes("~/co") == ["~/copy.yaml"]
    assert invoke("check", "~/copy.yaml", "--scene").exit_code == 0
    synthetic.writer(home / "run" / "result.nc", 4).close()
    assert str(open_run("~/run").path.parent) == str(home / "run")
    result = invoke("compare", "~/run", "~/run/result.nc", "--json")
    assert result.exit_code == 0, result.output


def test_every_command_expands_its_paths(home):
    """Also those in lists; each is registered through `with_user_paths`."""

    def command(file: Path, *, runs: list[Path], word: str):
        return file, runs, word

    expanding = with_user_paths(command)
    assert expanding(Path("~/a"), runs=[Path("~/b"), Path("c")], word="~") == (
        home / "a",
        [home / "b", Path("c")],
        "~",
    )
    assert inspect.signature(expanding) == inspect.signature(command) and COMMANDS


def test_python(home):
    shutil.copy(CONFIGS / "omni_static.yaml", home / "mine.yaml")
    assert load("~/mine.yaml").path == home / "mine.yaml"
    with pytest.raises(RuntimeError, match="built"):
        simulate(scene(), Refused(), "~/sim")
    assert (home / "sim").is_dir()
    assert user_path("./~") == Path("~") and user_path("~nobody-of-this-name/x").name == "x"


class Refused:
    """A sample that fails as soon as it is used."""

    def __getattr__(self, name):
        raise RuntimeError("built")
