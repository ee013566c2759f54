"""Names in the pages are those of the code; public docstrings are in NumPy's layout."""

import ast
import importlib
import inspect
import re
import sys
import threading
from pathlib import Path

import pytest
from compilers import taichi_alone
from sources import import_from_docs

from dusttaichi import analysis
from dusttaichi.compute.compiled import Structures
from dusttaichi.compute.engine import ti
from dusttaichi.errors import DustError
from dusttaichi.grains import build, compiled_grains
from dusttaichi.grains.grain_engine import GrainEngine
from dusttaichi.grains.kernels.contact_numbers import numbers_type
from dusttaichi.running import execute
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
        structures = Structures()  # nothing serves again uncalled
        for module in (build, compiled_grains):
            patch.setattr(module, "STRUCTURES", structures)
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
        return all(hasattr(GrainEngine, name) for name in members)
    if inspect.isclass(value):
        own = [f for f in vars(value).values() if inspect.isfunction(inspect.unwrap(f))]
        there = any(issubclass(kind, value) for kind in kinds)
        return there or any(is_passed(f, codes, files, kinds) for f in own)
    value = inspect.unwrap(value)
    return getattr(getattr(value, "func", value), "__code__", None) in codes


@taichi_alone
@pytest.mark.parametrize("page", ["walk_number.md"])
def test_the_walks_name_the_code_that_the_data_pass(page, passed):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    names = sorted(set(re.findall(r"`(dusttaichi(?:\.\w+)+)`", text)))
    assert not [name for name in names if not is_passed(found(name), *passed)]
    # the trace tells what is passed from what is not
    for name in ("continuum.particle_search.DustSearch", "analysis.thresholds.find_thresholds"):
        assert not is_passed(found(f"dusttaichi.{name}"), *passed), name


def test_every_room_is_in_the_tour():
    tour = (ROOT / "docs/developing.md").read_text(encoding="utf-8")
    picture = (ROOT / "docs/_static/subpackages.html").read_text(encoding="utf-8")
    rooms = {p.parent.name for p in (ROOT / "dusttaichi").glob("*/__init__.py")}
    for room in rooms:
        assert f"| `{room}` |" in tour and f"{room}/</text>" in picture, room


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
    drawing = any("apply_style" in ast.unparse(d) or "figure" in ast.unparse(d)
                  for d in function.decorator_list)  # returns a Figure  # fmt: skip
    silent = not drawing and "Returns" not in parts and function.returns is None
    if "Parameters" in parts and silent and returns_a_value(function):
        yield "a value that is returned needs an annotation, or a section Returns"


def public():
    """Functions and classes of the public subpackages, and of `simulate`, with their names."""
    for package, _ in import_from_docs("interface").PUBLIC:
        module = importlib.import_module(f"dusttaichi.{package}")
        for name in module.__all__:
            yield f"{package}.{name}", getattr(module, name)
    interface = importlib.import_module("dusttaichi.running.interface")
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
