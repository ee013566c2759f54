"""Filling factor along the axis below a bead (G09 Fig 12)."""

import numpy as np

from dusttaichi.analysis.continuum import axis_profile, laboratory
from dusttaichi.plots import style
from dusttaichi.plots.continuum.dust import intrudes
from dusttaichi.plots.registry import figure


def draw_profile(axes, runs, labels):
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        found = axis_profile(run)
        seen = np.isfinite(found.filling_factor)
        line = style.run_style(number)
        axes.plot(
            found.filling_factor[seen], found.depth[seen] * 1e3, label=label, marker=".", **line
        )
        axes.axhline(found.bead * 1e3, **style.look(line["color"], 0.6, style.DOTTED))
    axes.axvline(
        laboratory.MOST_FREQUENT,
        label="most frequent below\nthe bead (G09 Fig 11)",
        **style.look(style.BLACK, 1.0, style.DASHED),
    )
    axes.set(xlabel=r"filling factor $\phi$ below the bead", ylabel="depth below the surface (mm)")
    axes.invert_yaxis()
    style.legend(axes)


@figure("Filling factor below the bead", 174, applies=intrudes, together=True)
def bead_profile(runs, labels=None):
    """Filling factor along the axis below a bead of one run or several, as G09 Fig 12.

    Dotted: the lowest point of the bead.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure(height=4.0)
    draw_profile(axes, runs, labels)
    return figure
