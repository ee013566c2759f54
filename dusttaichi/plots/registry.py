"""The registry of figures: its rows, drawing all figures of a run, and pictures of snapshots."""

import inspect
import pkgutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any

from dusttaichi import method
from dusttaichi.analysis.kind import draft_of
from dusttaichi.analysis.numbers import reason, statistics
from dusttaichi.errors import DustError
from dusttaichi.method import attribute
from dusttaichi.plots.style import GREY, styled
from dusttaichi.results.shown import FIGURES


def in_common(does):
    """Rule for a figure of several Runs: all to which it applies, if two or more."""

    def chosen(runs, others=()):
        able = [run for run in runs if does(run)]
        return able if len(able) > 1 else []

    return chosen


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of results: one row of the registry."""

    name: str  #: Name of its file.
    title: str  #: Title in the report.
    #: Function from a Run, with `together` also from a list of Runs, to a matplotlib Figure.
    draw: Callable[..., Any]
    #: Function that is True for a Run that the figure shows.
    applies: Callable[[Any], bool] = lambda run: True
    #: Function from several Runs, and the names of their figures so far, to those in one figure.
    together: Callable[..., list] | None = None
    optional: bool = False  #: True if a DustError of `draw` means that there is nothing to show.
    place: float = 500.0  #: Position in the order of figures.

    def of(self, runs):
        """The matplotlib Figure of a run or several, or None if there is nothing to show."""
        try:
            return self.draw(runs)
        except DustError:
            if self.optional:
                return None
            raise


def figure(title, place=500, *, applies=None, name="", together=False, optional=False):
    """Register a drawing function as a figure (decorator).

    Parameters
    ----------
    title : str
        Title in the report.
    place : int
        Position in the order of figures.
    applies : function, optional
        True for a Run that the figure shows. Default: every Run, with `together` no single one.
    name : str
        Name of the file. Default: that of the function.
    together : bool or function
        True: all Runs to which it applies in one figure; see Figure. The docstring of a function
        of `runs` and `labels` gets their description.
    optional : bool
        A DustError of the function means that there is nothing to show.

    Returns
    -------
    function
        The decorator.
    """
    if applies is None:
        applies = (lambda run: False) if together else (lambda run: True)

    def registered(function):
        function.__doc__ = _with_labels(function)
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


LABELS = """runs : Run or list of Run
labels : list of str, optional
    One for each run. Default: their names.
"""


def _with_labels(function):
    """Docstring of a drawing function with its parameters `runs` and `labels`, if it has them."""
    text, heading = inspect.cleandoc(function.__doc__ or ""), "Parameters\n----------\n"
    if not {"runs", "labels"} <= set(inspect.signature(function).parameters) or "labels :" in text:
        return text
    if heading in text:
        return text.replace(heading, heading + LABELS)
    before, errors, after = text.partition("Raises\n------\n")
    return f"{before.rstrip()}\n\n{heading}{LABELS}\n{errors}{after}"


def register(row: Figure) -> None:
    """Add a figure, or a function that has one, to those that this process draws.

    A file that calls it takes effect where it is among the `extensions` of a scene.

    Raises
    ------
    ValueError
        Another figure has the name.
    """
    row = getattr(row, "row", row)
    if any(known.name == row.name and known != row for known in figures()):
        raise ValueError(f"there is a figure {row.name}; another name is needed")
    FIGURES[row.name] = row


def figures(of: method.Method | None = None) -> list[Figure]:
    """The figures of runs of a method (default: of all methods) in order."""
    methods = [of] if of is not None else [method.named(name) for name in method.METHODS]
    own = [getattr(row, "row", row) for one in methods for row in method.rows(one.figures)]
    return sorted([*_built_in(), *FIGURES.values(), *own], key=lambda row: row.place)


def marked(figure, run):
    """A matplotlib Figure, or None, with a mark if the Run is a draft."""
    text = draft_of(run.scene)
    if figure is not None and text:
        place = {"ha": "right", "va": "bottom", "fontsize": 7, "color": GREY}
        figure.text(0.995, 0.005, text, **place)
    return figure


def drawn(run):
    """Every figure of a run; an error of one does not affect the others.

    Returns
    -------
    iterator of tuple
        (Figure, drawing or None, error or "").
    """
    return _drawn(
        figures(run.method), lambda row: marked(row.of(run), run) if row.applies(run) else None
    )


def _drawn(rows, draw):
    for row in rows:
        try:
            drawing, why = draw(row), ""
        except Exception as error:
            drawing, why = None, reason(error)
        if drawing is not None or why:
            yield row, drawing, why


def drawn_together(runs):
    """Figures of several runs together, as in `drawn`."""
    rows, names = {row.name: row for run in runs for row in figures(run.method)}, []

    def draw(row):
        chosen = [] if row.together is None else row.together(runs, names)
        return row.of(chosen) if chosen else None

    for found in _drawn(sorted(rows.values(), key=lambda row: row.place), draw):
        names.append(found[0].name)
        yield found


def drawn_statistics(data):
    """Figures of the Statistics of a dataset of `analysis.gather`, as in `drawn`."""
    return _drawn(statistics(), lambda row: row.draw(data))


def in_package(name):
    """Drawing functions of the modules of a package of figures, by their names."""
    modules = pkgutil.iter_modules(import_module(name).__path__)
    names = [f"{name}.{one.name}" for one in modules if not one.ispkg]
    members = [pair for module in names for pair in vars(import_module(module)).items()]
    return {key: thing for key, thing in members if hasattr(thing, "row")}


@cache
def _built_in():
    return tuple(function.row for function in in_package("dusttaichi.plots").values())


@dataclass(frozen=True)
class Picture:
    """Pictures of the snapshots of a method.

    name: of its files. draw(run, snapshot, color, view, dpi=...): the Figure of one snapshot.
    film(run, color, view, cell=..., dpi=...): the Figures of all, with the same colours and frame.
    color None: the default.
    """

    name: str
    draw: Callable[..., Any]
    film: Callable[..., Iterator[Any]]


def picture_of(run) -> Picture:
    """The Picture of the method of a Run. Raises DustError where it has none."""
    found = attribute(run.method.picture)
    if found is None:
        raise DustError(f"{run.path}: there are no pictures of method: {run.method.name}.")
    return found
