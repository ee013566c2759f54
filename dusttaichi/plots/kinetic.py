"""Kinetic energy of several runs of any kind."""

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


def _in_motion(runs, others):
    """All of several Runs, where they collide, or have nothing else in common."""
    return runs if len(runs) > 1 and (all(r.collides for r in runs) or not others) else []


@figure("Kinetic energy", 1000, together=_in_motion, optional=True)
def kinetic(runs, labels=None):
    """Kinetic energy over its largest value against time, for several runs of any kind.

    Raises
    ------
    DustError
        No run has a kinetic energy, or labels do not match the runs.
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
    axes.set(ylim=(0.0, 1.05), xlabel=f"time ({unit})", ylabel="kinetic energy over its largest")
    style.legend(axes)
    return figure


def _kinetic(run):
    parts = [run.series[n].values for n in run.series if str(n).startswith("kinetic")]
    total = np.sum(parts, axis=0) if parts else np.zeros(0)
    return total if total.ndim == 1 and len(total) and total.max() > 0.0 else None
