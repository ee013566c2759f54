"""Scenes that come with the program are found by name and written as files."""

import re
from pathlib import Path

import pytest
from program import invoked
from scenes import ROOT, extensions_forgotten

from dusttaichi import __version__
from dusttaichi.errors import DustError
from dusttaichi.scene import load, shipped


def dust(*words):
    result = invoked(*words)
    if isinstance(result.exception, DustError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def test_scene_is_found_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("smoke", "smoke.yaml", "configs/smoke.yaml"):
        assert load(name).name == "smoke"
    assert load("seizinger2012/dynamic_5ms").name == "seizinger2012_dynamic_5ms"


def test_own_file_comes_before_the_shipped_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = load("smoke").source.replace("name: smoke", "name: mine")
    Path("smoke").write_text(text)
    assert load("smoke").name == "mine"


def test_unknown_name_is_told_what_resembles_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DustError, match=r"no such file. Do you mean the bundled scene smoke"):
        load("smok")
    with pytest.raises(DustError, match=r"no scene omni_statik: do you mean omni_static"):
        dust("new", "omni_statik")


def test_every_shipped_scene_has_its_line():
    listed = dust("new")
    for name in shipped.names():
        about = shipped.about(shipped.folder() / f"{name}.yaml")
        assert name in listed and 10 < len(about) < 240, name


def test_new_writes_a_file_that_is_the_same_scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "wrote omni_static.yaml" in dust("new", "omni_static")
    assert load("omni_static.yaml") == load(ROOT / "configs/omni_static.yaml")
    schema = re.search(r"\$schema=(\S+)", Path("omni_static.yaml").read_text())[1]
    assert Path(schema.removeprefix("file://")).samefile(ROOT / "configs/scene.schema.json")
    with pytest.raises(DustError, match="exists; --force"):
        dust("new", "omni_static")
    dust("new", "omni_static", "--force")
    dust("new", "omni_static", "--output", "deep/er/mine.yaml")
    assert load("deep/er/mine.yaml").name == "omni_static"


def test_new_brings_the_extensions_along(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = (ROOT / "configs/reissl2024/spin_up.py").read_text()
    assert "wrote deep/spin_up.py" in dust("new", "reissl2024/spin_up", "-o", "deep/mine.yaml")
    assert Path("deep/spin_up.py").read_text() == own
    dust("new", "reissl2024/spin_up", "-o", "deep")  # the same file is no other one
    with extensions_forgotten():
        assert load("deep/mine.yaml") == load("deep/spin_up.yaml")
    Path("deep/spin_up.py").write_text("# changed\n")
    with pytest.raises(DustError, match="deep/spin_up.py exists; --force"):
        dust("new", "reissl2024/spin_up", "-o", "deep/other.yaml")
    assert not Path("deep/other.yaml").exists()


def test_citation_names_this_version():
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text()
