"""Interactive figures: matplotlib figures of dusttaichi.plots converted to plotly.js.

Every figure of `dust plot` thus has zoom, values under the pointer and switchable curves without
further code. A figure of pictures remains a picture.
"""

import base64
import io

import numpy as np
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.container import ErrorbarContainer

from dusttaichi.report.dark import darken
from dusttaichi.report.layout import PER_POINT, css, html, in_data, layout_of, shown_name, stroke

PIXELS = 1160.0  # width of a picture that fills the page
WIDEST = 8.0  # largest width of a picture in a column [inches]
SHAPES = {"steps": "vh", "steps-pre": "vh", "steps-mid": "hvh", "steps-post": "hv"}
SYMBOLS = {"o": "circle", ".": "circle", "s": "square", "^": "triangle-up", "v": "triangle-down",
           "D": "diamond", "d": "diamond", "*": "star", "X": "x", "x": "x-thin", "+": "cross-thin",
           "P": "cross"}  # fmt: skip


def interactive(figure, name, title):
    """A dict for the report: name, title, and `data` and `layout` of plotly.js, or an `image`.

    Beside an `image` is `image_dark`, for a dark page. figure: a matplotlib Figure, whose colours
    are then those of the latter.
    """
    axes = [a for a in figure.axes if a.has_data() and a.axison]
    if not axes or any(a.images for a in figure.axes):
        shown = {"name": name, "title": title, "wide": bool(figure.get_figwidth() > WIDEST)}
        light = picture(figure)
        darken(figure)
        return shown | {"image": light, "image_dark": picture(figure)}
    layout, ends, height = layout_of(figure, axes)
    data = [
        trace | {"xaxis": f"x{end}", "yaxis": f"y{end}"}
        for one, end in zip(axes, ends, strict=True)
        for trace in _traces(one)
    ]
    seen = set()
    for trace in data:  # one legend entry for curves in several panels
        trace["showlegend"] &= trace["name"] not in seen
        seen.add(trace["name"])
    wide = len({round(a.get_position().x0, 2) for a in axes}) > 1
    size = {"height": height, "wide": wide}
    return {"name": name, "title": title, "data": data, "layout": layout} | size


def picture(figure):
    """The figure as a data URL of a PNG with the resolution of the page."""
    stream = io.BytesIO()
    dpi = min(max(PIXELS / figure.get_figwidth(), 130.0), 220.0)
    figure.savefig(stream, format="png", dpi=dpi)
    return f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"


def _traces(axes):
    """Lines, areas and scattered points of one Axes."""
    label, found = _labels(axes), []
    for area in axes.collections:
        if isinstance(area, PolyCollection) and len(area.get_paths()):
            found += [_area(path, area) for path in area.get_paths() if len(path.vertices)]
        elif isinstance(area, PathCollection) and len(area.get_offsets()):
            found.append(_scatter(area))
        elif isinstance(area, LineCollection) and len(area.get_segments()):
            found.append(_segments(area, label(area)))
    for patch in axes.patches:
        if all(in_data(patch, axes)):
            found.append(_patch(patch, label(patch)))
    for line in axes.lines:
        if all(in_data(line, axes)):
            found.append(_line(line, label(line)))
    return [trace for trace in found if trace is not None]


def _labels(axes):
    """Function from an artist to its label, also for members of containers (bars, error bars).

    "_of LABEL" for the dependent parts of a container with that label.
    """
    known = {}
    for container in axes.containers:
        if isinstance(container, ErrorbarContainer):
            first, caps, bars = container.lines
            known |= {id(part): f"_of {container.get_label()}" for part in (*caps, *bars)}
            known[id(first)] = container.get_label()
        elif getattr(container, "patches", None):
            known[id(container.patches[0])] = container.get_label()
    return lambda artist: known.get(id(artist), artist.get_label())


def _named(label):
    """Name and group in the legend; dependent parts are switched with their container."""
    label, name = str(label), shown_name(label)
    group = html(label.removeprefix("_of ")) if label.startswith("_of ") else name
    named = {"name": name, "showlegend": bool(name)}
    named |= {"legendgroup": group} if group else {}
    return named | ({} if name else {"hoverinfo": "x+y"})


def _numbers(values):
    """Floats with five digits, or None."""
    values = np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in values]


def _line(line, label):
    dashed, marker = line.get_linestyle(), line.get_marker()
    lines, marks = dashed not in ("None", "", " "), marker not in ("None", "", " ", None)
    if not (lines or marks) or not (len(line.get_xdata()) or _named(label)["name"]):
        return None
    trace = {
        "type": "scatter",
        "mode": "+".join(["lines"] * lines + ["markers"] * marks),
        "x": _numbers(line.get_xdata()) or [None],  # a mere legend entry
        "y": _numbers(line.get_ydata()) or [None],
        "line": stroke(line) | {"shape": SHAPES.get(line.get_drawstyle(), "linear")},
        "opacity": line.get_alpha() or 1.0,
    }
    if marks:
        edge = line.get_markeredgewidth()
        trace["marker"] = {
            "symbol": SYMBOLS.get(marker, "circle"),
            "size": (line.get_markersize() * (0.5 if marker == "." else 1.0) + edge) * PER_POINT,
            "color": css(line.get_markerfacecolor()),
            "line": {"color": css(line.get_markeredgecolor()), "width": edge},
        }
    return trace | _named(label)


def _area(path, area):
    x, y = path.vertices.T
    colours = area.get_facecolor()
    colour = colours[0] if len(colours) else (0, 0, 0, 0.1)
    shape = {"type": "scatter", "mode": "lines", "fill": "toself", "line": {"width": 0}}
    what = {"x": _numbers(x), "y": _numbers(y), "fillcolor": css(colour), "hoverinfo": "skip"}
    return _named(area.get_label()) | shape | what


def _patch(patch, label):
    """A bar, a step of a histogram, a polygon."""
    path = patch.get_path().transformed(patch.get_patch_transform())
    path.should_simplify = False  # else data units were taken for pixels
    rings = [r for r in path.to_polygons(closed_only=False) if len(r) > 1]
    if not rings or not patch.get_visible():
        return None
    places = np.concatenate([np.vstack([ring, [np.nan, np.nan]]) for ring in rings])
    fill = patch.get_fill() and to_rgba(patch.get_facecolor())[3] > 0
    line = stroke(patch, css(patch.get_edgecolor()))
    what = {"x": _numbers(places[:, 0]), "y": _numbers(places[:, 1]), "line": line}
    shape = {"fill": "toself", "fillcolor": css(patch.get_facecolor())} if fill else {}
    return {"type": "scatter", "mode": "lines"} | what | shape | _named(label)


def _scatter(points):
    x, y = np.asarray(points.get_offsets()).T
    colours = [css(c) for c in points.get_facecolor()] or ["#444"]
    sizes = np.sqrt(np.asarray(points.get_sizes())) * PER_POINT
    marker = {
        "color": colours[0] if len(colours) == 1 else colours,
        "size": float(sizes[0]) if len(sizes) == 1 else [float(s) for s in sizes],
    }
    what = {"type": "scatter", "mode": "markers", "x": _numbers(x), "y": _numbers(y)}
    return what | {"marker": marker} | _named(points.get_label())


def _segments(lines, label):
    """Error bars and similar: one trace, with gaps between the segments."""
    rows = []
    for segment in lines.get_segments():
        rows += [*np.asarray(segment).tolist(), [np.nan, np.nan]]
    x, y = np.array(rows, dtype=float).T
    colours, widths = lines.get_color(), lines.get_linewidth()
    style = {"color": to_hex(colours[0]), "width": float(np.ravel(widths)[0]) * PER_POINT}
    what = {"type": "scatter", "mode": "lines", "x": _numbers(x), "y": _numbers(y), "line": style}
    return what | _named(label)
