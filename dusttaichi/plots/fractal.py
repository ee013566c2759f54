"""Number of grains around a grain against distance (T19 Fig 10)."""

import numpy as np

from dusttaichi.analysis import fractal as fractal_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


def _frames(run):
    """True where it is stretched, with at least two snapshots, in a cell without a tilt."""
    frames = run.part_that("stretches").snapshots if run.stretches else None
    return frames is not None and frames.sizes["snapshot"] > 1 and "tilt" not in frames


@figure("Fractal dimension", 113, applies=_frames)
def fractal(run, snapshots=None, stage=None):
    """N(r < r_in) and its local slope for some snapshots of a run; see `analysis.fractal`.

    Slopes of 2 and 3 are drawn beside the numbers.

    Parameters
    ----------
    run : Run
    snapshots : sequence of int, optional
        As in `analysis.fractal`.
    stage : str or int, optional
        As in `analysis.fractal`.

    Raises
    ------
    DustError
        There are no snapshots.
    """
    result = fractal_of(run, snapshots, stage=stage)
    figure, (axes, below) = style.new_figure(height=4.8, rows=2, ratios=[2.4, 1])
    x = result.radius_in / result.grain_radius
    colours = style.gradient(len(result.number))
    phi = result.filling_factor
    per_time, time_unit = style.scaled(result.time.max(), style.TIMES)
    for number, colour in enumerate(colours):
        text = rf"$\phi$ = {phi[number]:.3g}"
        if np.isnan(phi[number]):
            text = f"{result.time[number] * per_time:.3g} {time_unit}"
        if np.isfinite(result.dimension[number]):
            text += rf", $D$ = {result.dimension[number]:.2f}"
        shown = np.where(result.number[number] > 0, result.number[number], np.nan)
        axes.plot(x, shown, color=colour, linewidth=1.3, label=text)
        below.plot(x, result.slope[number], color=colour, linewidth=1.1)
    first = result.number[0]
    for slope, dashes, at in ((2, style.DASHED, np.argmax(first >= 1)), (3, style.FINE, -1)):
        line = first[at] * (x / x[at]) ** slope
        axes.plot(
            x,
            line,
            label=rf"$\propto r_{{\rm in}}^{slope}$",
            **style.look(style.BLACK, 0.9, dashes),
        )
        below.axhline(slope, **style.look(style.BLACK, 0.9, dashes))
    axes.set(xscale="log", yscale="log")
    style.few_ticks(below.xaxis)
    axes.set(ylim=(0.5, 2 * result.number.max()), ylabel=r"grains nearer than $r_{\rm in}$")
    style.legend(axes, ncols=2)
    below.set(
        ylim=(0.0, 4.0), ylabel="local slope $D$", xlabel=r"$r_{\rm in}$ over the radius of a grain"
    )
    return figure
