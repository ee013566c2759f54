"""Cost against error: every point of a trade, and the front that no point beats."""

from dataclasses import dataclass

import numpy as np
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from dusttaichi.analysis.observables import about
from dusttaichi.analysis.trade import front
from dusttaichi.plots import style

LOOKS = {  # knob -> colour, marker
    "step_fraction": (style.BLUE, "o"),
    "precision": (style.ORANGE, "o"),
    "newton_steps": (style.GREEN, "o"),
    "skin": (style.RED, "o"),
    "window": (style.PURPLE, "o"),
    "speed": (style.BLUE, "s"),
    "mass_scaling": (style.ORANGE, "s"),
    "stiffness_scaling": (style.RED, "s"),
    "side_walls": (style.GREEN, "s"),
    "rolling": (style.SKY, "^"),
    "sliding": (style.RED, "^"),
    "twisting": (style.PURPLE, "^"),
    "damping": (style.GREEN, "^"),
    "asperities": (style.YELLOW, "^"),
    "grains": (style.BLACK, "D"),
    "spacing": (style.BLUE, "o"),
    "h_over_spacing": (style.ORANGE, "o"),
    "cfl": (style.GREEN, "o"),
    "viscosity_grid": (style.PURPLE, "o"),
    "viscosity_contact": (style.RED, "s"),
    "combined": (style.GREY, "P"),
}
MARKED = {"preset": ("X", style.BLACK, 7), "default": ("*", style.RED, 10)}


@style.styled
def trade(data):
    """The figure of a dataset of `analysis.trade_dataset`.

    An error of 0, and that of the reference against itself, is drawn at the lower edge.
    """
    figure, (axes,) = style.new_figure(height=5.2)
    cost, error = data.cost_ratio.values, data.error.values.copy()
    known = np.isfinite(cost) & np.isfinite(error) & (cost > 0)
    lowest = _lowest(data, error[known])
    shown = np.maximum(error, lowest)
    best = front(np.where(known, cost, np.nan), error)
    _thresholds(axes, data, lowest)
    _points(axes, data.knob.values, known, cost, shown)
    axes.plot(cost[best], shown[best], color=style.BLACK, linewidth=1.0, zorder=1.5, label="front")
    _marked_points(axes, data.knob.values, known, cost, shown)
    name = data.attrs["observable"]
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="cost over that of the default",
        ylabel="error: " + about(name)[0].replace("phi(P)", r"$\phi(P)$"),
    )
    _limits(axes, cost[known], shown[known], data.attrs["tolerance"], lowest)
    style.few_ticks(axes.xaxis)
    marked = np.isin(data.knob.values, list(MARKED)) & known
    figure.legend(loc="outside lower center", ncols=4, fontsize=7)
    _label_points(figure, axes, data, _Points(cost, shown, best), [*np.flatnonzero(marked), *best])
    return figure


@dataclass(frozen=True)
class _Points:
    """Where the points are drawn, (points,) each, and the numbers of those of the front."""

    cost: np.ndarray
    error: np.ndarray
    front: list


def _thresholds(axes, data, lowest):
    """The scatter between seeds, the error of the reference itself, and the tolerance."""
    floor, own = _of(data, "scatter"), _of(data, "convergence")
    if np.isfinite(floor):
        axes.axhspan(
            lowest / 2,
            floor,
            color=style.GREY,
            alpha=0.18,
            linewidth=0,
            label="scatter between seeds",
        )
    if np.isfinite(own) and own > 0:
        axes.axhline(
            own,
            color=style.GREY,
            linewidth=1.0,
            linestyle=(0, (1, 1)),
            label=f"reference at {data.attrs.get('check', 'half its step')}",
        )
    axes.axhline(
        data.attrs["tolerance"],
        color=style.BLACK,
        linewidth=0.8,
        linestyle=(0, (5, 2)),
        label="tolerance",
    )


def _points(axes, knobs, known, cost, shown):
    for knob in dict.fromkeys(knobs[known].tolist()):
        if knob in MARKED:
            continue
        here = known & (knobs == knob)
        colour, marker = LOOKS.get(knob, (style.GREY, "."))
        axes.plot(
            cost[here],
            shown[here],
            marker,
            color=colour,
            markersize=4.5,
            markeredgecolor="white",
            markeredgewidth=0.4,
            label=knob.replace("_", " "),
        )


def _marked_points(axes, knobs, known, cost, shown):
    """Presets and the default, above all others."""
    for knob, (marker, colour, size) in MARKED.items():
        here = known & (knobs == knob)
        axes.plot(
            cost[here],
            shown[here],
            marker,
            color=colour,
            markersize=size,
            zorder=4,
            markeredgecolor="white",
            markeredgewidth=0.6,
            label=knob,
        )


def _of(data, name):
    return float(data[name].sel(observable=data.attrs["observable"]))


def _lowest(data, errors):
    """Where an error of 0 is drawn: a factor of three below the least that is shown otherwise."""
    marks = [*errors, _of(data, "scatter"), _of(data, "convergence"), data.attrs["tolerance"]]
    return min(v for v in marks if np.isfinite(v) and v > 0) / 3.0


def _limits(axes, cost, shown, tolerance, lowest):
    axes.set_xlim(min(cost.min() / 1.4, 0.45), max(cost.max() * 1.6, 2.2))
    finite = shown[np.isfinite(shown)]
    axes.set_ylim(lowest / 1.5, 3.0 * max(finite.max(), tolerance))


# points from a mark to its label; beyond the first with a line to it
RINGS = (9, 16, 26, 40, 56, 74)
WAYS = [np.array([np.cos(a), np.sin(a)]) for a in np.radians(range(-160, 200, 20))]
SHRUNK = 3.0  # points between the end of that line and the mark
APART = 2.0  # points between labels, and between a label and a mark that it must not hide


def _label_points(figure, axes, data, points, numbers):
    """Labels beside some points, where they hide least of points, lines and other labels; those
    of the front that would hide another are left out. Points at one place have one label."""
    figure.draw_without_rendering()  # the layout, in which places are known
    renderer, pixel = figure.canvas.get_renderer(), figure.dpi / 72.0
    cost, shown, best = points.cost, points.error, points.front
    spots = axes.transData.transform(np.column_stack([cost, shown]))
    spots = spots[np.isfinite(spots).all(axis=1)]
    corners = axes.transData.transform(np.column_stack([cost[best], shown[best]]))
    line = [
        a + t * (b - a)
        for a, b in zip(corners, corners[1:], strict=False)
        for t in np.linspace(0.02, 0.98, 40)
    ]
    room, taken, said = axes.get_window_extent(renderer), [], {}
    for n in dict.fromkeys(int(n) for n in numbers):
        place = said.setdefault((float(cost[n]), float(shown[n])), [])
        if not place or data.knob.values[n] in MARKED:  # the name of a preset says enough
            place.append(n)
    for place, those in said.items():
        text, choices = ", ".join(_short(str(data.label.values[n])) for n in those), []
        for ring, way, box in _boxes(axes, text, place, pixel):
            hidden = 10 * sum(box.overlaps(other) for other in taken)
            wide = box.padded((APART + 2.0) * pixel)
            hidden += 3 * np.count_nonzero(style.within(wide, spots))
            hidden += 4 * bool(np.any(style.within(box, line)))
            hidden += 20 * (not (room.contains(*wide.min) and room.contains(*wide.max)))
            choices.append((hidden + 0.4 * ring, len(choices), ring, way, box))
        hidden, _, ring, way, box = min(choices, key=lambda choice: choice[:2])
        if hidden < 10 or data.knob.values[those[0]] in MARKED:
            _label(axes, text, place, RINGS[ring] * way, ring)
            taken.append(box.padded(APART * pixel))


def _boxes(axes, text, place, pixel):
    """Where a label may stand: (ring, way, its Bbox with the line to it, in pixels)."""
    label = _label(axes, text, place, RINGS[0] * WAYS[0], 0)
    size = label.get_window_extent(axes.figure.canvas.get_renderer()).size
    label.remove()
    mark = axes.transData.transform(place)
    for ring, radius in enumerate(RINGS):
        for way in WAYS:
            edge = {"center": 0.5, "left": 0.0, "right": 1.0}[_side(way)]
            corner = mark + radius * pixel * way - size * (edge, 0.5)
            box = Bbox([corner, corner + size])
            if ring:
                end = mark + SHRUNK * pixel * way
                box = Bbox.union([box, Bbox([end, end])])
            yield ring, way, box


def _side(way):
    """Which side of a label is at the end of its way, (2,), from the mark."""
    leans = way[0] / np.hypot(*way)
    return "center" if abs(leans) < 0.1 else ("left" if leans > 0 else "right")


def _label(axes, text, place, offset, ring):
    """A label, its near edge `offset`, (2,) in points, from its place in the data."""
    arrow = {"arrowstyle": "-", "linewidth": 0.4, "color": style.GREY, "shrinkB": SHRUNK}
    label = axes.annotate(
        text,
        place,
        tuple(offset),
        textcoords="offset points",
        ha=_side(offset),
        va="center",
        fontsize=6.5,
        zorder=5,
        arrowprops=arrow if ring else None,
        path_effects=[withStroke(linewidth=1.6, foreground="white")],
    )
    label.set_in_layout(False)  # the axes keep their size, and the other labels their places
    return label


def _short(text):
    """Of a combination of more than two what it ends with: it stands for those before too."""
    parts = text.replace("_", " ").split(" + ")
    return "\n+ ".join(parts) if len(parts) < 3 else f"… + {parts[-1]}"
