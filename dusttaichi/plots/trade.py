"""Cost against error: every point of a trade, and the front that no point beats."""

import numpy as np

from dusttaichi.analysis.observables import TEXTS
from dusttaichi.analysis.trade import front
from dusttaichi.errors import DustError
from dusttaichi.plots import style

LOOKS = {  # knob -> colour, marker
    "step_fraction": (style.BLUE, "o"),
    "precision": (style.ORANGE, "o"),
    "newton_steps": (style.GREEN, "o"),
    "skin": (style.RED, "o"),
    "window": (style.PURPLE, "o"),
    "speed": (style.BLUE, "s"),
    "mass_scaling": (style.ORANGE, "s"),
    "side_walls": (style.GREEN, "s"),
    "rolling": (style.SKY, "^"),
    "sliding": (style.RED, "^"),
    "twisting": (style.PURPLE, "^"),
    "damping": (style.GREEN, "^"),
    "asperities": (style.YELLOW, "^"),
    "grains": (style.BLACK, "D"),
    "combined": (style.GREY, "P"),
}
MARKED = {"default": "*", "preset": "X"}


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
    floor, own = _of(data, "scatter"), _of(data, "convergence")
    if np.isfinite(floor):
        axes.axhspan(lowest / 2, floor, color=style.GREY, alpha=0.18, linewidth=0,
                     label="scatter between seeds")  # fmt: skip
    if np.isfinite(own) and own > 0:
        axes.axhline(own, color=style.GREY, linewidth=1.0, linestyle=(0, (1, 1)),
                     label="the reference's own error")  # fmt: skip
    axes.axhline(data.attrs["tolerance"], color=style.BLACK, linewidth=0.8, linestyle=(0, (5, 2)),
                 label="tolerance")  # fmt: skip
    knobs = data.knob.values
    for knob in dict.fromkeys(knobs[known].tolist()):
        if knob not in MARKED:
            here = known & (knobs == knob)
            colour, marker = LOOKS.get(knob, (style.GREY, "."))
            axes.plot(cost[here], shown[here], marker, color=colour, markersize=4.5,
                      markeredgecolor="white", markeredgewidth=0.4,
                      label=knob.replace("_", " "))  # fmt: skip
    best = front(np.where(known, cost, np.nan), error)
    axes.plot(cost[best], shown[best], color=style.BLACK, linewidth=1.0, zorder=1.5,
              label="front")  # fmt: skip
    for knob, marker in MARKED.items():
        here = known & (knobs == knob)
        axes.plot(cost[here], shown[here], marker, color=style.BLACK, markersize=8, zorder=4,
                  markeredgecolor="white", markeredgewidth=0.6, label=knob)  # fmt: skip
    name = data.attrs["observable"]
    axes.set(xscale="log", yscale="log", xlabel="cost over that of the default",
             ylabel=f"error: {TEXTS.get(name, name)}")  # fmt: skip
    _limits(axes, cost[known], shown[known], data.attrs["tolerance"], lowest)
    style.few_ticks(axes.xaxis)
    marked = np.isin(knobs, list(MARKED)) & known
    _name(figure, axes, data, cost, shown, [*np.flatnonzero(marked), *best])
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def save_trade(data, path):
    """Write the figure; returns the path. Raises DustError where it cannot be written."""
    try:
        trade(data).savefig(path)
    except (OSError, ValueError) as error:
        raise DustError(f"The figure cannot be written to {path}: {error}.") from error
    return path


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


def _name(figure, axes, data, cost, shown, numbers):
    """Labels beside some points, each where it meets neither another nor a point, if there is
    such a place; a label of the front that has none is left out."""
    figure.draw_without_rendering()  # the layout, in which places are known
    taken, renderer = [], figure.canvas.get_renderer()
    spots = axes.transData.transform(np.column_stack([cost, shown]))
    spots = spots[np.isfinite(spots).all(axis=1)]
    room = axes.get_window_extent(renderer)
    places = [(6, 4, "left"), (-6, 4, "right"), (6, -9, "left"), (-6, -9, "right"),
              (0, 8, "center"), (0, -13, "center"), (10, 12, "left"), (-10, 12, "right"),
              (10, -18, "left"), (-10, -18, "right")]  # fmt: skip
    for n in dict.fromkeys(int(n) for n in numbers):
        text = str(data.label.values[n])
        must = str(data.knob.values[n]) in MARKED
        best = None
        for x, y, side in places:
            label = axes.annotate(text, (cost[n], shown[n]), (x, y), textcoords="offset points",
                                  ha=side, fontsize=6.5, zorder=5)  # fmt: skip
            box = label.get_window_extent(renderer).padded(1.0)
            hits = sum(box.overlaps(other) for other in taken) * 10
            hits += sum(box.contains(*spot) for spot in spots)
            hits += 10 * (box.x0 < room.x0 or box.x1 > room.x1 or box.y0 < room.y0
                          or box.y1 > room.y1)  # fmt: skip
            label.remove()
            if best is None or hits < best[0]:
                best = (hits, x, y, side, box)
        if best[0] < 10 or must:
            axes.annotate(text, (cost[n], shown[n]), best[1:3], textcoords="offset points",
                          ha=best[3], fontsize=6.5, zorder=5)  # fmt: skip
            taken.append(best[4])
