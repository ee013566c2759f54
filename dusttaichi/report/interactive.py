"""Figures of dusttaichi.plots as interactive ones: what matplotlib has drawn, told to plotly.js.

So every figure of `dust plot` can be zoomed, read under the pointer, and its curves switched on and
off, without being drawn twice. A figure of pictures stays a picture.
"""

import base64
import io
import re

import numpy as np
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.patches import Polygon, Rectangle

GREEK = {
    "phi": "φ", "Delta": "Δ", "delta": "δ", "mu": "µ", "gamma": "γ", "sigma": "σ", "xi": "ξ",
    "rho": "ρ", "eta": "η", "theta": "θ", "pi": "π", "alpha": "α", "beta": "β", "pm": "±",
    "propto": "∝", "times": "×", "cdot": "·", "leq": "≤", "geq": "≥", "approx": "≈", "sqrt": "√",
    "langle": "⟨", "rangle": "⟩", "infty": "∞", "varphi": "φ", "epsilon": "ε", "Sigma": "Σ",
    "sim": "∼", "lambda": "λ", "tau": "τ", "to": "→", "rightarrow": "→", "Phi": "Φ",
}  # fmt: skip
DASHES = {"-": "solid", "--": "dash", ":": "dot", "-.": "dashdot", "None": "solid"}
SYMBOLS = {"o": "circle", ".": "circle", "s": "square", "^": "triangle-up", "v": "triangle-down",
           "D": "diamond", "d": "diamond", "*": "star", "X": "x", "x": "x-thin", "+": "cross-thin",
           "P": "cross"}  # fmt: skip
PER_POINT = 96.0 / 72.0 * 0.9


def html(text):
    """A label with its formulas ($...$, as matplotlib has them) as HTML."""
    text = text.replace("<", "&lt;")
    return re.sub(r"\$([^$]*)\$", lambda found: _formula(found[1]), text)


def _formula(text):
    text = re.sub(r"\\(?:rm|mathrm|text|mathit|left|right|!)\s?", "", text)
    text = re.sub(r"\\[,; ]", " ", text)
    text = re.sub(r"\\([A-Za-z]+)", lambda m: GREEK.get(m[1], m[1]), text)
    for mark, tag in (("_", "sub"), ("\\^", "sup")):
        text = re.sub(mark + r"\{([^{}]*)\}", rf"<{tag}>\1</{tag}>", text)
        text = re.sub(mark + r"(\w)", rf"<{tag}>\1</{tag}>", text)
    return re.sub(r" +", " ", text.replace("{", "").replace("}", "").replace("-", "−")).strip()


def interactive(figure, name, title):
    """A dict for the page: name, title, and `data` and `layout` of plotly.js, or an `image`.

    figure: a matplotlib Figure.
    """
    axes = [a for a in figure.axes if a.has_data() and a.axison]
    if not axes or any(a.images for a in figure.axes):
        return {"name": name, "title": title, "image": picture(figure)}
    figure.canvas.draw()  # limits and ticks are known only now
    data, layout = [], {
        "margin": {"l": 64, "r": 14, "t": 14, "b": 48},
        "font": {"size": 12},
        "hovermode": "closest",
        "legend": {"orientation": "h", "y": -0.16, "yanchor": "top", "x": 0},
        "shapes": [],
        "plot_bgcolor": "white",
    }  # fmt: skip
    tops = sorted(axes, key=lambda a: -a.get_position().y1)
    for number, (one, span) in enumerate(zip(tops, _spans_of(tops), strict=True)):
        end = "" if number == 0 else str(number + 1)
        _axis(layout, f"xaxis{end}", one, "x", {"anchor": f"y{end}"})
        _axis(layout, f"yaxis{end}", one, "y", {"anchor": f"x{end}", "domain": span})
        if number and one.get_shared_x_axes().joined(one, tops[0]):
            layout[f"xaxis{end}"]["matches"] = "x"
            layout["xaxis"] |= {"showticklabels": False, "title": {"text": ""}}
        data += [t | {"xaxis": f"x{end}", "yaxis": f"y{end}"} for t in _traces(one)]
        layout["shapes"] += _across(one, end)
    return {"name": name, "title": title, "data": data, "layout": layout, "rows": len(tops)}


def _spans_of(axes):
    """(low, high) of each Axes along the height of the page's figure, from the top down."""
    heights = np.array([a.get_position().height for a in axes])
    gap = 0.05 if len(axes) > 1 else 0.0
    heights = heights / heights.sum() * (1.0 - gap * (len(axes) - 1))
    tops = 1.0 - np.concatenate([[0.0], np.cumsum(heights + gap)[:-1]])
    return [[max(top - height, 0.0), top] for top, height in zip(tops, heights, strict=True)]


def picture(figure):
    """The figure as the URL of a PNG in the page itself."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130)
    return f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"


def _axis(layout, name, axes, which, more):
    scale = getattr(axes, f"get_{which}scale")()
    low, high = getattr(axes, f"get_{which}lim")()
    label = getattr(axes, f"get_{which}label")()
    log = scale == "log"
    limits = [float(np.log10(v)) if log else float(v) for v in (low, high)]
    layout[name] = {
        "title": {"text": html(label)},
        "type": "log" if log else "linear",
        "range": limits,
        "showline": True,
        "mirror": True,
        "linecolor": "#444",
        "gridcolor": "#eceef1",
        "zeroline": False,
        "ticks": "inside",
        "exponentformat": "power",
        **({"dtick": 1} if log and limits[1] - limits[0] > 2 else {}),
        **more,
    }


def _traces(axes):
    """Lines, areas and scattered points of one Axes."""
    found = []
    for area in axes.collections:
        if isinstance(area, PolyCollection) and len(area.get_paths()):
            found += [_area(path, area) for path in area.get_paths() if len(path.vertices)]
        elif isinstance(area, PathCollection) and len(area.get_offsets()):
            found.append(_scatter(area))
        elif isinstance(area, LineCollection) and len(area.get_segments()):
            found.append(_segments(area))
    bars = [c for c in axes.containers if getattr(c, "patches", None)]
    labels = {id(c.patches[0]): c.get_label() for c in bars}  # which bars themselves have not
    for patch in axes.patches:
        if all(_in_data(patch, axes)):
            found.append(_patch(patch, labels.get(id(patch), patch.get_label())))
    for line in axes.lines:
        if all(_in_data(line, axes)) and len(line.get_xdata()):
            found.append(_line(line))
    return [trace for trace in found if trace is not None]


def _named(label):
    label = str(label)
    hidden = label.startswith("_") or not label
    return {"name": "" if hidden else html(label), "showlegend": not hidden} | (
        {"hoverinfo": "x+y"} if hidden else {}
    )


def _numbers(values):
    """Floats with five digits and None where there is no number."""
    values = np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in values]


def _line(line):
    dashed, marker = line.get_linestyle(), line.get_marker()
    lines, marks = dashed not in ("None", "", " "), marker not in ("None", "", " ", None)
    if not (lines or marks):
        return None
    pattern = getattr(line, "_unscaled_dash_pattern", (0, None))[1]
    dash = "solid" if pattern is None else ",".join(f"{2.0 * p:g}px" for p in pattern)
    trace = {
        "type": "scatter",
        "mode": "+".join(["lines"] * lines + ["markers"] * marks),
        "x": _numbers(line.get_xdata()),
        "y": _numbers(line.get_ydata()),
        "line": {
            "color": to_hex(line.get_color()),
            "width": line.get_linewidth() * PER_POINT,
            "dash": dash,
        },
        "opacity": line.get_alpha() or 1.0,
    }
    if marks:
        edge = line.get_markeredgewidth()
        trace["marker"] = {
            "symbol": SYMBOLS.get(marker, "circle"),
            "size": (line.get_markersize() * (0.5 if marker == "." else 1.0) + edge) * PER_POINT,
            "color": _css(line.get_markerfacecolor()),
            "line": {"color": _css(line.get_markeredgecolor()), "width": edge},
        }
    return trace | _named(line.get_label())


def _css(colour):
    if isinstance(colour, str) and colour == "none":
        return "rgba(0,0,0,0)"
    r, g, b, a = to_rgba(colour)
    return f"rgba({255 * r:.0f},{255 * g:.0f},{255 * b:.0f},{a:.3g})"


def _area(path, area):
    x, y = path.vertices.T
    colours = area.get_facecolor()
    colour = colours[0] if len(colours) else (0, 0, 0, 0.1)
    shape = {"type": "scatter", "mode": "lines", "fill": "toself", "line": {"width": 0}}
    what = {"x": _numbers(x), "y": _numbers(y), "fillcolor": _css(colour), "hoverinfo": "skip"}
    return _named(area.get_label()) | shape | what


def _patch(patch, label):
    """A bar, a step of a histogram, a polygon."""
    path = patch.get_path().transformed(patch.get_patch_transform())
    rings = [r for r in path.to_polygons(closed_only=False) if len(r) > 1]
    if not rings or not patch.get_visible():
        return None
    places = np.concatenate([np.vstack([ring, [np.nan, np.nan]]) for ring in rings])
    fill = patch.get_fill() and to_rgba(patch.get_facecolor())[3] > 0
    style = {"color": _css(patch.get_edgecolor()), "width": patch.get_linewidth() * PER_POINT}
    what = {"x": _numbers(places[:, 0]), "y": _numbers(places[:, 1]), "line": style}
    shape = {"fill": "toself", "fillcolor": _css(patch.get_facecolor())} if fill else {}
    return {"type": "scatter", "mode": "lines"} | what | shape | _named(label)


def _scatter(points):
    x, y = np.asarray(points.get_offsets()).T
    colours = [_css(c) for c in points.get_facecolor()] or ["#444"]
    sizes = np.sqrt(np.asarray(points.get_sizes())) * PER_POINT
    marker = {
        "color": colours[0] if len(colours) == 1 else colours,
        "size": float(sizes[0]) if len(sizes) == 1 else [float(s) for s in sizes],
    }
    what = {"type": "scatter", "mode": "markers", "x": _numbers(x), "y": _numbers(y)}
    return what | {"marker": marker} | _named(points.get_label())


def _segments(lines):
    """Error bars and the like: one trace, with gaps between the pieces."""
    rows = []
    for segment in lines.get_segments():
        rows += [*np.asarray(segment).tolist(), [np.nan, np.nan]]
    x, y = np.array(rows, dtype=float).T
    colours, widths = lines.get_color(), lines.get_linewidth()
    style = {"color": to_hex(colours[0]), "width": float(np.ravel(widths)[0]) * PER_POINT}
    what = {"type": "scatter", "mode": "lines", "x": _numbers(x), "y": _numbers(y), "line": style}
    return what | _named(lines.get_label())


def _across(axes, end):
    """What reaches across all of the axes: axhline and axvline, axhspan and axvspan."""
    shapes = []
    for line in axes.lines:
        x, y = np.atleast_1d(line.get_xdata()), np.atleast_1d(line.get_ydata())
        shape = _shape("line", (x, y), _in_data(line, axes), end) if len(x) == 2 else None
        if shape is not None:
            width = line.get_linewidth() * PER_POINT
            shapes.append(shape | {"line": {"color": to_hex(line.get_color()), "width": width}})
    for patch in axes.patches:
        if isinstance(patch, (Rectangle, Polygon)):
            box = patch.get_path().get_extents(patch.get_patch_transform())
            ends = (box.x0, box.x1), (box.y0, box.y1)
            shape = _shape("rect", ends, _in_data(patch, axes), end)
            if shape is not None:
                fill = {"fillcolor": _css(patch.get_facecolor()), "line": {"width": 0}}
                shapes.append(shape | fill | {"layer": "below"})
    return shapes


def _in_data(artist, axes):
    """(x, y): whether these coordinates of an artist are those of the data."""
    return artist.get_transform().contains_branch_seperately(axes.transData)


def _shape(kind, ends, in_data, end):
    """A shape that reaches across all of one direction, None where it reaches across neither."""
    if in_data[0] == in_data[1]:
        return None
    axes = {"xref": f"x{end}", "yref": f"y{end} domain"}
    if in_data[1]:
        axes = {"xref": f"x{end} domain", "yref": f"y{end}"}
    places = zip(("x0", "x1", "y0", "y1"), (*ends[0], *ends[1]), strict=True)
    return {"type": kind, **axes, **{name: float(value) for name, value in places}}
