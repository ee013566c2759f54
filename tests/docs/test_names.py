"""Names of the code that stand in the pages are those of the code."""

import importlib
import inspect
import re
import sys
import threading
from pathlib import Path

import pytest
from compilers import taichi_alone

from dusttaichi import analysis
from dusttaichi.compute.compiled import Structures
from dusttaichi.compute.engine import ti
from dusttaichi.errors import DustError
from dusttaichi.grains import build
from dusttaichi.grains.kernels.numbers import numbers_type
from dusttaichi.grains.moving_grains import MovingGrains
from dusttaichi.run import execute
from dusttaichi.scene import load

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


SCENE = """
name: walk
material: silicate_s12
interaction: {rolling: {modifier: 8}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 1}
boundary: {kind: box, wall_speed: 5 cm/s}
stop: {steps: 20}
output: {series: {steps: 10}}
"""


@pytest.fixture(scope="module")
def passed(tmp_path_factory):
    """The code that data pass from a YAML file to a result: (code objects of what was called or
    compiled, source files that they are in)."""
    folder, codes = tmp_path_factory.mktemp("walk"), set()

    def note(frame, event, _):
        if event == "call":
            codes.add(frame.f_code)
            # what Taichi compiles is not called: its Func and Kernel are, which have the function
            if frame.f_code.co_filename == ti.lang.kernel_impl.__file__:
                codes.add(getattr(getattr(frame.f_locals.get("self"), "func", None), "__code__", 0))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "STRUCTURES", Structures())  # nothing serves again uncalled
        numbers_type.cache_clear()
        for run in (threading.setprofile, sys.setprofile):
            run(note)
        try:
            (folder / "scene.yaml").write_text(SCENE)
            scene = load(folder / "scene.yaml")
            execute(scene, folder / "run")
            with analysis.open_run(folder / "run") as result:
                assert result.series.pressure.shape[0] == 3
            (folder / "scene.yaml").write_text(SCENE.replace("modifier: 8", "modifier: -8"))
            with pytest.raises(DustError):
                load(folder / "scene.yaml")
        finally:
            for run in (threading.setprofile, sys.setprofile):
                run(None)
    codes.discard(0)
    # blocks of a scene are filled by pydantic, which calls nothing of theirs
    blocks = [block for block in vars(scene).values() if hasattr(block, "__dict__")]
    kinds = {type(value) for block in blocks for value in (block, *vars(block).values())}
    return codes, {Path(code.co_filename) for code in codes}, kinds


def is_passed(value, codes, files, kinds):
    """Whether a function was called or compiled, a method of a class, or anything of a module; or
    the scene has a block of a class."""
    if inspect.ismodule(value):
        own = [f for f in vars(value).values() if getattr(f, "__module__", "") == value.__name__]
        functions = [f for f in own if inspect.isfunction(f)]
        return Path(value.__file__) in files or not functions  # of a table there is nothing to call
    if getattr(value, "_is_protocol", False):
        members = [n for n, f in vars(value).items() if inspect.isfunction(f) and n[0] != "_"]
        return all(hasattr(MovingGrains, name) for name in members)
    if inspect.isclass(value):
        own = [f for f in vars(value).values() if inspect.isfunction(inspect.unwrap(f))]
        there = any(issubclass(kind, value) for kind in kinds)
        return there or any(is_passed(f, codes, files, kinds) for f in own)
    value = inspect.unwrap(value)
    return getattr(getattr(value, "func", value), "__code__", None) in codes


@taichi_alone
@pytest.mark.parametrize("page", ["walk_number.md", "walk_force.md"])
def test_the_walks_name_the_code_that_the_data_pass(page, passed):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    names = sorted(set(re.findall(r"`(dusttaichi(?:\.\w+)+)`", text)))
    assert not [name for name in names if not is_passed(found(name), *passed)]
    # the trace tells what is passed from what is not
    for name in ("continuum.search.Search", "analysis.thresholds.thresholds"):
        assert not is_passed(found(f"dusttaichi.{name}"), *passed), name


def test_every_room_is_in_the_tour():
    tour = (ROOT / "docs/developing.md").read_text(encoding="utf-8")
    rooms = {p.parent.name for p in (ROOT / "dusttaichi").glob("*/__init__.py")}
    for room in rooms:
        assert f"| `{room}` |" in tour and f"{room}/</text>" in tour, room
