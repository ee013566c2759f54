"""Pressure and width of dynamic compression against the speed of the wall (S12 Figs 11, 12)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.analysis.dynamic import measure_dynamic_compression
from dusttaichi.analysis.kind import is_dynamic
from dusttaichi.physics.laws import delta_dynamic, p_m_fast
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure, select_in_common

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run

FITS = {
    ("plateau", "bins"): ("fit up to 0.4", "v"),
    ("whole", "bins"): ("fit to all bins", "s"),
    ("whole", "decades"): ("fit, decades of P alike", "D"),
}


@figure("Fits and fronts of fast walls", 180, together=select_in_common(is_dynamic))
def dynamic_speeds(runs: Sequence[Run]) -> Figure:
    """Plateau and fits of S12 eq 31 against the wall speed of several dynamic compressions.

    Above: pressures, each run a point: the mean on the plateau and p_m of three fits; the line
    follows from the balance of momentum, dashed S12 eq 33. Below: Delta of the fits, dashed S12 eq
    35. The larger a marker, the more grains.

    Raises
    ------
    DustError
        A run is no dynamic compression.
    """
    figure, axes = style.create_figure(height=5.8, rows=2)
    results = [(run.grains or 0, measure_dynamic_compression(run)) for run in runs]
    sizes = sorted({grains for grains, _ in results})
    # within what S12 eqs 33 and 35 were fitted to
    wall_speeds = [d.speed for _, d in results]
    speeds = np.geomspace(max(1.0, 0.8 * min(wall_speeds)), min(25.0, 1.25 * max(wall_speeds)), 61)
    colours = dict(zip(FITS, (style.GREEN, style.RED, style.PURPLE), strict=True))
    for grains, d in results:
        look: style.Look = {
            "markersize": 4 + 2 * sizes.index(grains),
            "alpha": 0.75,
            "markeredgewidth": 0,
        }
        axes[0].plot(d.speed, d.plateau / 1e3, "o", color=style.BLUE, **look)
        for which, (_, marker) in FITS.items():
            if (fit := d.fits[which]) is not None:
                axes[0].plot(d.speed, fit.p_m / 1e3, marker, color=colours[which], **look)
                axes[1].plot(d.speed, fit.delta, marker, color=colours[which], **look)
    momentum_ratio = np.nanmedian([d.momentum / d.speed**2 for _, d in results])
    points: style.Look = {"linestyle": "", "markeredgewidth": 0, "markersize": 5}
    axes[0].plot([], [], "o", color=style.BLUE, label="plateau", **points)
    for which, (name, marker) in FITS.items():
        axes[0].plot([], [], marker, color=colours[which], label=f"$p_m$, {name}", **points)
    momentum, dashed = style.line_look(style.BLUE), style.line_look(style.BLACK, 1.0, style.DASHED)
    axes[0].plot(speeds, momentum_ratio * speeds**2 / 1e3, label="momentum", **momentum)
    axes[0].plot(speeds, p_m_fast(speeds) / 1e3, label="S12 eqs 33, 35", **dashed)
    axes[1].plot(speeds, delta_dynamic(speeds), **dashed)
    style.draw_legend(axes[0])
    for panel in axes:
        style.set_logarithmic(panel)
    axes[0].set_ylabel("pressure (kPa)")
    axes[1].set(ylabel=r"$\Delta$ (dex)", xlabel="speed of the wall (m/s)")
    return figure
