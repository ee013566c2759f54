"""The reference of the command line and of the Python interface, from the program itself."""

import importlib
import pkgutil
import textwrap
from pathlib import Path

import typer
from pydantic import BaseModel
from tables import cell, head, prose, row, text

from dusttaichi.commands.app import EXIT_CODES, app

# Subpackages in the order in which data pass through them: (package, in a line). The public ones
# name their interface in `__all__`; of the inner ones every module is shown.
PUBLIC = (
    ("scene", "Blocks of the YAML, quantities with units, checks."),
    ("samples", "Initial positions of the grains."),
    ("run", "One run of a scene, from the YAML to the result."),
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


# The command line.


def commands():
    """Every command with its arguments and options, as the command line states them."""
    lines = []
    for name, command in _commands(typer.main.get_command(app)):
        lines += [f"### dust {name}", "", prose(command.help or ""), ""]
        lines += ["```text", *_usage(name, command), "```", ""]
        options = [one for one in command.params if one.name != "help"]
        if options:
            lines += head("", "meaning", "default")
            for one in options:
                shown = ", ".join(f"`{word}`" for word in _words(one))
                default = one.default if isinstance(one.default, (int, float, str)) else ""
                default = "" if isinstance(default, bool) or default == "" else f"`{default}`"
                lines.append(row(shown, cell(getattr(one, "help", "") or ""), default))
            lines.append("")
    return text(lines)


def exit_codes():
    """The table of exit codes."""
    rows = [row(str(code), cell(what)) for code, what in EXIT_CODES]
    return text([*head("exit code", "what has happened"), *rows])


def _commands(group, prefix=""):
    """(full name, command) of every command, groups of commands opened."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, f"{prefix}{name} ")
        elif not command.hidden:
            yield prefix + name, command


def _words(option):
    """How an option or argument is written."""
    if option.param_type_name == "argument":
        return [option.metavar or option.name.upper()]
    takes = "" if getattr(option, "is_flag", False) else f" {option.metavar or _kind(option)}"
    return [word + takes for word in [*option.opts, *option.secondary_opts]]


def _kind(option):
    """Type of an option, in a word; typer keeps the type in one of two places."""
    if hasattr(option, "type_descriptor"):
        kind = option.type_descriptor.annotation
        return {Path: "PATH", int: "N", float: "NUMBER"}.get(kind, "TEXT")
    return {"integer": "N", "float": "NUMBER"}.get(option.type.name, option.type.name.upper())


def _usage(name, command):
    """A command with its arguments and options, in lines that a page can hold."""
    words = []
    for one in command.params:
        if one.name == "help":
            continue
        word = _words(one)[0]
        word = word + " ..." if one.nargs == -1 or getattr(one, "multiple", False) else word
        words.append(word if one.required else f"[{word}]")
    start = f"dust {name} "
    line = " ".join(word.replace(" ", "\0") for word in words)  # an option stays with its value
    wrapped = textwrap.wrap(line, 84 - len(start), break_on_hyphens=False) or [""]
    wrapped = [part.replace("\0", " ") for part in wrapped]
    return [start + wrapped[0], *(" " * len(start) + part for part in wrapped[1:])]


# The Python interface.


def api_index():
    """The first page of the reference: the subpackages in two tables."""
    lines = ["# Python reference", ""]
    lines += [
        "The functions of everyday use, with examples, are in [the Python",
        "interface](../../python.md): `dt.load`, `dt.simulate`, `dt.open_run`. Numbers are in SI",
        "unless a docstring says otherwise.",
        "",
    ]
    for kind, packages in (("public subpackage", PUBLIC), ("inner subpackage", INNER)):
        lines += head(kind, "content")
        lines += [row(f"[`dusttaichi.{name}`]({name}.md)", line) for name, line in packages]
        lines += [""]
    lines += ["```{toctree}", ":hidden:", ""]
    return text([*lines, *(name for name, _ in PUBLIC + INNER), "```"])


def api_page(subpackage, line):
    """The page of a subpackage: the names that it exports, or each of its modules."""
    package = importlib.import_module(f"dusttaichi.{subpackage}")
    lines = [f"# dusttaichi.{subpackage}", ""]
    lines += [] if package.__doc__ else [line, ""]
    lines += [
        "```{eval-rst}",
        f".. automodule:: dusttaichi.{subpackage}",
        "   :no-members:",
        "```",
        "",
    ]
    exported = getattr(package, "__all__", [])
    if exported:
        lines += ["```{eval-rst}", f".. currentmodule:: dusttaichi.{subpackage}", ""]
        for name in sorted(exported, key=lambda name: (name[0].islower(), name)):
            lines += [_auto(subpackage, package, name), ""]
        lines += ["```", ""]
    else:
        for module in _modules(package):
            lines += [f"## {module.removeprefix('dusttaichi.')}", "", "```{eval-rst}"]
            lines += [f".. automodule:: {module}", "   :members:", "```", ""]
    return text(lines)


def _auto(subpackage, package, name):
    value = getattr(package, name)
    if isinstance(value, type):
        own = any(base.__module__.startswith("dusttaichi.") for base in value.__bases__)
        inherited = "\n   :inherited-members:" if own and not issubclass(value, BaseModel) else ""
        return f".. autoclass:: dusttaichi.{subpackage}.{name}\n   :members:{inherited}"
    if callable(value):
        return f".. autofunction:: dusttaichi.{subpackage}.{name}"
    return f".. autodata:: dusttaichi.{subpackage}.{name}\n   :no-value:"


def aliases():
    """Name -> link of every public class, for the types in docstrings."""
    links = {"Simulation": ":class:`~dusttaichi.run.interface.Simulation`"}
    for name, _ in PUBLIC:
        package = importlib.import_module(f"dusttaichi.{name}")
        classes = (one for one in package.__all__ if isinstance(getattr(package, one), type))
        links |= {one: f":class:`~dusttaichi.{name}.{one}`" for one in classes if one not in links}
    return links


def _modules(package):
    """Names of the modules below a package, those that only serve as __main__ left out."""
    found = pkgutil.walk_packages(package.__path__, package.__name__ + ".")
    return sorted(one.name for one in found if not one.ispkg)
