"""Load steps and runs at constant speed."""

import numpy as np

from dusttaichi.analysis.cycles import pressure_of
from dusttaichi.analysis.loads import controlled_loads
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Filling factor under each load", 80, applies=lambda run: bool(controlled_loads(run)))
def loads(run, others=(), labels=None, repeats=()):
    """Filling factor against pressure of a run with load steps.

    The thin line is its path; points are the settled state of each load.

    Parameters
    ----------
    run : Run
    others : sequence of Run
        Runs of the same sample at constant speed, drawn as lines.
    labels : list of str, optional
        Labels of these. Default: their names.
    repeats : sequence of Run
        Runs of the same steps on other samples: points are means, bars standard deviations between
        samples.

    Raises
    ------
    DustError
        No stage controls a pressure.
    """
    found = controlled_loads(run)
    if not found:
        raise DustError(f"{run.path}: no stage controls a pressure; it needs drive: pressure.")
    samples = [found, *(controlled_loads(other) for other in repeats)]
    pressure = np.array([[load.pressure for load in one] for one in samples]) / 1e3
    density = np.array([[load.filling_factor for load in one] for one in samples])
    figure, (axes,) = style.new_figure()
    path = _path(run)
    axes.plot(*path, color=style.GREY, linewidth=0.7, label="under load, not settled")
    names = labels or [other.name.replace("$", r"\$") for other in others]
    for number, (other, label) in enumerate(zip(others, names, strict=True)):
        axes.plot(*_path(other), label=label, **style.run_style(number))
    axes.errorbar(
        pressure.mean(axis=0),
        density.mean(axis=0),
        density.std(axis=0, ddof=1) if repeats else None,
        fmt="o",
        color=style.ORANGE,
        markersize=6,
        capsize=3,
        label="under load, settled",
    )
    axes.set_xscale("log")
    lowest = min(load.wanted for load in found) / 1e3
    # of a load that is not reached the reached pressure
    reached = np.quantile(path[0], 0.9) if len(path[0]) else lowest
    axes.set(
        xlim=(0.1 * min(lowest, reached), 2.0 * max(load.wanted for load in found) / 1e3),
        xlabel="pressure (kPa)",
        ylabel=r"filling factor $\phi$",
    )
    style.legend(axes)
    return figure


def _path(run):
    """Pressure [kPa] and filling factor of all records with a positive pressure."""
    pressure = pressure_of(run.series) / 1e3
    shown = pressure > 0.0
    return pressure[shown], run.series.filling_factor.values[shown]
