"""The reference of the command line and of the Python interface, from the program itself."""

import importlib
import pkgutil

import typer
import typer.cli
from tables import markdown

from dusttaichi.commands.app import EXIT_CODES, app

# Subpackages in the order in which data pass through them: (package, in a line). The public ones
# name their interface in `__all__`; of the inner ones every module is shown.
PUBLIC = (
    ("scene", "Blocks of the YAML, quantities with units, checks."),
    ("samples", "Initial positions of the grains."),
    ("running", "One run of a scene, from the YAML to the result."),
    ("results", "The result file."),
    ("analysis", "Numbers derived from results; reads result files only."),
    ("plots", "Figures of results; they compute nothing."),
    ("export", "Snapshots in the formats of other programs."),
    ("method", "The protocol of a method, for a method of your own."),
)
INNER = (
    ("physics", "Laws on plain numbers, without fields: one file for each effect."),
    ("domain", "Walls, periodic cell and pushes, and their motion."),
    ("compute", "Taichi for every method: start, memory, workers, scans."),
    ("grains", "The method of single grains: build, step, search, measure."),
    ("studies", "Many runs: ensembles, sweeps, the trade, the extremes, sticking."),
)
INDEX = """# Python reference

The functions of everyday use, with examples, are in [the Python interface](../../python.md):
`dt.load`, `dt.simulate`, `dt.open_run`. Numbers are in SI unless a docstring says otherwise.
"""
AUTOMODULE = """```{{eval-rst}}
.. automodule:: {}
   :{}:
```
"""


def commands():
    """Every command with its arguments and options, as the command line states them."""
    texts = []
    for name, command in typer.main.get_command(app).commands.items():
        words, context = f"dust {name}", typer.Context(command)
        texts.append(
            typer.cli.get_docs_for_click(
                obj=command, ctx=context, indent=2, name=words, title=words
            )
        )
    return "\n".join(texts)


def exit_codes():
    """The table of exit codes."""
    return markdown(
        {"exit code": f"{code}", "what has happened": meaning} for code, meaning in EXIT_CODES
    )


def api_index():
    """The first page of the reference: the subpackages in two tables."""
    texts = [INDEX]
    for heading, packages in (("public subpackage", PUBLIC), ("inner subpackage", INNER)):
        rows = ({heading: f"[`dusttaichi.{n}`]({n}.md)", "content": line} for n, line in packages)
        texts.append(markdown(rows))
    names = "\n".join(name for name, _ in PUBLIC + INNER)
    return "\n".join([*texts, f"```{{toctree}}\n:hidden:\n\n{names}\n```\n"])


def api_page(subpackage, line):
    """The page of a subpackage: the names that it exports, or each of its modules."""
    package = importlib.import_module(f"dusttaichi.{subpackage}")
    texts = [f"# {package.__name__}\n", *([] if package.__doc__ else [f"{line}\n"])]
    if hasattr(package, "__all__"):
        which = "members:\n   :inherited-members" if subpackage == "analysis" else "members"
        return "\n".join([*texts, AUTOMODULE.format(package.__name__, which)])
    texts.append(AUTOMODULE.format(package.__name__, "no-members"))
    modules = pkgutil.walk_packages(package.__path__, package.__name__ + ".")
    for module in sorted(info.name for info in modules if not info.ispkg):
        title = module.removeprefix("dusttaichi.")
        texts += [f"## {title}\n", AUTOMODULE.format(module, "members")]
    return "\n".join(texts)


def aliases():
    """Name -> link of every public class, for the types in docstrings."""
    links = {"Simulation": ":class:`~dusttaichi.running.interface.Simulation`"}
    for name, _ in PUBLIC:
        package = importlib.import_module(f"dusttaichi.{name}")
        classes = (
            class_name
            for class_name in package.__all__
            if isinstance(getattr(package, class_name), type)
        )
        links |= {
            class_name: f":class:`~dusttaichi.{name}.{class_name}`"
            for class_name in classes
            if class_name not in links
        }
    return links
