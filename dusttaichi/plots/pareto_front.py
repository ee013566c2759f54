"""Cost against error: every point of a trade, and the Pareto front."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from dusttaichi.analysis.observables import describe_observable, find_pareto_front
from dusttaichi.plots import style
from dusttaichi.plots.canvas import get_renderer

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation
    from matplotlib.transforms import BboxBase

    from dusttaichi.physics.geometry import Floats

LOOKS = {  # parameter -> colour, marker
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
MARKED = {"preset": (style.BLACK, "X", 7), "default": (style.RED, "*", 10)}


@style.apply_style
def trade(data: xr.Dataset) -> Figure:
    """The figure of the dataset of a trade (trade.nc).

    An error of 0, and that of the reference against itself, is drawn at the lower edge.
    """
    figure, (axes,) = style.create_figure(height=5.2)
    cost, error = data.cost_ratio.values, data.error.values.copy()
    is_measured = np.isfinite(cost) & np.isfinite(error) & (cost > 0)
    lowest = _find_lowest(data, error[is_measured])
    shown = np.maximum(error, lowest)
    best = find_pareto_front(np.where(is_measured, cost, np.nan), error)
    _draw_thresholds(axes, data, lowest)
    parameters = np.where(is_measured, data.parameter.values, "")
    edge: style.Look = {"markeredgecolor": "white", "markeredgewidth": 0.4, "markersize": 4.5}
    for name in dict.fromkeys(parameters[is_measured].tolist()):
        if name not in MARKED:
            (colour, marker), of_parameter = LOOKS.get(name, (style.GREY, ".")), parameters == name
            label = name.replace("_", " ")
            axes.plot(
                cost[of_parameter], shown[of_parameter], marker, color=colour, label=label, **edge
            )
    axes.plot(cost[best], shown[best], color=style.BLACK, linewidth=1.0, zorder=1.5, label="front")
    edge |= {"markeredgewidth": 0.6, "zorder": 4}  # presets and the default, above all others
    for name, (colour, marker, size) in MARKED.items():
        of_parameter, look = parameters == name, edge | {"markersize": size, "color": colour}
        axes.plot(cost[of_parameter], shown[of_parameter], marker, label=name, **look)
    name = data.attrs["observable"]
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="cost over that of the default",
        ylabel="error: " + describe_observable(name)[0].replace("phi(P)", r"$\phi(P)$"),
    )
    _set_limits(axes, cost[is_measured], shown[is_measured], data.attrs["tolerance"], lowest)
    style.set_few_ticks(axes.xaxis)
    is_marked = np.isin(data.parameter.values, list(MARKED)) & is_measured
    figure.legend(loc="outside lower center", ncols=4, fontsize=7)
    _label_points(
        figure, axes, data, _Points(cost, shown, best), [*np.flatnonzero(is_marked), *best]
    )
    return figure


@dataclass(frozen=True)
class _Points:
    """Coordinates of the points, (points,) each, and the numbers of those of the front."""

    cost: Floats
    error: Floats
    front: Sequence[int]


def _draw_thresholds(axes: Axes, data: xr.Dataset, lowest: float) -> None:
    """Draw the scatter between seeds, the error of the reference itself, and the tolerance."""
    scatter, reference_error = (
        _select_observable(data, "scatter"),
        _select_observable(data, "convergence"),
    )
    if np.isfinite(scatter):
        look: style.Look = {"color": style.GREY, "alpha": 0.18, "linewidth": 0}
        axes.axhspan(lowest / 2, scatter, label="scatter between seeds", **look)
    if np.isfinite(reference_error) and reference_error > 0:
        text = f"reference at {data.attrs.get('check', 'half its step')}"
        axes.axhline(reference_error, label=text, **style.line_look(style.GREY, 1.0, style.FINE))
    look = style.line_look(style.BLACK, 0.8, (0, (5, 2)))
    axes.axhline(data.attrs["tolerance"], label="tolerance", **look)


def _select_observable(data: xr.Dataset, name: str) -> float:
    return float(data[name].sel(observable=data.attrs["observable"]))


def _find_lowest(data: xr.Dataset, errors: Floats) -> float:
    """Level at which an error of 0 is drawn: a factor of three below the least other one."""
    marks = [
        *errors,
        _select_observable(data, "scatter"),
        _select_observable(data, "convergence"),
        data.attrs["tolerance"],
    ]
    return float(min(v for v in marks if np.isfinite(v) and v > 0)) / 3.0


def _set_limits(axes: Axes, cost: Floats, shown: Floats, tolerance: float, lowest: float) -> None:
    axes.set_xlim(min(cost.min() / 1.4, 0.45), max(cost.max() * 1.6, 2.2))
    finite = shown[np.isfinite(shown)]
    axes.set_ylim(lowest / 1.5, 3.0 * max(finite.max(), tolerance))


# distances [points] of a label from its mark; beyond the first with a line
RINGS = (9, 16, 26, 40, 56, 74)
DIRECTIONS = [np.array([np.cos(a), np.sin(a)]) for a in np.radians(range(-160, 200, 20))]
SHRUNK = 3.0  # distance [points] of the end of that line from the mark
APART = 2.0  # distance [points] between labels and from other marks


def _label_points(
    figure: Figure, axes: Axes, data: xr.Dataset, points: _Points, numbers: Sequence[int]
) -> None:
    """Label some points where it hides least; points that coincide have a common label.

    Labels of the front that would hide another label are left out.
    """
    figure.draw_without_rendering()  # determines the layout
    renderer, pixel = get_renderer(figure), figure.dpi / 72.0
    cost, shown, best = points.cost, points.error, points.front
    spots = axes.transData.transform(np.column_stack([cost, shown]))
    spots = spots[np.isfinite(spots).all(axis=1)]
    corners = axes.transData.transform(np.column_stack([cost[best], shown[best]]))
    line = [
        a + t * (b - a)
        for a, b in zip(corners, corners[1:], strict=False)
        for t in np.linspace(0.02, 0.98, 40)
    ]
    window = axes.get_window_extent(renderer)
    occupied_boxes: list[BboxBase] = []
    groups: dict[tuple[float, float], list[int]] = {}
    for n in dict.fromkeys(int(n) for n in numbers):
        coinciding = groups.setdefault((float(cost[n]), float(shown[n])), [])
        if not coinciding or data.parameter.values[n] in MARKED:
            coinciding.append(n)
    for location, members in groups.items():
        text = ", ".join(_shorten(str(data.label.values[n])) for n in members)
        choices: list[tuple[float, int, int, Floats, BboxBase]] = []
        for ring, direction, box in _list_boxes(axes, text, location, pixel):
            hidden = 10 * sum(box.overlaps(occupied) for occupied in occupied_boxes)
            wide = box.padded((APART + 2.0) * pixel)
            hidden += 3 * int(np.count_nonzero(style.is_within(wide, spots)))
            hidden += 4 * bool(np.any(style.is_within(box, np.array(line))))
            hidden += 20 * (not (window.contains(*wide.min) and window.contains(*wide.max)))
            choices.append((hidden + 0.4 * ring, len(choices), ring, direction, box))
        weight, _, ring, direction, box = min(choices, key=lambda choice: choice[:2])
        if weight < 10 or data.parameter.values[members[0]] in MARKED:
            _draw_label(axes, text, location, RINGS[ring] * direction, ring)
            occupied_boxes.append(box.padded(APART * pixel))


def _list_boxes(
    axes: Axes, text: str, location: tuple[float, float], pixel: float
) -> Iterator[tuple[int, Floats, BboxBase]]:
    """List possible positions of a label: (ring, direction, its Bbox with the line, in pixels)."""
    label = _draw_label(axes, text, location, RINGS[0] * DIRECTIONS[0], 0)
    size = np.array(label.get_window_extent(get_renderer(axes.figure)).size)
    label.remove()
    mark = axes.transData.transform(location)
    for ring, radius in enumerate(RINGS):
        for direction in DIRECTIONS:
            edge = {"center": 0.5, "left": 0.0, "right": 1.0}[_choose_side(direction)]
            corner = mark + radius * pixel * direction - size * np.array([edge, 0.5])
            box: BboxBase = Bbox([corner, corner + size])
            if ring:
                end = mark + SHRUNK * pixel * direction
                box = Bbox.union([box, Bbox([end, end])])
            yield ring, direction, box


def _choose_side(direction: Floats) -> Literal["left", "center", "right"]:
    """Side of a label that faces its mark, by the direction (2,) from the mark."""
    cosine = direction[0] / np.hypot(*direction)
    return "center" if abs(cosine) < 0.1 else ("left" if cosine > 0 else "right")


def _draw_label(
    axes: Axes, text: str, location: tuple[float, float], offset: Floats, ring: int
) -> Annotation:
    """Draw a label, its near edge at `offset`, (2,) in points, from its location in the data."""
    arrow: dict[str, Any] = {
        "arrowstyle": "-",
        "linewidth": 0.4,
        "color": style.GREY,
        "shrinkB": SHRUNK,
    }
    label = axes.annotate(
        text,
        location,
        (float(offset[0]), float(offset[1])),
        textcoords="offset points",
        ha=_choose_side(offset),
        va="center",
        fontsize=6.5,
        zorder=5,
        arrowprops=arrow if ring else None,
        path_effects=[withStroke(linewidth=1.6, foreground="white")],
    )
    label.set_in_layout(False)  # does not change the size of the axes
    return label


def _shorten(text: str) -> str:
    """Shorten a label: of a combination of more than two, to the last one."""
    words = text.replace("_", " ").split(" + ")
    return "\n+ ".join(words) if len(words) < 3 else f"… + {words[-1]}"
