"""The plan of the house, held against the code: sizes, and which room knows of which."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "dusttaichi"
FILES = sorted(PACKAGE.rglob("*.py"))
LINES, FUNCTION, POSITIONAL, TOP = 350, 60, 5, 8

# A room may import from the rooms named, from itself, and from the modules of the top level.
SHARED = {"errors", "units", "geometry", "names", "files"}
MAY_KNOW = {
    "physics": set(),
    "scene": {"samples", "physics", "method", "results"},
    "samples": {"scene", "physics", "results"},
    "domain": {"scene", "physics"},
    "compute": set(),
    "grains": {"scene", "samples", "physics", "domain", "results", "method", "compute"},
    "continuum": {"scene", "samples", "physics", "domain", "results", "method", "compute"},
    "results": set(),
    "run": {"scene", "domain", "results", "method", "samples"},
    "analysis": {"scene", "physics", "results"},
    "plots": {"analysis", "physics", "results"},
    "report": {"analysis", "plots", "physics", "results", "scene"},
    "export": {"analysis", "results", "physics"},
    "studies": {"scene", "samples", "physics", "domain", "grains", "run", "results", "analysis",
                "plots", "method", "compute"},
}  # fmt: skip


def _name(path):
    return path.relative_to(PACKAGE).as_posix()


@cache
def _trees():
    return [(path, ast.parse(path.read_text(encoding="utf-8"))) for path in FILES]


def _imports(tree):
    """Dotted names below the package that a module imports, wherever in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "dusttaichi":
            below = node.module.split(".")[1:]
            for alias in node.names:
                yield [*below, alias.name]


def test_the_top_level_is_small():
    assert len(list(PACKAGE.glob("*.py"))) <= TOP


def test_no_file_is_long():
    long = {_name(p): n for p in FILES if (n := len(p.read_text().splitlines())) > LINES}
    assert not long


def _excused(node, lines):
    """A long function says why in a comment right above it: Taichi makes one of a kernel."""
    above = lines[min([d.lineno for d in node.decorator_list] + [node.lineno]) - 2].strip()
    return above.startswith("# one function:")


def test_no_function_is_long():
    long = {}
    for path, tree in _trees():
        lines = path.read_text().splitlines()
        for node in ast.walk(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                size = node.end_lineno - node.lineno + 1
                if size > FUNCTION and not _excused(node, lines):
                    long[f"{_name(path)}:{node.name}"] = size
    assert not long


def _is_taichi(node):
    """True for what Taichi compiles: its functions take no arguments by keyword."""
    names = {ast.unparse(d) for d in node.decorator_list}
    return bool(names & {"ti.func", "ti.kernel"})


def test_few_arguments_by_position():
    many = {}
    for path, tree in _trees():
        for node in ast.walk(tree):
            if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) or _is_taichi(node):
                continue
            names = [a.arg for a in (*node.args.posonlyargs, *node.args.args)]
            names = names[1:] if names[:1] in (["self"], ["cls"]) else names
            if len(names) > POSITIONAL:
                many[f"{_name(path)}:{node.name}"] = len(names)
    assert not many


@pytest.mark.parametrize("room", MAY_KNOW)
def test_rooms_know_only_what_they_may(room):
    allowed = SHARED | MAY_KNOW[room] | {room, "__version__"}
    wrong = [
        f"{_name(path)}: {'.'.join(found)}"
        for path, tree in _trees()
        if path.relative_to(PACKAGE).parts[0] == room
        for found in _imports(tree)
        if found[0] not in allowed
    ]
    assert not wrong


def test_rooms_without_taichi():
    """Nothing that reads, plots or writes results, or makes samples, waits for Taichi."""
    rooms = ["scene", "samples", "results", "analysis", "plots", "export"]
    code = (
        "import importlib, sys\n"
        f"for room in {rooms}:\n"
        "    importlib.import_module(f'dusttaichi.{room}')\n"
        "    assert 'taichi' not in sys.modules, room\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_physics_touches_no_fields():
    for path in (PACKAGE / "physics").rglob("*.py"):
        assert "ti.field" not in path.read_text() and "fields[" not in path.read_text(), path


def test_methods_are_told_apart_in_one_place():
    """No `if method ==` but where a method is looked up by its name."""
    for path, tree in _trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.Compare) and "method" in ast.unparse(node.left).split("."):
                compared = [c for c in node.comparators if isinstance(c, ast.Constant)]
                assert not any(isinstance(c.value, str) for c in compared), _name(path)
