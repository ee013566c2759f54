"""Bits do not depend on what surrounds a run: threads, terminal, locale, home, width, `TI_*`
variables, another user, others that compile the same kernels. Each is `dust run` in a process of
its own."""

import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from bits import assert_same_bits

ROOT = Path(__file__).parents[2]
SCENE = """
name: bits
material: silicate_s12
interaction: {rolling: on}
sample: {kind: bcca, grains: 256, seed: 2}
boundary: {kind: box, size: fit, wall_speed: 1 m/s}
stop: {steps: 60}
output: {series: {steps: 10}, snapshots: {steps: 20}}
"""
WAYS = {
    "a narrow terminal in another locale": {
        "terminal": True, "COLUMNS": "20", "LINES": "5", "LANG": "C", "LC_ALL": "C", "threads": "4",
    },
    "a read-only home and foreign TI_*": {
        "HOME": "home", "XDG_CACHE_HOME": "home/cache",
        "TI_ARCH": "vulkan", "TI_DEBUG": "1", "TI_DEFAULT_FP": "f32",
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With the scene and its result `whole`."""
    folder = tmp_path_factory.mktemp("around")
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "home").mkdir(mode=0o500)
    assert start(folder, "whole").wait() == 0
    return folder


def start(folder, name, *, threads="1", without=(), how=None, **environment):
    """The process of `dust run` into the folder of that name."""
    words = ["run", folder / "scene.yaml", "-o", folder / name, "--threads", threads]
    known = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    known = {key: value for key, value in known.items() if key not in without}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "cwd": folder}
    command = [sys.executable, "-m", "dusttaichi", *map(str, words)]
    return subprocess.Popen(command, env=known, **(pipes | (how or {})))


@pytest.mark.long
@pytest.mark.parametrize("name", WAYS)
def test_the_same_bits(name, folder):
    way, run = dict(WAYS[name]), name.replace(" ", "_").replace("*", "")
    if way.pop("terminal", False):
        ours, theirs = pty.openpty()
        how = {"stdout": theirs, "stderr": theirs, "stdin": theirs}
        process = start(folder, run, **way, how=how)
        os.close(theirs)
        said = all_of(ours)
    else:
        process = start(folder, run, **way)
        said = process.stdout.read()
    assert process.wait() == 0 and b"Traceback" not in said, said
    assert_same_bits(folder / "whole/result.nc", folder / run / "result.nc")


def all_of(terminal):
    said = b""
    while True:
        try:
            said += (chunk := os.read(terminal, 4096))
        except OSError:  # the other side is closed
            return said
        if not chunk:
            return said


@pytest.mark.very_long
def test_several_that_compile_into_a_new_cache_at_once(folder):
    cache = {"XDG_CACHE_HOME": str(folder / "new cache")}
    runs = {f"at_once_{n}": start(folder, f"at_once_{n}", **cache) for n in range(3)}
    for name, process in runs.items():
        said = process.communicate()[0]
        assert process.returncode == 0, said
        assert_same_bits(folder / "whole/result.nc", folder / name / "result.nc")


@pytest.mark.very_long
@pytest.mark.skipif(os.getuid() != 0, reason="only root can be somebody else")
def test_another_user_without_a_home(folder):
    """As in a container: a number without a name, no HOME, a directory of somebody else's."""
    place = Path("/tmp") / f"{folder.parent.name}_{folder.name}"  # others may enter
    shutil.copytree(folder, place, ignore=shutil.ignore_patterns("*at_once*", "new cache", "home"))
    place.chmod(0o755)
    who = {"user": 54321, "group": 54321, "extra_groups": [], "cwd": "/"}
    kept = {"without": ("HOME", "XDG_CACHE_HOME"), "how": who}
    try:
        for name in ("own", "foreign"):
            (place / name).mkdir()
        os.chown(place / "own", 54321, 54321)
        try:
            process = start(place, "own", **kept)
        except PermissionError:
            pytest.skip("another user may not run this Python")
        said = process.communicate()[0]
        assert process.returncode == 0, said
        assert_same_bits(folder / "whole/result.nc", place / "own/result.nc")
        process = start(place, "foreign", **kept)
        said = process.communicate()[0]
        assert process.returncode == 2 and b"permission" in said
    finally:
        shutil.rmtree(place)
