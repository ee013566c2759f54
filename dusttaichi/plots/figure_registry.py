"""The registry of figures: its rows, drawing all figures of a run, and pictures of snapshots."""

from __future__ import annotations

import inspect
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from dusttaichi import method
from dusttaichi.analysis.kind import explain_draft
from dusttaichi.analysis.numbers import reason, statistics
from dusttaichi.errors import DustError
from dusttaichi.method import attribute
from dusttaichi.plots.style import GREY, apply_style
from dusttaichi.results.shown import FIGURES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure as MplFigure

    from dusttaichi.analysis.numbers.number_registry import Statistics
    from dusttaichi.analysis.run import Run

P = ParamSpec("P")
DrawnFigure = TypeVar("DrawnFigure", bound="MplFigure | None")


def select_in_common(applies: Callable[[Run], bool]) -> Callable[..., list[Run]]:
    """Make the rule for a figure of several Runs: all to which it applies, if two or more."""

    def select_runs(runs: Sequence[Run], figure_names: Sequence[str] = ()) -> list[Run]:
        shown_runs = [run for run in runs if applies(run)]
        return shown_runs if len(shown_runs) > 1 else []

    return select_runs


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of results: one row of the registry."""

    name: str  #: Name of its file.
    title: str  #: Title in the report.
    #: Function from a Run, with `together` also from a list of Runs, to a matplotlib Figure.
    draw: Callable[..., MplFigure | None]
    #: Function that is True for a Run that the figure shows.
    applies: Callable[[Any], bool] = lambda run: True
    #: Function from several Runs, and the names of their figures so far, to those in one figure.
    together: Callable[..., list[Run]] | None = None
    optional: bool = False  #: True if a DustError of `draw` means that there is nothing to show.
    order: float = 500.0  #: Position in the order of figures.

    def draw_or_skip(self, runs: Run | Sequence[Run]) -> MplFigure | None:
        """Draw a run or several: a matplotlib Figure, or None if there is nothing to show."""
        try:
            return self.draw(runs)
        except DustError:
            if self.optional:
                return None
            raise


Drawn = tuple[Figure, "MplFigure | None", str]  # a row, what it drew, or why it could not
Row = TypeVar("Row")


def figure(
    title: str,
    order: float = 500,
    *,
    applies: Callable[[Run], bool] | None = None,
    name: str = "",
    together: bool | Callable[..., list[Run]] = False,
    optional: bool = False,
) -> Callable[[Callable[P, DrawnFigure]], Callable[P, DrawnFigure]]:
    """Register a drawing function as a figure (decorator).

    Parameters
    ----------
    title : str
        Title in the report.
    order : int
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

    def register_function(function: Callable[P, DrawnFigure]) -> Callable[P, DrawnFigure]:
        function.__doc__ = _document_labels(function)
        drawn = apply_style(function)
        drawn.__dict__["row"] = Figure(
            name=name or function.__name__,
            title=title,
            draw=drawn,
            applies=applies,
            together=select_in_common(applies) if together is True else together or None,
            optional=optional,
            order=order,
        )
        return drawn

    return register_function


LABELS = """runs : Run or list of Run
labels : list of str, optional
    One for each run. Default: their names.
"""


def _document_labels(function: Callable[..., object]) -> str:
    """Docstring of a drawing function with its parameters `runs` and `labels`, if it has them."""
    text, heading = inspect.cleandoc(function.__doc__ or ""), "Parameters\n----------\n"
    if not {"runs", "labels"} <= set(inspect.signature(function).parameters) or "labels :" in text:
        return text
    if heading in text:
        return text.replace(heading, heading + LABELS)
    summary, errors, following = text.partition("Raises\n------\n")
    return f"{summary.rstrip()}\n\n{heading}{LABELS}\n{errors}{following}"


def register(row: Figure) -> None:
    """Add a figure, or a function that has one, to those that this process draws.

    A file that calls it takes effect where it is among the `extensions` of a scene.

    Raises
    ------
    ValueError
        Another figure has the name.
    """
    row = getattr(row, "row", row)
    if any(figure.name == row.name and figure != row for figure in list_figures()):
        raise ValueError(f"there is a figure {row.name}; another name is needed")
    FIGURES.add(row.name, row)


def list_figures(of_method: method.Method | None = None) -> list[Figure]:
    """List the figures of runs of a method (default: of all methods) in order."""
    rows = method.list_rows("figures", of_method)
    method_rows = [getattr(row, "row", row) for row in rows]
    return sorted([*_find_built_in(), *FIGURES.values(), *method_rows], key=lambda row: row.order)


def mark_draft(figure: MplFigure | None, run: Run) -> MplFigure | None:
    """Mark a matplotlib Figure, which may be None, if the Run is a draft; return it."""
    text = explain_draft(run.scene)
    if figure is not None and text:
        text_style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 7, "color": GREY}
        figure.text(0.995, 0.005, text, **text_style)
    return figure


def draw_run(run: Run) -> Iterator[Drawn]:
    """Draw every figure of a run; an error of one does not affect the others.

    Returns
    -------
    iterator of tuple
        (Figure, drawing or None, error or "").
    """
    return _draw_rows(
        list_figures(run.method),
        lambda row: mark_draft(row.draw_or_skip(run), run) if row.applies(run) else None,
    )


def _draw_rows(
    rows: Iterable[Row], draw: Callable[[Row], MplFigure | None]
) -> Iterator[tuple[Row, MplFigure | None, str]]:
    for row in rows:
        try:
            drawing, problem = draw(row), ""
        except Exception as error:
            drawing, problem = None, reason(error)
        if drawing is not None or problem:
            yield row, drawing, problem


def draw_runs(runs: Sequence[Run]) -> Iterator[Drawn]:
    """Draw the figures of several runs together, as in `draw_run`."""
    rows = {row.name: row for run in runs for row in list_figures(run.method)}
    names: list[str] = []

    def draw(row: Figure) -> MplFigure | None:
        shown_runs = [] if row.together is None else row.together(runs, names)
        return row.draw_or_skip(shown_runs) if shown_runs else None

    for result in _draw_rows(sorted(rows.values(), key=lambda row: row.order), draw):
        names.append(result[0].name)
        yield result


def draw_statistics(data: xr.Dataset) -> Iterator[tuple[Statistics, MplFigure | None, str]]:
    """Draw the figures of the Statistics of a dataset of `analysis.gather`, as in `draw_run`."""
    return _draw_rows(statistics(), lambda row: row.draw(data))


def get_row(function: Callable[..., MplFigure | None]) -> Figure:
    """The row of a drawing function in the registry."""
    row: Figure = function.__dict__["row"]
    return row


def find_figures(name: str) -> dict[str, Callable[..., MplFigure | None]]:
    """Find the drawing functions in the modules of a package of figures, by their names."""
    modules = pkgutil.iter_modules(import_module(name).__path__)
    module_names = [f"{name}.{info.name}" for info in modules if not info.ispkg]
    members = [
        pair for module_name in module_names for pair in vars(import_module(module_name)).items()
    ]
    return {key: member for key, member in members if hasattr(member, "row")}


@cache
def _find_built_in() -> tuple[Figure, ...]:
    return tuple(get_row(function) for function in find_figures("dusttaichi.plots").values())


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


def picture_of(run: Run) -> Picture:
    """The Picture of the method of a Run. Raises DustError where it has none."""
    picture: Picture | None = attribute(run.method.picture)
    if picture is None:
        raise DustError(f"{run.path}: there are no pictures of method: {run.method.name}.")
    return picture
