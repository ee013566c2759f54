"""Style of all figures: size, fonts, colours, units of the axes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.ticker import MaxNLocator

from dusttaichi.analysis.names import name_runs
from dusttaichi.analysis.texts import typeset as typeset
from dusttaichi.errors import DustError
from dusttaichi.plots.axes import finish_figure
from dusttaichi.plots.axes import name_stages as name_stages
from dusttaichi.plots.axes import set_few_ticks as set_few_ticks
from dusttaichi.plots.axes import set_logarithmic as set_logarithmic
from dusttaichi.plots.canvas import lay_out
from dusttaichi.plots.legends import draw_legend as draw_legend
from dusttaichi.plots.legends import gather_legends, move_legends
from dusttaichi.plots.legends import get_original_limits as get_original_limits
from dusttaichi.plots.legends import is_within as is_within
from dusttaichi.plots.notebook import ShownFigure
from dusttaichi.results.files import explain
from dusttaichi.results.outputs import MARK, check

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from numpy.typing import ArrayLike

    from dusttaichi.analysis.run import Run
    from dusttaichi.physics.geometry import Floats

P = ParamSpec("P")
T = TypeVar("T")
Look = dict[str, Any]  # colour, width and dashes of a line, as keywords of matplotlib

# Okabe and Ito: distinguishable with any colour vision
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, YELLOW, BLACK, GREY = "#56B4E9", "#CC79A7", "#F0E442", "#000000", "#8C8C8C"
RUN_COLOURS = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY)
RUN_DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (5, 1, 1, 1)), (0, (3, 1)), (0, (8, 2)))
DASHED, DOTTED, FINE = (0, (4, 2)), (0, (1, 2)), (0, (1, 1))
CHANNEL_COLOURS = {
    "forming": BLUE,
    "breaking": SKY,
    "damping": GREEN,
    "rolling": ORANGE,
    "sliding": RED,
    "twisting": PURPLE,
    "asperities": YELLOW,
    "compaction": BLUE,
    "tension": SKY,
    "shear": ORANGE,
    "viscosity": GREEN,
    "artificial": PURPLE,
    "grid": GREY,
}
_RC: dict[str, Any] = {
    "text.usetex": False,  # whatever a matplotlibrc says: LaTeX may be missing
    "font.size": 9,
    "axes.labelsize": 10,
    "legend.fontsize": 8,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.facecolor": "white",
    "legend.handlelength": 2.4,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.6,
    "figure.dpi": 200,
    "savefig.dpi": "figure",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
WIDTH = 5.2  # inches: the text width of a page
# by name: width [inches], and changes of _RC
STYLES: dict[str, tuple[float, dict[str, Any]]] = {
    "page": (WIDTH, {}),
    "column": (  # of a journal with two of them, 88 mm
        3.46,
        {"font.size": 7.5, "axes.labelsize": 8, "legend.fontsize": 6.5, "lines.linewidth": 1.2},
    ),
    "talk": (
        7.5,
        {"font.size": 15, "axes.labelsize": 17, "legend.fontsize": 13, "lines.linewidth": 2.8,
         "axes.linewidth": 1.4, "lines.markersize": 9, "figure.dpi": 160},
    ),
}  # fmt: skip
_style = ContextVar("style", default="page")


@contextmanager
def use_style(name: str) -> Iterator[None]:
    """Use another of STYLES for the figures of a context. Raises DustError for an unknown name."""
    if name not in STYLES:
        raise DustError(f"There is no style {name}; allowed: {', '.join(STYLES)}.")
    token = _style.set(name)
    try:
        yield
    finally:
        _style.reset(token)


def apply_style(function: Callable[P, T]) -> Callable[P, T]:
    """Draw with the settings of this module, not those of the user (decorator)."""

    @wraps(function)
    def draw_in_style(*args: P.args, **kwargs: P.kwargs) -> T:
        settings: Any = _RC | STYLES[_style.get()][1]  # matplotlib lists all keys as a type
        with rc_context(settings):
            with gather_legends() as legends:
                result = function(*args, **kwargs)
            if isinstance(result, ShownFigure):
                finish_figure(result, [row for row in legends if row.axes.figure is result])
            move_legends([row for row in legends if row.axes.figure is not result])
            return result

    return draw_in_style


def create_canvas(width: float, height: float, **options: Any) -> ShownFigure:
    """Create a Figure of that width and height without a display; options: as for matplotlib's."""
    figure = ShownFigure(figsize=(width, height), **options)
    FigureCanvasAgg(figure)
    return figure


def _create_empty(height: float) -> ShownFigure:
    width = STYLES[_style.get()][0]
    return create_canvas(width, height * width / WIDTH, layout="constrained")


def create_figure(
    height: float = 3.7, rows: int = 1, ratios: Sequence[float] | None = None, shared: bool = True
) -> tuple[ShownFigure, list[Axes]]:
    """Create a Figure with `rows` axes above each other that share the x axis: (figure, [axes]).

    shared: False where each has an x axis of its own. height [inches]: on a page; figures of other
    styles have its proportions.
    """
    figure = _create_empty(height)
    axes = figure.subplots(rows, 1, sharex=shared, squeeze=False, height_ratios=ratios)
    for panel in axes[:, 0]:  # so few that long numbers do not run together
        panel.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
    return figure, list(axes[:, 0])


def create_grid(
    panels: int, columns: int, height: float, shared: bool = False
) -> tuple[ShownFigure, list[Axes]]:
    """Create a Figure with `panels` axes in rows of `columns`: (figure, [axes]).

    height [inches]: of a row on a page. shared: whether the panels share both axes, of which only
    the outer ones are labelled.
    """
    columns = max(1, min(columns, panels))
    rows = -(-panels // columns)
    figure = _create_empty(rows * height)
    grid = figure.subplots(rows, columns, sharex=shared, sharey=shared, squeeze=False).ravel()
    for spare in grid[panels:]:
        spare.remove()
    for number, panel in enumerate(grid[:panels]):
        if shared:  # what is below may be missing in the last row
            panel.tick_params(labelbottom=number + columns >= panels)
    return figure, list(grid[:panels])


def choose_unit(largest: float, units: Sequence[tuple[float, str]]) -> tuple[float, str]:
    """(factor, unit) for values up to `largest`: the first of `units` (scale, name) that fits."""
    scale, name = next((unit for unit in units if largest >= unit[0]), units[-1])
    return 1.0 / scale, name


def label_runs(
    runs: Run | Sequence[Run], labels: Sequence[str] | None = None
) -> tuple[list[Run], list[str]]:
    """(runs, labels) as lists, for one Run or several; labels default to `name_runs`.

    More runs than fit into a legend are counted in it, not named. Raises DustError where labels do
    not match the runs.
    """
    runs = list(runs) if isinstance(runs, Sequence) else [runs]
    if labels is None and len(runs) > len(RUN_COLOURS):
        labels = [f"{len(runs)} runs"] + ["_"] * (len(runs) - 1)  # matplotlib leaves out "_"
    if labels is None:
        labels = [name.replace("$", r"\$") for name in name_runs(runs)]
    labels = list(labels)
    if len(labels) != len(runs):
        raise DustError(f"{len(runs)} runs need as many labels, not {len(labels)}.")
    return runs, labels


def draw_bands(
    x: ArrayLike, mean: ArrayLike, std: ArrayLike, axes: Axes, *, label: str, number: int = 0
) -> Line2D:
    """Draw a mean with a band of one standard deviation to either side.

    For an ensemble: its mean and standard deviation over the replicas.

    Parameters
    ----------
    x
        (points,), in the units of the axes, as mean and std.
    mean
        (points,); gaps where it is NaN.
    std
        (points,).
    axes : Axes
    label : str
    number : int
        Number of the run, which chooses the colour.

    Returns
    -------
    Line2D
        The line of the mean.
    """
    x, mean, std = (np.asarray(a, dtype=float) for a in (x, mean, std))
    (line,) = axes.plot(x, mean, label=label, **run_style(number))
    axes.fill_between(x, mean - std, mean + std, color=line.get_color(), alpha=0.2, linewidth=0)
    return line


_CREATOR = {".png": "Software", ".pdf": "Creator", ".svg": "Creator"}  # name in the metadata


@apply_style
def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure, creating its folder.

    Parameters
    ----------
    figure : Figure
    path : path

    Returns
    -------
    pathlib.Path
        The path.

    Raises
    ------
    DustError
        The file cannot be written, or another file exists.
    """
    suffix = Path(check(path)).suffix
    metadata = {_CREATOR[suffix]: MARK} if suffix in _CREATOR else None
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        with _laid_out(figure) if suffix == ".png" else nullcontext():
            figure.savefig(path, metadata=metadata)
    except (OSError, ValueError) as error:  # ValueError: such as an unknown format
        reason = explain(error, path) if isinstance(error, OSError) else error
        raise DustError(f"The figure cannot be written to {path}: {reason}.") from error
    return Path(path)


@contextmanager
def _laid_out(figure: Figure) -> Iterator[None]:
    """Lay a Figure out, which does not happen again within: savefig would draw all twice for it."""
    engine = figure.get_layout_engine()
    lay_out(figure)
    if engine is not None:
        figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)


def draw_records(axes: Axes, x: Floats, y: Floats, number: int = 0) -> None:
    """Draw the single records behind the averages of run `number`, small and faint."""
    colour = run_style(number)["color"]
    axes.plot(x, y, ".", markersize=2.5, color=colour, alpha=0.35, markeredgewidth=0)


def sample_gradient(count: int) -> Floats:
    """Colours of `count` curves in an order, from dark to light."""
    return colormaps["viridis"](np.linspace(0.0, 0.87, count))


LENGTHS = ((1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))
TIMES = ((1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
PRESSURES = ((1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))
ENERGIES = ((1e-3, "mJ"), (1e-6, "µJ"), (1e-9, "nJ"), (1e-12, "pJ"), (1e-15, "fJ"), (1e-18, "aJ"),
            (1e-21, "zJ"), (1e-24, "yJ"))  # fmt: skip


def line_look(color: Any, linewidth: float = 1.0, linestyle: Any = "-") -> Look:
    """Colour, width and dashes of a line, as keywords of matplotlib."""
    return {"color": color, "linewidth": linewidth, "linestyle": linestyle}


def law_style(number: int, linewidth: float = 1.0) -> Look:
    """Look of the line of law `number`: black, with its dashes."""
    return line_look(BLACK, linewidth, RUN_DASHES[number % len(RUN_DASHES)])


def run_styles(count: int) -> list[Look]:
    """Colours and dashes of `count` curves; a gradient if there are too few colours."""
    if count <= len(RUN_COLOURS):
        return [run_style(number) for number in range(count)]
    return [{"color": colour} for colour in sample_gradient(count)]


def run_style(number: int) -> Look:
    """Colour and dashes of the run with this number, so that print in grey works too."""
    colour = RUN_COLOURS[number % len(RUN_COLOURS)]
    return {"color": colour, "linestyle": RUN_DASHES[number % len(RUN_DASHES)]}
