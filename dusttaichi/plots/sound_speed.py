"""Speed of sound against the distance from a push (PD08 Fig 7)."""

from dusttaichi.analysis import arrival
from dusttaichi.analysis import sound_speed as fit_speed
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure, in_common


@style.styled
def sound_speed(arrivals, fit=None, references=()):
    """Speed of sound against distance, a point for each grain (PD08 Fig 7).

    Parameters
    ----------
    arrivals : Arrival
    fit : SoundSpeed, optional
        Drawn with its error.
    references : sequence of tuple
        Pairs of a speed [m/s] and its name, for example of a theory.
    """
    figure, (axes,) = style.new_figure(height=3.4)
    factor, unit = style.scaled(arrivals.distance.max(), ((1e-3, "mm"), (1e-6, "µm")))
    dots = {"ms": 2.5, "mew": 0, "alpha": 0.7, "color": style.BLUE, "zorder": 4}
    x = arrivals.distance * factor
    axes.plot(x, arrivals.speed, "o", label="grains: distance / time", **dots)
    if fit is not None:
        text = rf"fit: {fit.speed:.4g} $\pm$ {fit.sigma:.1g} m/s"
        axes.axhline(fit.speed, color=style.RED, zorder=3, label=text)
        ends = fit.speed - fit.sigma, fit.speed + fit.sigma
        axes.axhspan(*ends, color=style.RED, alpha=0.2, linewidth=0)
    for number, (speed, name) in enumerate(references, start=1):
        axes.axhline(speed, label=name, **style.law_style(number))
    label_axes(axes, unit)
    return figure


def label_axes(axes, unit):
    """Labels and legend of the speed of sound against distance; unit: of the distance."""
    axes.set(
        xlim=(0.0, None),
        ylim=(0.0, None),
        xlabel=f"distance from the push ({unit})",
        ylabel="speed of sound (m/s)",
    )
    style.legend(axes)


@figure(
    "Arrival of the wave",
    140,
    name="sound_speed",
    applies=lambda run: bool(run.pushes),
    optional=True,
)
def of_push(run):
    """Speed of sound of a run with a push whose arrival the snapshots show."""
    arrivals = arrival(run)
    return sound_speed(arrivals, fit_speed(arrivals))


@figure("Arrival of the waves", 141, together=in_common(lambda run: run.pushes), optional=True)
def sound_speeds(runs, labels=None):
    """Speed of sound against distance for several runs with a push, each with its fit.

    Raises
    ------
    DustError
        A run has no snapshots that show the arrival, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure(height=3.4)
    arrivals = [arrival(run) for run in runs]
    factor, unit = style.scaled(max(a.distance.max() for a in arrivals), style.LENGTHS)
    for number, (found, label) in enumerate(zip(arrivals, labels, strict=True)):
        fit, look = fit_speed(found), style.run_style(number)
        points = {"markersize": 2.5, "markeredgewidth": 0, "alpha": 0.6, "color": look["color"]}
        axes.plot(found.distance * factor, found.speed, "o", **points)
        said = rf"{label}: {fit.speed:.4g} $\pm$ {fit.sigma:.1g} m/s"
        axes.plot([0, found.distance.max() * factor], [fit.speed] * 2, label=said, **look)
    label_axes(axes, unit)
    return figure
