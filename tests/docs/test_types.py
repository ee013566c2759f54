"""Types of the Python interface, for editors and type checkers."""

import ast
import importlib
from pathlib import Path

import pytest

import dusttaichi as dt

PACKAGE = Path(dt.__file__).parent
SCRIPT = """
from typing import Any

import dusttaichi as dt

reveal_type(dt.load("smoke"))
reveal_type(dt.from_yaml("name: a"))
reveal_type(dt.Scene.from_dict({}))
changes: dict[str, Any] = {"sample.seed": 2}  # a type checker takes int for all keywords else
reveal_type(dt.run("smoke", **changes))
reveal_type(dt.sweep("smoke", {"sample.seed": [1, 2, 3]}, jobs=2))
reveal_type(dt.collide("collide"))
reveal_type(dt.study("study.py", "smoke"))
reveal_type(dt.open_run("runs/smoke"))
reveal_type(dt.simulate(dt.load("smoke")))
dt.sweep(3)
dt.lod("smoke")
dt.scene.Sceen
"""
SCENE, DATASET = "dusttaichi.scene.scene.Scene", "xarray.core.dataset.Dataset"
RUN, SIMULATION = "dusttaichi.analysis.run.Run", "dusttaichi.running.interface.Simulation"
# subpackages and files with types for every function
STRICT = [
    "method",
    "scene",
    "domain",
    "results",
    "running",
    "analysis",
    "export",
    "samples",
    "plots",
    "report",
    "studies",
    "units.py",
    "errors.py",
]
# without types, and called by them: kernels and what they share with NumPy, figures, workers
UNTYPED = ["dusttaichi.physics.contact.constants", "dusttaichi.grains", "dusttaichi.compute",
           "ase", "distributed"]  # fmt: skip
TYPES = [SCENE, SCENE, SCENE, RUN, DATASET, DATASET, DATASET, RUN, SIMULATION]


@pytest.fixture(scope="module")
def checked(tmp_path_factory, pytestconfig):
    """Lines of mypy about the script, and those about the package, of one run over both.

    Libraries without types (yaml, scipy, netCDF4, taichi) may be called and derived from.
    """
    api = pytest.importorskip("mypy.api")
    folder = tmp_path_factory.mktemp("types")
    path = folder / "script.py"
    path.write_text(SCRIPT)
    # pytest's cache, if there is one, knows of unchanged files: seconds, not half a minute
    stored = getattr(pytestconfig, "cache", None)
    cache = folder / "mypy" if stored is None else stored.mkdir("mypy")
    options = ["--strict", "--follow-imports=silent", "--no-error-summary", "--cache-dir", cache]
    options += ["--disable-error-code=import-untyped", "--allow-subclassing-any"]
    options += [f"--untyped-calls-exclude={module}" for module in UNTYPED]
    paths = [path for pattern in STRICT for path in sorted(PACKAGE.glob(pattern))]
    output, errors, _ = api.run([*map(str, [*options, *paths, path])])
    assert not errors
    of_script, of_package = [], []
    for line in output.splitlines():
        (of_script if "script.py:" in line else of_package).append(line)
    return of_script, of_package


def test_a_script_has_types(checked):
    lines, _ = checked
    revealed = [line.split('"')[1] for line in lines if "Revealed type" in line]
    assert revealed == TYPES, lines
    wrong = [line for line in lines if ": error:" in line]
    assert len(wrong) == 3, lines
    for line, name in zip(wrong, ("sweep", "lod", "Sceen"), strict=True):
        assert f'"{name}"' in line


def test_subpackages_are_strictly_typed(checked):
    _, lines = checked
    assert not lines, "\n".join(lines)


def test_the_package_says_that_it_is_typed():
    assert (PACKAGE / "py.typed").exists()


@pytest.mark.parametrize("name", ["", ".scene", ".analysis", ".plots", ".samples", ".export"])
def test_every_public_name_exists(name):
    module = importlib.import_module(f"dusttaichi{name}")
    assert not [one for one in module.__all__ if not hasattr(module, one)]
    assert set(module.__all__) <= set(dir(module))


@pytest.mark.parametrize("name", ["analysis", "plots"])
def test_names_of_a_subpackage_are_listed(name):
    """A list in full, which type checkers read."""
    module = importlib.import_module(f"dusttaichi.{name}")
    names = {
        key
        for key, value in vars(module).items()
        if key[0] != "_" and getattr(value, "__module__", "").startswith(module.__name__)
    }
    assert names == set(module.__all__)


@pytest.mark.parametrize("name", ["", ".scene", ".plots"])
def test_names_for_type_checkers_are_those_of_the_program(name):
    module = importlib.import_module(f"dusttaichi{name}")
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    (block,) = [node for node in tree.body if isinstance(node, ast.If) and not node.orelse
                and ast.unparse(node.test) == "TYPE_CHECKING"]  # fmt: skip
    pairs = [(node.module, alias.name) for node in block.body for alias in node.names]
    for home, key in pairs:
        value = getattr(importlib.import_module(home), key)
        assert value is getattr(module, key) and key in module.__all__, key
    if name != ".plots":  # others are imported at once
        assert {key for _, key in pairs} == set(module.__all__) - {"__version__"}
