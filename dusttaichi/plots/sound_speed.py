"""Speed of sound against the distance from a push (PD08 Fig 7)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dusttaichi.analysis import fit_sound_speed as fit_speed
from dusttaichi.analysis import measure_arrival
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run


@figure(
    "Arrival of the wave",
    140,
    applies=lambda run: bool(run.pushes),
    together=True,
    optional=True,
)
def sound_speed(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Speed of sound against distance, a point for each grain of one run or several with a push.

    Lines are the fits; that of a single run has a band of its standard error.

    Raises
    ------
    DustError
        A run has no snapshots that show the arrival, or labels do not match the runs.
    """
    runs, labels = style.label_runs(runs, labels)
    figure, (axes,) = style.create_figure(height=3.4)
    arrivals = [measure_arrival(run) for run in runs]
    factor, unit = style.choose_unit(max(a.distance.max() for a in arrivals), style.LENGTHS)
    for number, (wave, label) in enumerate(zip(arrivals, labels, strict=True)):
        fit, look = fit_speed(wave), style.run_style(number)
        dots = {"ms": 2.5, "mew": 0, "alpha": 0.65, "color": look["color"], "zorder": 4}
        name = "_"
        if len(runs) == 1:
            name, label, look = "grains: distance / time", "fit", style.line_look(style.RED, 1.6)
            ends = fit.speed - fit.sigma, fit.speed + fit.sigma
            axes.axhspan(*ends, color=style.RED, alpha=0.2, linewidth=0)
        axes.plot(wave.distance * factor, wave.speed, "o", label=name, **dots)
        speed_label = rf"{label}: {fit.speed:.4g} $\pm$ {fit.sigma:.1g} m/s"
        axes.plot([0, wave.distance.max() * factor], [fit.speed] * 2, label=speed_label, **look)
    axes.set(
        xlim=(0.0, None),
        ylim=(0.0, None),
        xlabel=f"distance from the push ({unit})",
        ylabel="speed of sound (m/s)",
    )
    style.draw_legend(axes)
    return figure
