"""Docstrings: NumPy's layout where the interface is public. Their first lines are ruff's and
test_style's."""

import ast
import importlib
import inspect
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "dusttaichi"
SECTIONS = ("Parameters", "Returns", "Attributes", "Raises", "Notes")  # in this order
SECTION = re.compile(rf"^({'|'.join(SECTIONS)})\n-+\n", re.MULTILINE)
# Raised errors and returned values that a text states outside of the sections for them.
UNTIDY = re.compile(r"\b(Raises [A-Z]\w+|Returns the|Returns a)\b")


def sections(text):
    """(text before the sections, {section: its text}) of a docstring in NumPy's layout."""
    before, *parts = SECTION.split(text)
    return before, dict(zip(parts[::2], parts[1::2], strict=True))


def entries(section):
    """Names that a section describes."""
    heads = re.findall(r"^(\S.*)$", section, re.MULTILINE)
    return [head.split(" : ")[0].lstrip("*") for head in heads]


def returns_a_value(function):
    """True for a function with a `return` of something else than None."""
    inner = [n for n in ast.walk(function) if isinstance(n, ast.FunctionDef) and n is not function]
    own = set(ast.walk(function)) - {node for one in inner for node in ast.walk(one)}
    found = (node.value for node in own if isinstance(node, ast.Return) and node.value is not None)
    return any(not (isinstance(v, ast.Constant) and v.value is None) for v in found)


def faults_of_layout(function, text):
    """Reasons why the docstring of a public function breaks NumPy's layout."""
    before, parts = sections(text)
    if list(parts) != [name for name in SECTIONS if name in parts]:
        yield f"the order of the sections must be {', '.join(SECTIONS)}"
    if untidy := UNTIDY.search(before):
        yield f"{untidy[0]!r} belongs into a section"
    if not isinstance(function, ast.FunctionDef):
        return
    a = function.args
    named = [arg.arg for arg in (*a.posonlyargs, *a.args, a.vararg, *a.kwonlyargs, a.kwarg) if arg]
    named = [name for name in named if name not in ("self", "cls")]
    if "Parameters" in parts and entries(parts["Parameters"]) != named:
        yield f"Parameters must be {', '.join(named)}"
    if "Parameters" not in parts and len(named) > 1:
        yield "several arguments need a section Parameters"
    drawing = any("styled" in ast.unparse(d) or "figure" in ast.unparse(d)
                  for d in function.decorator_list)  # returns a Figure  # fmt: skip
    silent = not drawing and "Returns" not in parts and function.returns is None
    if "Parameters" in parts and silent and returns_a_value(function):
        yield "a value that is returned needs an annotation, or a section Returns"


def public():
    """Functions and classes of the public subpackages, and of `simulate`, with their names."""
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        packages = [name for name, _ in importlib.import_module("interface").PUBLIC]
    finally:
        sys.path.remove(str(ROOT / "docs"))
    for package in packages:
        module = importlib.import_module(f"dusttaichi.{package}")
        for name in module.__all__:
            yield f"{package}.{name}", getattr(module, name)
    interface = importlib.import_module("dusttaichi.run.interface")
    yield from (("simulate", interface.simulate), ("Simulation", interface.Simulation))


def sources():
    """(name, file, syntax tree, docstring) of every public function and class."""
    for name, value in public():
        value = inspect.unwrap(value)
        if not (inspect.isfunction(value) or inspect.isclass(value)):
            continue
        file = Path(inspect.getsourcefile(value))
        if PACKAGE in file.parents:
            last = value.__qualname__.split(".")[0]
            tree = ast.parse(file.read_text(encoding="utf-8")).body
            node = next((n for n in tree if getattr(n, "name", "") == last), None)
            text = inspect.getdoc(value) if inspect.isfunction(value) else ast.get_docstring(node)
            yield name, file, node, text


def checked_nodes(node):
    """A function, or a class and its public methods."""
    yield node
    if isinstance(node, ast.ClassDef):
        functions = (n for n in node.body if isinstance(n, ast.FunctionDef))
        yield from (n for n in functions if not n.name.startswith("_"))


def test_the_public_interface_is_in_numpys_layout():
    found, seen = [], 0
    for name, file, node, whole in sources():
        assert whole, f"{name} has no docstring"
        for one in checked_nodes(node):
            seen += 1
            where = f"{file.relative_to(ROOT)}:{one.lineno}: {getattr(one, 'name', name)}"
            # a method may inherit that of its base class
            text = whole if one is node else ast.get_docstring(one)
            found += [f"{where}: {fault}" for fault in faults_of_layout(one, text)] if text else []
    assert seen > 300
    assert not found, "\n" + "\n".join(found)


GOOD = '''
def area(width, height):
    """Area of a rectangle [m^2].

    Parameters
    ----------
    width : float
        [m].
    height : float

    Returns
    -------
    float
    """
    return width * height
'''


@pytest.mark.parametrize(
    "old, new, fault",
    [
        ("", "", ""),
        ("    height : float\n", "", "Parameters must be width, height"),
        ("\n    Returns\n    -------\n    float\n", "", "a section Returns"),
        ("rectangle [m^2].\n", "rectangle [m^2].\n\n    Raises ValueError.\n", "into a section"),
    ],
)
def test_the_checks_find_what_is_wrong(old, new, fault):
    text = GOOD.replace(old, new, 1) if old else GOOD
    for annotated in (False, True):
        whole = text.replace("height):", "height) -> float:") if annotated else text
        function = ast.parse(whole).body[0]
        found = " ".join(faults_of_layout(function, ast.get_docstring(function)))
        # an annotation takes the place of the section Returns
        assert fault in found if fault and not (annotated and "Returns" in fault) else not found
