"""Steps of load beside a constant speed."""

import numpy as np

from dusttaichi.analysis.cycles import pressure_of
from dusttaichi.analysis.loads import controlled_loads
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Filling factor under each load", 80, applies=lambda run: bool(controlled_loads(run)))
def loads(run, others=(), labels=None, repeats=()):
    """Filling factor against pressure where a Run holds pressures, step by step.

    Its path is thin, its points are where each load had settled. others: runs of the same sample at
    a constant speed, drawn as lines; labels: one for each of these (default: their names). repeats:
    runs of the same steps on other samples: points are the means of all, their bars the standard
    deviations between samples. Raises DustError where no pressure is held.
    """
    found = controlled_loads(run)
    if not found:
        raise DustError(f"{run.path}: no stage controls a pressure; it needs drive: pressure.")
    samples = [found, *(controlled_loads(other) for other in repeats)]
    pressure = np.array([[held.pressure for held in one] for one in samples]) / 1e3
    density = np.array([[held.filling_factor for held in one] for one in samples])
    figure, (axes,) = style.new_figure()
    path = _path(run)
    axes.plot(*path, color=style.GREY, linewidth=0.7, label="under load, on the way")
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
    lowest = min(held.wanted for held in found) / 1e3
    # where a load is far from reached, what was
    reached = np.quantile(path[0], 0.9) if len(path[0]) else lowest
    axes.set_xlim(0.1 * min(lowest, reached), 2.0 * max(held.wanted for held in found) / 1e3)
    axes.set_xlabel("pressure (kPa)")
    axes.set_ylabel(r"filling factor $\phi$")
    style.legend(axes)
    return figure


def _path(run):
    """Pressure [kPa] and filling factor of all records with a positive pressure."""
    pressure = pressure_of(run.series) / 1e3
    shown = pressure > 0.0
    return pressure[shown], run.series.filling_factor.values[shown]
