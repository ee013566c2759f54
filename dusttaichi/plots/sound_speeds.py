"""Speed of sound of several runs with a push."""

from dusttaichi.analysis.arrival import arrival, sound_speed
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure, in_common
from dusttaichi.plots.sound_speed import label_axes


@figure("Arrival of the waves", 141, together=in_common(lambda run: run.pushes), optional=True)
def sound_speeds(runs, labels=None):
    """Speed of sound against distance for several Runs with a push, each with its fit.

    Raises DustError where a run has no snapshots that tell, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure(height=3.4)
    arrivals = [arrival(run) for run in runs]
    factor, unit = style.scaled(max(a.distance.max() for a in arrivals), style.LENGTHS)
    for number, (found, label) in enumerate(zip(arrivals, labels, strict=True)):
        fit, look = sound_speed(found), style.run_style(number)
        points = {"markersize": 2.5, "markeredgewidth": 0, "alpha": 0.6, "color": look["color"]}
        axes.plot(found.distance * factor, found.speed, "o", **points)
        said = rf"{label}: {fit.speed:.4g} $\pm$ {fit.sigma:.1g} m/s"
        axes.plot([0, found.distance.max() * factor], [fit.speed] * 2, label=said, **look)
    label_axes(axes, unit)
    return figure
