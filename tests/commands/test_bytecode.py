"""Bytecode in the folder of caches: damage is mended at the next start, and a variable."""

import os

import pytest
from program import invoke, python
from scenes import text_of

from dusttaichi.samples import formats


@pytest.fixture
def environment(tmp_path):
    """Variables under which the program keeps bytecode in a folder of caches of its own."""
    return os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "XDG_CACHE_HOME": str(tmp_path)}


def version(environment):
    process = python("-m", "dusttaichi", "--version", env=environment)
    assert process.returncode == 0 and "Traceback" not in process.stderr, process.stderr
    return process.stdout


@pytest.mark.parametrize("damage", ["cut", "flipped"])
def test_damaged_bytecode_is_written_again(environment, tmp_path, damage):
    folder = tmp_path / "dusttaichi" / "bytecode"
    environment = {k: v for k, v in environment.items() if k != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPYCACHEPREFIX"] = str(folder)
    first = version(environment)
    files = [*folder.rglob("commands/console.*.pyc"), *folder.rglob("typer/main.*.pyc")]
    assert len(files) == 2
    for file in files:
        raw = file.read_bytes()
        file.write_bytes(raw[: len(raw) // 2] if damage == "cut" else raw[:16] + b"\xff" + raw[17:])
    assert version(environment) == version(environment) == first


def test_a_variable_switches_it_off(environment, tmp_path):
    version(environment | {"DUST_BYTECODE": "off"})
    assert not (tmp_path / "dusttaichi" / "bytecode").exists()


def test_a_file_that_does_not_fit_into_the_memory(tmp_path, monkeypatch):
    (tmp_path / "a.csv").write_text("x,y,z\n0,0,0\n")
    path = tmp_path / "scene.yaml"
    path.write_text(text_of(sample="{kind: explicit, file: a.csv}"))

    def read(*_):
        raise MemoryError

    monkeypatch.setattr(formats, "read", read)
    result = invoke("check", path)
    assert "does not fit into the memory" in str(result.exception)
