"""Layout for plotly.js of a matplotlib figure: positions, scales, labels and colours."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.colors import to_hex, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle
from matplotlib.text import Annotation
from matplotlib.ticker import FixedFormatter, FixedLocator, FuncFormatter

from dusttaichi.plots.canvas import Which
from dusttaichi.plots.style import get_original_limits
from dusttaichi.report.packing import Content

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

PER_POINT = 96.0 / 72.0 * 0.9
LINES_PER_POINT = 1.5  # pixels of the page between texts, of which a figure has a point
PER_INCH = 96.0  # pixels per inch of a figure, more for figures in columns


DIRECTIONS: tuple[tuple[Which, Which, int], ...] = (("x", "y", 0), ("y", "x", 1))
SIDES: tuple[tuple[Literal["left", "center"], float], ...] = (("left", 0.0), ("center", 0.5))


def make_layout(figure: Figure, axes: Sequence[Axes]) -> tuple[Content, list[str], float]:
    """Make (layout, ends, height) of a Figure with these Axes.

    ends: suffixes of the names of their axes, "" or "2" ...; height: pixels without the legend,
    whose height depends on the width of the page (source/figures.js).
    """
    figure.draw_without_rendering()  # determines limits, positions and ticks
    layout: Content = {
        "margin": {"l": 64, "r": 14, "t": 14, "b": 48},
        "font": {"size": 12},
        "hovermode": "closest",
        "legend": {"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom", "x": 0},
        "shapes": [],
        "annotations": [],
        "plot_bgcolor": "white",
    }
    boxes = np.array([a.get_position().extents for a in axes])  # x0, y0, x1, y1
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    relative_boxes = (boxes - np.tile(low, 2)) / np.tile(high - low, 2)
    ends = ["" if number == 0 else str(number + 1) for number in range(len(axes))]
    for panel, relative_box, end in zip(axes, relative_boxes.round(4).tolist(), ends, strict=True):
        for which, other_direction, start in DIRECTIONS:
            axis_layout = {"anchor": f"{other_direction}{end}", "domain": relative_box[start::2]}
            if end and getattr(panel, f"get_shared_{which}_axes")().joined(panel, axes[0]):
                axis_layout["matches"] = which
            layout[f"{which}axis{end}"] = _make_axis(panel, which) | axis_layout
        layout["shapes"] += _list_spans(panel, end)
        layout["annotations"] += _list_titles(panel, end)
    if any(a.get_title("left") or a.get_title() for a in axes):
        layout["margin"]["t"] = 34
    above = [note.get("yshift", 0.0) for note in layout["annotations"]]
    layout["margin"]["t"] = max(layout["margin"]["t"], 18 + round(max(above, default=-4)))
    layout["annotations"] += _list_common_labels(figure)
    across = len({round(x, 2) for x in relative_boxes[:, 0]})
    tall = figure.get_figheight() * PER_INCH * (1.6 if across > 1 else 1.0)
    return layout, ends, round(tall)


def _make_axis(axes: Axes, which: Which) -> Content:
    log = getattr(axes, f"get_{which}scale")() == "log"
    axis = getattr(axes, f"{which}axis")
    limits = [float(np.log10(v)) if log else float(v) for v in get_original_limits(axes, which)]
    tick_labels = axis.get_tick_params().get("labelbottom" if which == "x" else "labelleft", True)
    axis_layout: Content = {
        "title": {
            "text": convert_label(getattr(axes, f"get_{which}label")()),
            "font": {"size": 12},
            "standoff": 6,
        },
        "type": "log" if log else "linear",
        "range": limits,
        "showline": True,
        "mirror": True,
        "linecolor": "#444",
        "gridcolor": "#eceef1",
        "zeroline": False,
        "ticks": "inside",
        "exponentformat": "power",
        "showticklabels": bool(tick_labels),
    }
    if log and limits[1] - limits[0] > 2:
        axis_layout["dtick"] = 1
    # set_ticks with labels makes a function of them
    named = isinstance(axis.get_major_formatter(), (FixedFormatter, FuncFormatter))
    named &= isinstance(axis.get_major_locator(), FixedLocator)
    if named or (log and limits[1] - limits[0] <= 2):  # plotly.js would show a single digit
        ticks = [*axis.get_major_ticks(), *([] if named else axis.get_minor_ticks())]
        named_ticks = [tick for tick in ticks if tick.label1.get_text()]
        axis_layout["tickvals"] = [float(tick.get_loc()) for tick in named_ticks]
        axis_layout["ticktext"] = [convert_label(tick.label1.get_text()) for tick in named_ticks]
    return axis_layout


def make_stroke(line: Line2D | Patch, colour: Any = None) -> Content:
    """Make colour, width and dashes of a line for plotly.js; colour: instead of the line's."""
    pattern = getattr(line, "_unscaled_dash_pattern", (0, None))[1]
    return {
        "color": to_hex(line.get_color()) if isinstance(line, Line2D) else colour,
        "width": line.get_linewidth() * PER_POINT,
        "dash": "solid" if pattern is None else ",".join(f"{2.0 * p:g}px" for p in pattern),
    }


def _make_note(text: str, **position: Any) -> Content:
    return {"text": convert_label(text).replace("\n", "<br>"), "showarrow": False, **position}


def _list_titles(axes: Axes, end: str) -> list[Content]:
    """The title of an Axes and texts at its upper edge, such as the names of stages."""
    upper_edge: Content = {
        "xref": f"x{end} domain",
        "yref": f"y{end} domain",
        "yanchor": "bottom",
        "y": 1.0,
    }
    notes = []
    look: Content
    for side, x in SIDES:
        if axes.get_title(side):
            look = {"xanchor": side, "align": side, "font": {"size": 11}}
            notes.append(_make_note(axes.get_title(side), **upper_edge, **look, x=x))
    for text in axes.texts:
        if isinstance(text, Annotation) and text.xycoords == ("data", "axes fraction"):
            look = {
                "xanchor": text.get_horizontalalignment(),
                "font": {"size": 11, "color": "#444"},
            }
            look |= {"x": float(text.xy[0]), "yshift": text.get_position()[1] * LINES_PER_POINT}
            notes.append(_make_note(text.get_text(), **upper_edge | {"xref": f"x{end}"}, **look))
    return notes


def _list_common_labels(figure: Figure) -> list[Content]:
    """The common axis labels of a figure."""
    figure_frame, notes = {"xref": "paper", "yref": "paper"}, []
    if figure.get_supxlabel():
        below_figure = {"x": 0.5, "y": 0.0, "yshift": -30, "yanchor": "top"}
        notes.append(_make_note(figure.get_supxlabel(), **figure_frame, **below_figure))
    if figure.get_supylabel():
        left_of_figure = {"x": 0.0, "y": 0.5, "xshift": -44, "xanchor": "right", "textangle": -90}
        notes.append(_make_note(figure.get_supylabel(), **figure_frame, **left_of_figure))
    return notes


def _list_spans(axes: Axes, end: str) -> list[Content]:
    """Shapes that span the axes: axhline and axvline, axhspan and axvspan."""
    shapes = []
    for line in axes.lines:
        x, y = np.atleast_1d(line.get_xdata()), np.atleast_1d(line.get_ydata())
        shape = (
            _make_shape("line", (x.tolist(), y.tolist()), has_data_coordinates(line, axes), end)
            if len(x) == 2
            else None
        )
        if shape is not None:
            shapes.append(shape | {"line": make_stroke(line)} | _make_legend_entry(line))
    for patch in axes.patches:
        if isinstance(patch, (Rectangle, Polygon)):
            box = patch.get_path().get_extents(patch.get_patch_transform())
            ends = (box.x0, box.x1), (box.y0, box.y1)
            shape = _make_shape("rect", ends, has_data_coordinates(patch, axes), end)
            if shape is not None:
                fill = {
                    "fillcolor": format_colour(to_rgba(patch.get_facecolor())),
                    "line": {"width": 0},
                }
                shapes.append(shape | fill | {"layer": "below"} | _make_legend_entry(patch))
    return shapes


def _make_legend_entry(artist: Artist) -> Content:
    """The name of a shape in the legend."""
    name = get_legend_name(artist.get_label())
    return {"name": name, "showlegend": True} if name else {}


def get_legend_name(label: object) -> str:
    """Name of an artist with that label in the legend, "" where it has none."""
    label = str(label)
    return "" if label.startswith("_") else convert_label(label)


def has_data_coordinates(artist: Artist, axes: Axes) -> tuple[bool, bool]:
    """Test along x and y if an artist has data coordinates there: (bool, bool)."""
    along_x, along_y = artist.get_transform().contains_branch_seperately(axes.transData)
    return along_x, along_y


def _make_shape(
    shape_type: str, ends: Sequence[Sequence[float]], follows_data: tuple[bool, bool], end: str
) -> Content | None:
    """A shape that spans one direction, or None."""
    if follows_data[0] == follows_data[1]:
        return None
    axes = {"xref": f"x{end}", "yref": f"y{end} domain"}
    if follows_data[1]:
        axes = {"xref": f"x{end} domain", "yref": f"y{end}"}
    coordinates = zip(("x0", "x1", "y0", "y1"), (*ends[0], *ends[1]), strict=True)
    return {"type": shape_type, **axes, **{name: float(value) for name, value in coordinates}}


GREEK = {
    "phi": "φ", "Delta": "Δ", "delta": "δ", "mu": "µ", "gamma": "γ", "sigma": "σ", "xi": "ξ",
    "rho": "ρ", "eta": "η", "theta": "θ", "pi": "π", "alpha": "α", "beta": "β", "pm": "±",
    "propto": "∝", "times": "×", "cdot": "·", "leq": "≤", "geq": "≥", "approx": "≈", "sqrt": "√",
    "langle": "⟨", "rangle": "⟩", "infty": "∞", "varphi": "φ", "epsilon": "ε", "Sigma": "Σ",
    "sim": "∼", "lambda": "λ", "tau": "τ", "to": "→", "rightarrow": "→", "Phi": "Φ",
}  # fmt: skip


def convert_label(text: str) -> str:
    """Convert a label with formulas ($...$, for matplotlib) to HTML."""
    text = text.replace("<", "&lt;")
    return re.sub(r"\$([^$]*)\$", lambda match: _convert_formula(match[1]), text)


def _convert_formula(text: str) -> str:
    text = re.sub(r"\\(?:math[a-z]+|rm|text|left|right|!)\s?", "", text)
    text = re.sub(r"\\[,; ]", " ", text)
    text = re.sub(r"\\([A-Za-z]+)", lambda m: GREEK.get(m[1], m[1]), text)
    for mark, tag in (("_", "sub"), ("\\^", "sup")):
        text = re.sub(mark + r"\{([^{}]*)\}", rf"<{tag}>\1</{tag}>", text)
        text = re.sub(mark + r"(\w)", rf"<{tag}>\1</{tag}>", text)
    return re.sub(r" +", " ", text.replace("{", "").replace("}", "").replace("-", "−")).strip()


def format_colour(colour: Any) -> str:
    """Format a colour of matplotlib for CSS; "none" is transparent."""
    if isinstance(colour, str) and colour == "none":
        return "rgba(0,0,0,0)"
    r, g, b, a = to_rgba(colour)
    return f"rgba({255 * r:.0f},{255 * g:.0f},{255 * b:.0f},{a:.3g})"
