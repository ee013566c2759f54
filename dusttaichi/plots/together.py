"""Figures of several runs of any kind in one: what moves, and how fast a push arrives."""

import numpy as np

from dusttaichi.analysis.arrival import arrival, sound_speed
from dusttaichi.errors import DustError
from dusttaichi.plots import style


@style.styled
def kinetic(runs, labels=None):
    """Kinetic energy over its largest value against time, for several Runs of any kind.

    labels: one for each run (default: their names). Raises DustError where no run has a kinetic
    energy, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    energies = [_kinetic(run) for run in runs]
    if all(energy is None for energy in energies):
        raise DustError("None of these runs tells its kinetic energy.")
    figure, (axes,) = style.new_figure()
    last = max(float(run.series.time[-1]) for run in runs if len(run.series.time))
    per_time, unit = style.scaled(last, style.TIMES)
    for number, (run, energy, label) in enumerate(zip(runs, energies, labels, strict=True)):
        if energy is not None:
            time = run.series.time.values * per_time
            axes.plot(time, energy / energy.max(), label=label, **style.run_style(number))
    axes.set_ylim(0.0, 1.05)
    axes.set_xlabel(f"time ({unit})")
    axes.set_ylabel("kinetic energy over its largest")
    style.legend(axes)
    return figure


def _kinetic(run):
    parts = [run.series[n].values for n in run.series if str(n).startswith("kinetic")]
    total = np.sum(parts, axis=0) if parts else np.zeros(0)
    return total if total.ndim == 1 and len(total) and total.max() > 0.0 else None


@style.styled
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
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, None)
    axes.set_xlabel(f"distance from the push ({unit})")
    axes.set_ylabel("speed of sound (m/s)")
    style.legend(axes)
    return figure
