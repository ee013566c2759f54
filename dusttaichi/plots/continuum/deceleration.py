"""Normalised motion of a bead until it stops (G09 Fig 18)."""

import numpy as np

from dusttaichi.analysis.continuum import intrusion
from dusttaichi.plots import style
from dusttaichi.plots.continuum.dust import intrudes
from dusttaichi.plots.registry import figure

SINE = "laboratory: sine (G09 eq 11)"


def draw_way(axes, runs, labels):
    t = np.linspace(0.0, 1.0, 200)
    axes.plot(t, -np.sin(0.5 * np.pi * t), color=style.BLACK, linewidth=1.0, label=SINE)
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        way = intrusion(run)
        stop = way.without_gravity or way.stop
        if stop is None:
            continue
        text = f"T = {stop.time * 1e3:.2f} ms, D = {stop.depth * 1e3:.2f} mm"
        text = f"{label}:\n{text}" if label else text
        axes.plot(*stop.normalised, label=text, **style.run_style(number))
    axes.set_xlabel("time over stopping time t / T")
    axes.set_ylabel("height over depth h / D")
    axes.set_ylim(-1.05, 0.32)  # space for the legend
    style.legend(axes)


@figure("Motion of the bead", 175, applies=intrudes, together=True)
def deceleration(runs, labels=None):
    """Normalised motion of a bead of one run or several until it stops, as G09 Fig 18.

    The free-fall term g t^2 / 2 is subtracted, as in the paper.

    Raises
    ------
    DustError
        A run has no projectile.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure()
    draw_way(axes, runs, labels)
    return figure
