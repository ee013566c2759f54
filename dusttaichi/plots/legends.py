"""Legends that hide no curve."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.patches import StepPatch
from numpy.typing import NDArray

from dusttaichi.plots.canvas import Which, get_figure, get_renderer, lay_out

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.legend import Legend
    from matplotlib.lines import Line2D
    from matplotlib.transforms import Bbox, BboxBase

    from dusttaichi.physics.geometry import Floats

_limits: WeakKeyDictionary[Axes, tuple[float, float]] = (
    WeakKeyDictionary()
)  # of the y axes that were lengthened for a legend


@dataclass
class WaitingLegend:
    """Legend inside an Axes that moves away from the curves once the figure is laid out."""

    axes: Axes
    inside: Legend
    texts: Sequence[str]
    options: dict[str, Any]  #: Keywords of matplotlib for another legend like it.

    def move_from_curves(self) -> None:
        """Move the legend out of the Axes of a figure that is laid out, if it hides a curve."""
        axes, figure = self.axes, get_figure(self.axes)
        box = self.inside.get_window_extent(get_renderer(figure))
        if not _hides_curve(box, axes):
            return
        self.inside.remove()
        if len(figure.axes) > 1:
            _lengthen(axes, box.height / axes.get_window_extent().height)
            axes.legend(loc="upper left", **self.options)
            return
        longest = max([len(text) for text in self.texts])
        columns = max(1, min(len(self.texts), int(figure.get_figwidth() * 13 / (longest + 8))))
        look = self.options | {"ncols": columns}
        below = figure.legend(loc="outside lower center", **look)
        tall = below.get_window_extent(get_renderer(figure)).height / figure.dpi
        figure.set_figheight(figure.get_figheight() + tall)  # the Axes keeps its size


_waiting: ContextVar[list[WaitingLegend] | None] = ContextVar("waiting", default=None)


@contextmanager
def gather_legends() -> Iterator[list[WaitingLegend]]:
    """Gather the legends of `draw_legend` in a list, each inside its Axes, within the context."""
    legends: list[WaitingLegend] = []
    token = _waiting.set(legends)
    try:
        yield legends
    finally:
        _waiting.reset(token)


def draw_legend(
    axes: Axes,
    handles: Sequence[Any] | None = None,
    labels: Sequence[str] | None = None,
    *,
    title: str | None = None,
    ncols: int = 1,
) -> None:
    """Draw the legend of an Axes: inside where it hides nothing; else below the figure.

    In a figure of several Axes above the curves, for which the y axis becomes longer. A function of
    `apply_style` decides this at its end, for all legends of the figure by one layout.
    """
    if handles is None or labels is None:
        handles, labels = axes.get_legend_handles_labels()
    if not handles:
        return
    options = {"handles": handles, "labels": labels, "title": title, "ncols": ncols}
    legend = WaitingLegend(axes, axes.legend(loc="best", **options), labels, options)
    waiting = _waiting.get()
    if waiting is None:
        move_legends([legend])
    else:
        waiting.append(legend)


def move_legends(legends: Sequence[WaitingLegend]) -> None:
    """Move legends away from the curves, also of several figures, with one layout of each."""
    for figure in dict.fromkeys(get_figure(legend.axes) for legend in legends):
        lay_out(figure)
    for legend in legends:
        legend.move_from_curves()


def _hides_curve(box: Bbox, axes: Axes) -> bool:
    """True if a box of the screen hides a part of a line, of steps or of an area of an Axes."""
    if any(is_within(box, _sample_line(line, axes)).any() for line in axes.lines):
        return True
    for patch in axes.patches:
        outline = patch.get_path().transformed(patch.get_transform())
        if isinstance(patch, StepPatch) and outline.intersects_bbox(box, filled=False):
            return True
    areas = (area for area in axes.collections if isinstance(area, PolyCollection))
    outlines = (
        path.transformed(area.get_transform()) for area in areas for path in area.get_paths()
    )
    return any(outline.intersects_bbox(box, filled=True) for outline in outlines)


def _lengthen(axes: Axes, empty_fraction: float) -> None:
    """Lengthen the y axis so that this fraction of an Axes, at its top, is empty."""
    empty_fraction = min(empty_fraction + 0.04, 0.6)
    _limits[axes] = axes.get_ylim()
    bottom, top = (axes.transAxes.transform((0.0, y))[1] for y in (0.0, 1.0))
    beyond = bottom + (top - bottom) / (1.0 - empty_fraction)
    axes.set_ylim(top=axes.transData.inverted().transform((0.0, beyond))[1])


def get_original_limits(axes: Axes, which: Which) -> tuple[float, float]:
    """Limits of the "x" or "y" axis of an Axes, before it was lengthened for a legend."""
    lengthened = which == "y" and axes in _limits
    if lengthened:
        return _limits[axes]
    return axes.get_xlim() if which == "x" else axes.get_ylim()


def _sample_line(line: Line2D, axes: Axes) -> Floats:
    """Points of the screen along the visible part of a line of an Axes."""
    points: Floats = line.get_transform().transform(np.asarray(line.get_xydata(), dtype=float))
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) > 1 and line.get_linestyle() not in ("None", "", " "):
        between = np.linspace(0.0, 1.0, 8)[:, None, None]
        points = (points[:-1] + between * np.diff(points, axis=0)).reshape(-1, 2)
    return points[is_within(axes.get_window_extent(), points)]


def is_within(box: BboxBase, points: Floats) -> NDArray[np.bool_]:
    """True for points (N, 2) of the screen in a box of it, (N,)."""
    points = np.reshape(points, (-1, 2))
    inside = (points >= box.min) & (points <= box.max)
    all_inside: NDArray[np.bool_] = np.all(inside, axis=1)
    return all_inside
