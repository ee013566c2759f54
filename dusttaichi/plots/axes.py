"""Axes of figures: ticks of logarithmic axes, labels that fit, names of stages."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, cast

import numpy as np
from matplotlib.ticker import (
    Locator,
    LogFormatterSciNotation,
    LogLocator,
    MaxNLocator,
    NullFormatter,
)

from dusttaichi.plots.canvas import get_figure, get_renderer, lay_out

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

    from dusttaichi.analysis.run import Run
    from dusttaichi.plots.legends import WaitingLegend

GREY = "#8C8C8C"
DECADES = 8  # largest number of labelled powers of ten
LEVELS = 3  # lines of names of stages above each other
GAP = 3.0  # between the start of a stage and its name [points]


class FewTicks(Locator):
    """Ticks of a logarithmic axis, as many as labels fit.

    Powers of ten over more than three decades; 1, 2 and 5 of each over less; 1 to 9 over less than
    one; where fewer than three of these are in view, round numbers at equal distances.
    """

    def __call__(self) -> Sequence[float]:
        axis = cast("Axis", self.axis)
        return self.tick_values(*axis.get_view_interval())

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        """Ticks between these limits, and the next ones beyond."""
        low, high = sorted((vmin, vmax))
        low = low if low > 0.0 else cast("Axis", self.axis).get_minpos()
        if not (np.isfinite([low, high]).all() and high > low):
            return []
        decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        if high > 1e3 * low:
            labelled = decades % -(-len(decades) // DECADES) == 0
            return [float(tick) for tick in 10.0 ** decades[labelled]]
        first = np.array([1, 2, 5]) if high > 7.0 * low else np.arange(1, 10)
        ticks = np.outer(10.0**decades, first).ravel()
        if np.sum((ticks >= low) & (ticks <= high)) >= 3:
            return [float(tick) for tick in ticks]
        even_ticks = MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
        return [float(tick) for tick in even_ticks if tick > 0.0]


def set_few_ticks(axis: Axis) -> None:
    """Label a logarithmic `axis` (axes.xaxis ...) by FewTicks: plain numbers, or powers of ten."""

    def label(value: float, _: object) -> str:
        low, high = sorted(axis.get_view_interval())
        if high > 1e3 * low:
            return f"$10^{{{np.log10(value):.0f}}}$"
        return f"{value:g}"

    axis.set_major_locator(FewTicks())
    axis.set_major_formatter(label)
    axis.set_minor_locator(LogLocator(subs=range(2, 10)))
    axis.set_minor_formatter(NullFormatter())


def set_logarithmic(axes: Axes, which: Literal["x", "y", "xy"] = "xy") -> None:
    """Make the x axis, the y axis or both of some Axes logarithmic, labelled by `set_few_ticks`."""
    axes.set(**{f"{name}scale": "log" for name in which})
    for name in which:
        set_few_ticks(getattr(axes, f"{name}axis"))


def finish_figure(figure: Figure, legends: Sequence[WaitingLegend] = ()) -> None:
    """Label logarithmic axes of a Figure by `set_few_ticks`, break long labels, move its legends.

    All by one layout, of the figure as it is drawn so far.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_formatter(), LogFormatterSciNotation) and (
                axis.get_scale() == "log"
            ):
                set_few_ticks(axis)
    long = _list_long_labels(figure)
    if long or legends:
        lay_out(figure)
    for label, height in [(label, axes.get_window_extent().height) for label, axes in long]:
        _break_label(label, height)
    common = getattr(figure, "_supylabel", None)
    if common is not None:
        _break_label(common, 0.95 * figure.bbox.height)
    for legend in legends:
        legend.move_from_curves()


def _list_long_labels(figure: Figure) -> list[tuple[Text, Axes]]:
    """(label, Axes) of the y axes whose labels may be longer than the axes."""
    renderer, height = get_renderer(figure), figure.bbox.height
    grids = [axes.get_gridspec() for axes in figure.axes if axes.get_subplotspec() is not None]
    rows = max((grid.nrows for grid in grids if grid is not None), default=1)
    labels = [(axes.yaxis.label, axes) for axes in figure.axes]
    return [(label, axes) for label, axes in labels
            if label.get_window_extent(renderer).height > 0.7 * height / rows]  # fmt: skip


def _break_label(label: Text, height: float) -> None:
    """Break a label beside an Axes, or a figure, of that height [pixels] that is longer."""
    length = label.get_window_extent().height
    label.set_text(break_text(label.get_text(), length / height))


def break_text(text: str, relative_length: float) -> str:
    """Break a text into lines that fit; not within formulas.

    relative_length: of the text, over the available length.
    """
    if relative_length <= 1.0 or "\n" in text:
        return text
    count = int(np.ceil(relative_length))
    words = re.findall(r"(?:\$[^$]*\$|[^\s$])+", text)
    lines, letters_per_line = [""], _count_letters(text) / count
    for word in words:
        full = (
            lines[-1]
            and _count_letters(lines[-1]) + _count_letters(word) / 2 > letters_per_line
            and len(lines) < count
        )
        lines[-1:] = [lines[-1], word] if full else [f"{lines[-1]} {word}".strip()]
    return "\n".join(lines)


def _count_letters(text: str) -> int:
    """Count the letters of a text, with formulas as they are shown."""
    return len(re.sub(r"\\[A-Za-z]+", "x", re.sub(r"[${}^_]", "", text)))


def name_stages(axes: Axes, run: Run, per_time: float) -> None:
    """Mark the starts of the stages of a Run, and label them above the axes, on up to three lines.

    per_time: factor from s to the unit of the time axis. The longest stages come first; a name that
    fits on no line is left out.
    """
    if len(run.stages) < 2:
        return
    starts = [float(segment.start.time) * per_time for segment in run.parts]
    for start in starts[1:]:
        axes.axvline(start, color=GREY, linewidth=0.9, linestyle=(0, (1, 2)))
    durations = np.diff([*starts, float(run.series.time[-1]) * per_time])
    lay_out(get_figure(axes))
    occupied_boxes: list[Bbox] = []
    for n in np.argsort(-durations, kind="stable"):
        name = run.stages[int(run.parts[n].series.stage[-1])]
        for level in range(LEVELS):
            if _name_stage(axes, name, starts[n], level, occupied_boxes):
                break


def _name_stage(
    axes: Axes, name: str, start: float, level: float, occupied_boxes: list[Bbox]
) -> bool:
    """Write a name to one side of the start of its stage, if it fits; return whether it does."""
    renderer = get_renderer(axes.figure)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        text = axes.annotate(
            name, (start, 1.0), (sign * GAP, GAP), ha=side,
            xycoords=("data", "axes fraction"), textcoords="offset points",
            fontsize="small", color="#444444", annotation_clip=False,
        )  # fmt: skip
        size = float(text.get_fontsize())
        text.set_position((sign * GAP, GAP + 1.25 * level * size))
        box = text.get_window_extent(renderer).padded(2)
        inside = axes.bbox.x0 - 1 <= box.x0 and box.x1 <= axes.bbox.x1 + 2 * box.height
        if inside and not any(box.overlaps(occupied) for occupied in occupied_boxes):
            occupied_boxes.append(box)
            return True
        text.remove()
    return False
