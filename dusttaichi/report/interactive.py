"""Interactive figures: matplotlib figures of dusttaichi.plots converted to plotly.js.

Every figure of `dust plot` thus has zoom, values under the pointer and switchable curves without
further code. A figure of pictures remains a picture.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_hex, to_rgba, to_rgba_array
from matplotlib.container import BarContainer, ErrorbarContainer

from dusttaichi.report.dark import darken
from dusttaichi.report.layout import (
    PER_POINT,
    convert_label,
    format_colour,
    get_legend_name,
    has_data_coordinates,
    make_layout,
    make_stroke,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.path import Path as MplPath
    from numpy.typing import ArrayLike

    from dusttaichi.report.packing import Content

PIXELS = 1160.0  # width of a picture that fills the page
WIDEST = 8.0  # largest width of a picture in a column [inches]
SHAPES = {"steps": "vh", "steps-pre": "vh", "steps-mid": "hvh", "steps-post": "hv"}
SYMBOLS = {"o": "circle", ".": "circle", "s": "square", "^": "triangle-up", "v": "triangle-down",
           "D": "diamond", "d": "diamond", "*": "star", "X": "x", "x": "x-thin", "+": "cross-thin",
           "P": "cross"}  # fmt: skip


def make_interactive(figure: Figure, name: str, title: str) -> Content:
    """Make a dict for the report: name, title, and `data` and `layout` of plotly.js, or an `image`.

    Beside an `image` is `image_dark`, for a dark page. figure: a matplotlib Figure, whose colours
    are then those of the latter.
    """
    axes = [a for a in figure.axes if a.has_data() and a.axison]
    if not axes or any(a.images for a in figure.axes):
        report_entry = {"name": name, "title": title, "wide": bool(figure.get_figwidth() > WIDEST)}
        light = render_picture(figure)
        darken(figure)
        return report_entry | {"image": light, "image_dark": render_picture(figure)}
    layout, ends, height = make_layout(figure, axes)
    data = [
        trace | {"xaxis": f"x{end}", "yaxis": f"y{end}"}
        for panel, end in zip(axes, ends, strict=True)
        for trace in _convert_axes(panel)
    ]
    names_in_legend = set()
    for trace in data:  # one legend entry for curves in several panels
        trace["showlegend"] &= trace["name"] not in names_in_legend
        names_in_legend.add(trace["name"])
    wide = len({round(a.get_position().x0, 2) for a in axes}) > 1
    size = {"height": height, "wide": wide}
    return {"name": name, "title": title, "data": data, "layout": layout} | size


def render_picture(figure: Figure) -> str:
    """Render a figure as the data URL of a PNG with the resolution of the page."""
    stream = io.BytesIO()
    dpi = min(max(PIXELS / figure.get_figwidth(), 130.0), 220.0)
    figure.savefig(stream, format="png", dpi=dpi)
    return f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"


def _convert_axes(axes: Axes) -> list[Content]:
    """Convert the lines, areas and scattered points of an Axes to traces of plotly.js."""
    label = _map_labels(axes)
    traces: list[Content | None] = []
    for area in axes.collections:
        if isinstance(area, PolyCollection) and len(area.get_paths()):
            traces += [
                _convert_area(path, area) for path in area.get_paths() if np.size(path.vertices)
            ]
        elif isinstance(area, PathCollection) and np.size(area.get_offsets()):
            traces.append(_convert_points(area))
        elif isinstance(area, LineCollection) and len(area.get_segments()):
            traces.append(_convert_segments(area, label(area)))
    for patch in axes.patches:
        if all(has_data_coordinates(patch, axes)):
            traces.append(_convert_patch(patch, label(patch)))
    for line in axes.lines:
        if all(has_data_coordinates(line, axes)):
            traces.append(_convert_line(line, label(line)))
    return [trace for trace in traces if trace is not None]


def _map_labels(axes: Axes) -> Callable[[Artist], object]:
    """Map artists to their labels (a function), also members of containers (bars, error bars).

    "_of LABEL" for the dependent parts of a container with that label.
    """
    labels_by_artist: dict[int, object] = {}
    for container in axes.containers:
        if isinstance(container, ErrorbarContainer):
            first, caps, bars = container.lines
            labels_by_artist |= {
                id(dependent): f"_of {container.get_label()}" for dependent in (*caps, *bars)
            }
            labels_by_artist[id(first)] = container.get_label()
        elif isinstance(container, BarContainer) and container.patches:
            labels_by_artist[id(container.patches[0])] = container.get_label()
    return lambda artist: labels_by_artist.get(id(artist), artist.get_label())


def _make_legend_entry(artist_label: object) -> Content:
    """Make name and group in the legend; dependent parts are switched with their container."""
    label, name = str(artist_label), get_legend_name(artist_label)
    group = convert_label(label.removeprefix("_of ")) if label.startswith("_of ") else name
    named: Content = {"name": name, "showlegend": bool(name)}
    named |= {"legendgroup": group} if group else {}
    return named | ({} if name else {"hoverinfo": "x+y"})


def _round_numbers(values: ArrayLike) -> list[float | None]:
    """Floats with five digits, or None."""
    values = np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in values]


def _convert_line(line: Line2D, label: object) -> Content | None:
    dashed, marker = line.get_linestyle(), line.get_marker()
    lines, marks = dashed not in ("None", "", " "), marker not in ("None", "", " ", None)
    if not (lines or marks) or not (np.size(line.get_xdata()) or _make_legend_entry(label)["name"]):
        return None
    trace: Content = {
        "type": "scatter",
        "mode": "+".join(["lines"] * lines + ["markers"] * marks),
        "x": _round_numbers(line.get_xdata()) or [None],  # a mere legend entry
        "y": _round_numbers(line.get_ydata()) or [None],
        "line": make_stroke(line) | {"shape": SHAPES.get(line.get_drawstyle(), "linear")},
        "opacity": line.get_alpha() or 1.0,
    }
    if marks:
        edge = line.get_markeredgewidth()
        trace["marker"] = {
            "symbol": SYMBOLS.get(str(marker), "circle"),
            "size": (line.get_markersize() * (0.5 if marker == "." else 1.0) + edge) * PER_POINT,
            "color": format_colour(line.get_markerfacecolor()),
            "line": {"color": format_colour(line.get_markeredgecolor()), "width": edge},
        }
    return trace | _make_legend_entry(label)


def _convert_area(path: MplPath, area: Collection) -> Content:
    x, y = np.asarray(path.vertices).T
    colours = area.get_facecolor()
    colour = colours[0] if len(colours) else (0, 0, 0, 0.1)
    shape = {"type": "scatter", "mode": "lines", "fill": "toself", "line": {"width": 0}}
    points = {
        "x": _round_numbers(x),
        "y": _round_numbers(y),
        "fillcolor": format_colour(colour),
        "hoverinfo": "skip",
    }
    return _make_legend_entry(area.get_label()) | shape | points


def _convert_patch(patch: Patch, label: object) -> Content | None:
    """Convert a bar, a step of a histogram or a polygon."""
    path = patch.get_path().transformed(patch.get_patch_transform())
    path.should_simplify = False  # else data units were taken for pixels
    rings = [r for r in map(np.asarray, path.to_polygons(closed_only=False)) if len(r) > 1]
    if not rings or not patch.get_visible():
        return None
    corners = np.concatenate([np.vstack([ring, [np.nan, np.nan]]) for ring in rings])
    fill = patch.get_fill() and to_rgba(patch.get_facecolor())[3] > 0
    line = make_stroke(patch, format_colour(patch.get_edgecolor()))
    outline = {"x": _round_numbers(corners[:, 0]), "y": _round_numbers(corners[:, 1]), "line": line}
    shape = {"fill": "toself", "fillcolor": format_colour(patch.get_facecolor())} if fill else {}
    return {"type": "scatter", "mode": "lines"} | outline | shape | _make_legend_entry(label)


def _convert_points(points: PathCollection) -> Content:
    x, y = np.asarray(points.get_offsets()).T
    colours = [format_colour(c) for c in points.get_facecolor()] or ["#444"]
    sizes = np.sqrt(np.asarray(points.get_sizes())) * PER_POINT
    marker = {
        "color": colours[0] if len(colours) == 1 else colours,
        "size": float(sizes[0]) if len(sizes) == 1 else [float(s) for s in sizes],
    }
    points_trace = {
        "type": "scatter",
        "mode": "markers",
        "x": _round_numbers(x),
        "y": _round_numbers(y),
    }
    return points_trace | {"marker": marker} | _make_legend_entry(points.get_label())


def _convert_segments(lines: LineCollection, label: object) -> Content:
    """Convert error bars and similar to one trace, with gaps between the segments."""
    rows = []
    for segment in lines.get_segments():
        rows += [*np.asarray(segment).tolist(), [np.nan, np.nan]]
    x, y = np.array(rows, dtype=float).T
    colours, widths = to_rgba_array(lines.get_color()), lines.get_linewidth()
    style = {"color": to_hex(colours[0]), "width": float(np.ravel(widths)[0]) * PER_POINT}
    trace = {
        "type": "scatter",
        "mode": "lines",
        "x": _round_numbers(x),
        "y": _round_numbers(y),
        "line": style,
    }
    return trace | _make_legend_entry(label)
