"""The registry of figures: what a row says, which figures there are, how all of a run are drawn."""

import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any

from dusttaichi import method
from dusttaichi.analysis.numbers import reason
from dusttaichi.errors import DustError
from dusttaichi.plots.draft import marked
from dusttaichi.plots.style import styled
from dusttaichi.results.shown import FIGURES

LAST = 1000.0


def in_common(does):
    """Those of several Runs that are drawn in one figure: all that it applies to, where two do."""

    def chosen(runs, others=()):
        able = [run for run in runs if does(run)]
        return able if len(able) > 1 else []

    return chosen


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of results: one row of the registry.

    name: of its file. title: in the report. draw: from a Run to a matplotlib Figure, where
    `together` is given from a list of Runs as well. applies: whether a Run alone has something for
    it. together: from several Runs, and the names of the figures of them so far, to those that are
    in one figure. optional: a DustError of `draw` says that there is nothing to show. place: in the
    order in which figures are shown.
    """

    name: str
    title: str
    draw: Callable[..., Any]
    applies: Callable[[Any], bool] = lambda run: True
    together: Callable[..., list] | None = None
    optional: bool = False
    place: float = 500.0

    def of(self, runs):
        """The matplotlib Figure of a Run or several, None where they turn out to have nothing to
        show."""
        try:
            return self.draw(runs)
        except DustError:
            if self.optional:
                return None
            raise


def figure(title, place=500, *, applies=None, name="", together=False, optional=False):
    """Decorates a function that draws: a row of the registry named as the function, or `name`.

    applies: by default to every Run, or where `together` is given to none alone. together: True for
    all Runs that it applies to; see Figure for the others.
    """
    if applies is None:
        applies = (lambda run: False) if together else (lambda run: True)

    def registered(function):
        drawn = styled(function)
        drawn.row = Figure(
            name=name or function.__name__,
            title=title,
            draw=drawn,
            applies=applies,
            together=in_common(applies) if together is True else together or None,
            optional=optional,
            place=place,
        )
        return drawn

    return registered


def register(row: Figure) -> None:
    """Add a Figure, or a function with one, to what this process draws of runs it applies to.

    A file that does so takes effect where it is among the `extensions` of a scene. Raises
    ValueError for the name of another figure.
    """
    row = getattr(row, "row", row)
    if any(known.name == row.name and known != row for known in figures()):
        raise ValueError(f"there is a figure {row.name}; another name is needed")
    FIGURES[row.name] = row


def figures(of: method.Method | None = None) -> list[Figure]:
    """The figures of runs of a method, without it of all methods, in their order."""
    methods = [of] if of is not None else [method.named(name) for name in method.METHODS]
    own = [getattr(row, "row", row) for one in methods for row in method.rows(one.figures)]
    return sorted([*_built_in(), *FIGURES.values(), *own], key=lambda row: row.place)


def drawn(run):
    """(Figure, what it draws or None, why it cannot or "") of every figure of a Run.

    Whatever is wrong with one, the others are drawn.
    """
    for row in figures(run.method):
        found, why = None, ""
        try:
            if row.applies(run):
                found = marked(row.of(run), run)
        except Exception as error:
            why = reason(error)
        if found is not None or why:
            yield row, found, why


def drawn_together(runs):
    """The same of the figures that show several Runs in one."""
    others = []
    for row in _of_all(runs):
        found, why = None, ""
        try:
            chosen = [] if row.together is None else row.together(runs, others)
            if chosen:
                found = row.of(chosen)
        except Exception as error:
            why = reason(error)
        if found is not None or why:
            others.append(row.name)
            yield row, found, why


def _of_all(runs):
    rows = {row.name: row for run in runs for row in figures(run.method)}
    return sorted(rows.values(), key=lambda row: row.place)


def in_package(name):
    """Functions of the modules of a package of figures that draw one, by their names."""
    modules = pkgutil.iter_modules(import_module(name).__path__)
    found = {}
    for one in modules:
        if not one.ispkg:
            own = vars(import_module(f"{name}.{one.name}"))
            found |= {key: thing for key, thing in own.items() if hasattr(thing, "row")}
    return found


@cache
def _built_in():
    return tuple(function.row for function in in_package("dusttaichi.plots").values())
