"""The plan of the house, held against the code: sizes, and which room knows of which."""

import ast
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy
from program import python
from sources import list_nodes

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "dusttaichi"
FILES = sorted(PACKAGE.rglob("*.py"))
# have the same sizes
BESIDE = sorted(path for of in ("benchmarks", "configs") for path in (ROOT / of).rglob("*.py"))
LINES, FUNCTION, POSITIONAL, TOP = 350, 60, 5, 4

# The rooms from the roof down, and those that each imports, all of which are below it; a name with
# a dot is one module of a room. An import that goes is struck from the table, which holds what is
# reached; a new one asks whether what it wants is in the right room.
IMPORTS = {
    "__main__": "commands",
    "benchmarks": "commands studies running grains samples method scene results physics compute "
    "units errors",
    "configs": "studies plots analysis physics.laws errors",
    "commands": "studies export report continuum plots analysis running scene results compute "
    "errors",
    "studies": "plots grains running analysis samples method scene results physics compute errors",
    "export": "plots.grain_picture analysis samples.formats results units errors",
    "report": "plots analysis results errors",
    "continuum": "plots analysis samples method domain scene results physics particles compute "
    "errors",
    "plots": "analysis method results physics errors",
    "running": "method domain scene results compute errors",
    "grains": "samples method domain scene results physics particles compute units errors",
    "analysis": "method scene results physics errors",
    "samples": "scene results physics errors",
    "scene": "method physics compute.compiler errors",
    "method": "domain results physics.registry units",
    "results": "physics compute errors",
    "domain": "physics units errors",
    "physics": "compute.engine",
    "__init__": "compute",
    "particles": "compute",
    "compute": "errors",
    "units": "",
    "errors": "",
}
MOST = 109  # imports of a room by another: fewer are easier to keep in mind


def _name(path):
    return path.relative_to(ROOT).as_posix().removeprefix("dusttaichi/")


def _sources(beside=False):
    """(path, nodes) of each file."""
    return [(path, list_nodes(path)) for path in (FILES + BESIDE if beside else FILES)]


def _lazy_names(nodes):
    """Nodes of the imports for type checkers of a package that imports its names on first use."""
    if not any(getattr(node, "name", "") == "__getattr__" for node in nodes):
        return set()
    top_level = nodes[0].body
    blocks = [n for n in top_level if isinstance(n, ast.If) and _last(n.test) == "TYPE_CHECKING"]
    return {node for block in blocks for node in block.body}


@cache
def _imports(path):
    """Dotted names below the package that a module imports, wherever in it."""
    nodes, names = list_nodes(path), []
    lazy = _lazy_names(nodes)
    for node in nodes:
        if not isinstance(node, ast.ImportFrom) or node in lazy:
            continue
        first, *below = (node.module or "").split(".")
        if first == "dusttaichi":
            names += [(*below, alias.name) for alias in node.names]
    return names


def test_the_top_level_is_small():
    assert len(list(PACKAGE.glob("*.py"))) <= TOP


def _of_any_size(path):
    """Kernel files may be long, and their functions: Taichi makes one of a kernel."""
    return path.parent.name == "kernels"


def test_no_file_is_long():
    files = [path for path in FILES + BESIDE if not _of_any_size(path)]
    long = {_name(p): n for p in files if (n := len(p.read_text().splitlines())) > LINES}
    assert not long


def _docstring_lines(node):
    first = node.body[0]
    return first.end_lineno - first.lineno + 1 if ast.get_docstring(node) else 0


def test_no_function_is_long():
    long = {}
    for path, nodes in _sources(beside=True):
        for node in nodes:
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                size = node.end_lineno - node.lineno + 1 - _docstring_lines(node)
                if size > FUNCTION and not _of_any_size(path):
                    long[f"{_name(path)}:{node.name}"] = size
    assert not long


def _is_taichi(node):
    """True for what Taichi compiles: its functions take no arguments by keyword."""
    names = {ast.unparse(d) for d in node.decorator_list}
    return bool(names & {"ti.func", "ti.kernel"})


def test_few_arguments_by_position():
    faults = {}
    for path, nodes in _sources(beside=True):
        for node in nodes:
            if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) or _is_taichi(node):
                continue
            names = [a.arg for a in (*node.args.posonlyargs, *node.args.args)]
            names = names[1:] if names[:1] in (["self"], ["cls"]) else names
            if len(names) > POSITIONAL:
                faults[f"{_name(path)}:{node.name}"] = len(names)
    assert not faults


def _room(path):
    names = path.relative_to(PACKAGE if path.is_relative_to(PACKAGE) else ROOT).parts
    return names[0].removesuffix(".py")


@pytest.mark.parametrize("room", IMPORTS)
def test_rooms_import_what_the_plan_says(room):
    faults = {}
    for path in FILES + BESIDE:
        for parts in _imports(path) if _room(path) == room else ():
            first = parts[0] if parts[0] in IMPORTS else "__init__"
            faults.setdefault(first, []).append((".".join(parts[:2]), _name(path)))
    faults.pop(room, None)
    planned = {name.partition(".")[0]: name for name in IMPORTS[room].split()}
    wrong = [
        f"{name}: {module}"
        for of, names in faults.items()
        for module, name in names
        if planned.get(of) not in (of, module)
    ]
    assert not wrong
    assert not planned.keys() - faults.keys(), "no longer imported: strike it from the plan"


def test_imports_go_down_and_are_few():
    rooms = list(IMPORTS)
    pairs = [(a, b.partition(".")[0]) for a, named in IMPORTS.items() for b in named.split()]
    assert all(rooms.index(a) < rooms.index(b) for a, b in pairs)
    assert len(pairs) <= MOST
    assert {_room(path) for path in FILES + BESIDE} == set(rooms)


@cache
def _file(names):
    """The file of a module, or of the one that a name is imported from."""
    for n in range(len(names), 0, -1):
        path = PACKAGE.joinpath(*names[:n])
        for file in (path.with_suffix(".py"), path / "__init__.py"):
            if file.is_file():
                return file
    return PACKAGE / "__init__.py"


def test_modules_do_not_import_each_other_in_a_circle():
    """Not even inside of functions, or for their annotations alone."""
    order = {path: n for n, path in enumerate(FILES)}
    edges = [(n, order[_file(i)]) for n, path in enumerate(FILES) for i in _imports(path)]
    edges = np.array([(a, b) for a, b in edges if a != b])
    graph = scipy.sparse.coo_matrix((np.ones(len(edges)), edges.T), (len(FILES),) * 2)
    _, label = scipy.sparse.csgraph.connected_components(graph, connection="strong")
    circles = [
        [_name(FILES[n]) for n in np.flatnonzero(label == k)]
        for k in np.flatnonzero(np.bincount(label) > 1)
    ]
    assert not circles


def _modules(nodes):
    """Full names of the modules that a file imports, or imports from."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""


def test_the_compiler_is_imported_in_one_place():
    """So that its version is the matter of one file."""
    faults = {
        _name(path)
        for path, nodes in _sources()
        for module in _modules(nodes)
        if module.split(".")[0] in ("taichi", "quadrants")
    }
    text = (PACKAGE / "compute/engine.py").read_text(encoding="utf-8")
    assert not faults and text.count("import_module(compiler.name())") == 1


def test_rooms_without_taichi():
    """Nothing that reads, writes or plots results, makes samples or moves walls needs Taichi."""
    rooms = ["scene", "samples", "domain.domain", "results", "analysis", "plots", "export"]
    rooms += [f"continuum.{room}" for room in ("scene", "samples", "analysis", "plots")]
    code = (
        "import importlib, sys\n"
        f"for room in {rooms}:\n"
        "    importlib.import_module(f'dusttaichi.{room}')\n"
        "    assert not {'taichi', 'quadrants'} & set(sys.modules), room\n"
    )
    process = python("-c", code)
    assert process.returncode == 0, process.stderr


def test_python_is_started_in_one_place():
    """So that no process of the program imports what is in the current directory."""
    for path in FILES + BESIDE:
        assert "sys.executable" not in path.read_text() or _name(path) == "compute/processes.py", (
            path
        )


def test_units_are_converted_in_few_places():
    """What knows the factors of grains: they alone, and exports in LAMMPS's `units micro`."""
    knowing = {
        _name(path)
        for path in FILES
        for names in _imports(path)
        if names[0] == "units" and names[1:] not in (("SI",), ("Units",))
    }
    assert knowing and all(name.startswith(("grains/", "export/lammps")) for name in knowing)


def test_physics_touches_no_fields():
    for path in FILES:
        if "physics" not in path.relative_to(PACKAGE).parts:
            continue
        assert "ti.field" not in path.read_text() and "fields[" not in path.read_text(), path


# Rooms that must do for any method. The others are of one, or compare them (studies), or look one
# up by its name (scene).
NEUTRAL = {
    "running",
    "results",
    "commands",
    "compute",
    "particles",
    "domain",
    "analysis",
    "plots",
    "report",
    "export",
}
OWN_CLASSES = {"GrainsScene", "ContinuumScene", "GrainEngine", "DustEngine"}


def _of_methods(nodes):
    """What in a file does one thing for one method and another for another."""

    def is_method(node):
        return isinstance(node, (ast.Attribute, ast.Name)) and _last(node) == "method"

    for node in nodes:
        if isinstance(node, ast.Compare):
            sides = (node.left, *node.comparators)
            texts = [c for side in sides for c in ast.walk(side) if isinstance(c, ast.Constant)]
            if any(map(is_method, sides)) and any(isinstance(c.value, str) for c in texts):
                yield ast.unparse(node)
        elif isinstance(node, ast.Match) and is_method(node.subject):
            yield ast.unparse(node.subject)
        elif isinstance(node, ast.Subscript) and is_method(node.slice):
            if isinstance(node.value, ast.Dict):
                yield ast.unparse(node)
        elif isinstance(node, ast.Call) and _last(node.func) in ("isinstance", "issubclass"):
            if {_last(n) for n in ast.walk(node)} & OWN_CLASSES:
                yield ast.unparse(node)
        elif isinstance(node, ast.Call) and _last(node.func) in ("startswith", "endswith"):
            if is_method(node.func.value):
                yield ast.unparse(node)


def _last(node):
    return getattr(node, "attr", getattr(node, "id", None))


def test_methods_are_told_apart_in_one_place():
    """What a method does differently its Method says; nobody else asks which one it is."""
    faults = {
        _name(path): list(_of_methods(nodes))
        for path, nodes in _sources()
        if path.relative_to(PACKAGE).parts[0] in NEUTRAL | {"method"}
    }
    assert len(faults) > 50 and not {name: texts for name, texts in faults.items() if texts}


@pytest.mark.parametrize(
    "code, tells",
    [
        ("if scene.method == 'grains': pass", True),
        ("x = 1 if 'grains' == scene.method else 2", True),
        ("scene.method in ('grains', 'continuum')", True),
        ("method != 'grains'", True),
        ("match scene.method:\n case 'grains': pass", True),
        ("{'grains': 1, 'continuum': 2}[scene.method]", True),
        ("isinstance(scene, GrainsScene)", True),
        ("isinstance(sim, (int, engine.GrainEngine))", True),
        ("scene.method.startswith('gr')", True),
        ("speed.method == scene.method", False),
        ("method.find_method(scene).build(scene)", False),
        ("METHODS[scene.method]", False),
        ("isinstance(scene, Scene)", False),
    ],
)
def test_telling_methods_apart_is_found(code, tells):
    assert bool(list(_of_methods(ast.walk(ast.parse(code))))) == tells


def test_nobody_asks_for_the_continuum():
    """Its scene and its flag are named in its folder alone, also where methods are studied."""
    word = re.compile(r"\bis_continuum\b|\bContinuumScene\b")
    named = [_name(p) for p in FILES if word.search(p.read_text(encoding="utf-8"))]
    assert named and not [name for name in named if not name.startswith("continuum/")]


# A method whose folder has all of it: scene, samples, physics, kernels, analysis, figures. Its
# inner subpackages from the top down, each with those that it imports; "" is the engine.
TENANTS = {
    "continuum": {
        "": "samples scene kernels physics",
        "plots": "analysis physics",
        "analysis": "scene physics",
        "scene": "samples physics",
        "samples": "physics",
        "kernels": "physics",
        "physics": "",
    }
}


@pytest.mark.parametrize("tenant", TENANTS)
def test_a_method_is_in_its_folder(tenant):
    """Common subpackages do not import it: it could be a package installed beside this one."""
    importers = {_room(path) for path in FILES for i in _imports(path) if i[0] == tenant}
    assert importers <= {tenant, "commands"}  # `dust fit` fits its material


@pytest.mark.parametrize("tenant", TENANTS)
def test_imports_within_a_method_go_down(tenant):
    order = list(TENANTS[tenant])
    imports = {name: set() for name in order}
    for path in FILES:
        names = path.relative_to(PACKAGE).parts
        if names[0] == tenant:
            inner = names[1] if len(names) > 2 else ""
            imports[inner] |= {
                i[1] if i[1] in order else "" for i in _imports(path) if i[0] == tenant
            }
    assert {a: b - {a} for a, b in imports.items()} == {
        name: set(below.split()) for name, below in TENANTS[tenant].items()
    }
    for name, below in imports.items():
        assert all(order.index(name) <= order.index(lower) for lower in below)


# The two effects that were once written into half of the program: who names them, and why.
THEIR_OWN = {
    "asperities": {
        "physics/contact/asperities.py": "the effect",
        "physics/contact/effect_registry.py": "the list of effects",
        "physics/contact/effect_numbers.py": "its channel",
        "scene/interaction.py": "its block in the YAML",
        "scene/material.py": "its property of a material",
        "grains/checks.py": "what a scene with it needs",
        "plots/style.py": "the colour of its channel",
        "grains/grain_variants.py": "a switch of the trade study",
        "plots/pareto_front.py": "the colour of that switch",
    },
    "jkr": {
        "physics/contact/jkr.py": "the law",
        "analysis/frame.py": "normal forces of results that were written without forces",
        "physics/contact/effect_registry.py": "the list of laws",
        "scene/interaction.py": "the default of its key",
    },
}


@pytest.mark.parametrize("effect", THEIR_OWN)
def test_an_effect_is_named_in_few_files(effect):
    word = re.compile(rf"\b{effect}(_curve)?\b")
    named = {_name(p) for p in FILES if word.search(p.read_text(encoding="utf-8"))}
    assert named == set(THEIR_OWN[effect])
