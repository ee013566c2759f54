"""The figure of some Axes, its renderer and its layout, as types that matplotlib does not state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, cast

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import RendererAgg
    from matplotlib.figure import Figure, SubFigure

Which = Literal["x", "y"]  # axis of an Axes


def get_figure(axes: Axes) -> Figure:
    """Figure of an Axes; figures of legends have no parts (SubFigure)."""
    return cast("Figure", axes.figure)


def get_renderer(figure: Figure | SubFigure) -> RendererAgg:
    """Renderer of a Figure of `style.create_canvas`, by which texts have a size."""
    canvas: Any = figure.canvas  # a FigureCanvasAgg, whose methods have no types
    renderer: RendererAgg = canvas.get_renderer()
    return renderer


def lay_out(figure: Figure) -> None:
    """Compute the positions in a Figure, where it has a layout engine.

    Spines are left out: they lie on the edges of their Axes, as ticks point inwards, and take a
    fifth of the time.
    """
    engine = figure.get_layout_engine()
    if engine is None:
        return
    for axes in figure.axes:
        for spine in axes.spines.values():
            spine.set_in_layout(False)
    engine.execute(figure)
