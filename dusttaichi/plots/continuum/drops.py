"""Depth and stopping time of beads over their momentum, beside the laboratory (G09 Fig 17)."""

import numpy as np

from dusttaichi.analysis.continuum import intrusion, laboratory
from dusttaichi.plots import style
from dusttaichi.plots.continuum.dust import intrudes
from dusttaichi.plots.registry import figure, in_common

SMALL = 2e-3  # diameter [m] that parts the two sizes of the laboratory


@figure("Depth and stopping time of the beads", 177, together=in_common(intrudes))
def drops(runs):
    """Depth D and stopping time T against m v / A of several runs with beads, without free fall.

    Runs of one diameter are joined. Black: the drops of G09 Table 2, small beads filled. Runs that
    ended before the bead stopped are left out.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    figure, axes = style.new_figure(height=5.4, rows=2)
    lab = laboratory.drops()
    for large, face in ((True, "none"), (False, style.BLACK)):
        chosen = (lab["diameter"] > SMALL) == large
        label = f"laboratory, {'3' if large else '1'} mm (G09 Table 2)"
        look = {"color": style.BLACK, "markerfacecolor": face, "markersize": 4, "label": label}
        for one, key in zip(axes, ("depth", "time"), strict=True):
            one.plot(lab["momentum"][chosen], lab[key][chosen] * 1e3, "o", **look)
    found = {}
    for run in runs:
        way = intrusion(run)
        if way.without_gravity is not None:
            point = (way.momentum, way.without_gravity.depth, way.without_gravity.time)
            found.setdefault(round(way.diameter * 1e3, 3), []).append(point)
    for number, (diameter, points) in enumerate(sorted(found.items())):
        momentum, depth, time = np.array(sorted(points)).T
        line = style.run_style(number) | {"marker": "s", "markersize": 4}
        axes[0].plot(momentum, depth * 1e3, label=f"{diameter:g} mm", **line)
        axes[1].plot(momentum, time * 1e3, **line)
    for one, name in zip(axes, ("depth D (mm)", "stopping time T (ms)"), strict=True):
        style.logarithmic(one)
        one.set_ylabel(name)
    axes[1].set_xlabel(r"momentum over cross-section $m v / A$ (kg m$^{-1}$ s$^{-1}$)")
    style.legend(axes[0])
    return figure
