"""Loading and unloading: pressure against filling factor, and the unloading moduli."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.analysis.cycles import compute_pressure, measure_unloadings
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.analysis.cycles import Unloading
    from dusttaichi.analysis.run import Run

LEAST = 1e-4  # lower end of the axis, over the largest pressure
LINEAR = 1e-2  # with tension the axis is linear below the decade of this share of the pressure
# colour, line width and order of each kind of stage
LOOKS = {
    "loading": (style.BLUE, 0.9, 2),
    "unloading": (style.ORANGE, 1.4, 3),
    "pulling": (style.GREEN, 0.9, 2),
}


@figure("Loading and unloading", 70, applies=lambda run: run.unloads)
def cycles(run: Run) -> Figure:
    """Filling factor against pressure of all stages of a run, and the unloading moduli.

    Below, the modulus of every stage that unloads against its filling factor.

    Raises
    ------
    DustError
        No stage unloads.
    """
    measured = [
        unloading for unloading in measure_unloadings(run) if np.isfinite(unloading.modulus)
    ]
    if measured:
        figure, (path, moduli) = style.create_figure(5.6, rows=2, ratios=(1.6, 1.0), shared=False)
        _draw_moduli(moduli, measured)
    else:
        figure, (path,) = style.create_figure()
    _draw_path(path, run)
    style.draw_legend(path)
    return figure


def _draw_path(axes: Axes, run: Run) -> None:
    """Draw filling factor against pressure of all records of a Run, a line for each stage."""
    branches = {
        segment.stage_name: "pulling"
        if segment.stretches
        else "unloading"
        if segment.unloads
        else "loading"
        for segment in run.parts
    }
    has_tension, largest, labelled = "pulling" in branches.values(), 0.0, set()
    for segment in run.parts:
        records, branch = (segment.start, segment.series), branches[segment.stage_name]
        pressure = np.hstack([compute_pressure(record) for record in records]) / 1e3
        phi = np.hstack([record.filling_factor.values for record in records])
        shown = np.isfinite(pressure) if has_tension else pressure > 0.0
        color, width, order = LOOKS[branch]
        label = None if branch in labelled else branch
        axes.plot(
            pressure[shown], phi[shown], color=color, linewidth=width, zorder=order, label=label
        )
        labelled.add(branch)
        largest = max(largest, *pressure)
    if has_tension:
        decade = np.ceil(np.log10(LINEAR * largest)) if largest > 0.0 else 0.0
        axes.set_xscale("symlog", linthresh=10.0**decade)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.axvline(0.0, color=style.GREY, linewidth=0.6)
    else:
        axes.set_xscale("log")
    if largest > 0.0 and not has_tension:
        axes.set_xlim(max(axes.get_xlim()[0], LEAST * largest), 1.5 * largest)
    axes.set(
        xlabel="pressure (kPa)" + (", negative in tension" if has_tension else ""),
        ylabel=r"filling factor $\phi$",
    )


def _draw_moduli(axes: Axes, measured: Sequence[Unloading]) -> None:
    """Draw the modulus of unloadings that have one against their filling factor."""
    scale, unit = style.choose_unit(
        max(unloading.modulus for unloading in measured), style.PRESSURES
    )
    axes.errorbar(
        [unloading.filling_factor for unloading in measured],
        [unloading.modulus * scale for unloading in measured],
        [unloading.modulus_sigma * scale for unloading in measured],
        fmt="o-",
        color=style.ORANGE,
        markersize=4,
        linewidth=1.0,
    )
    style.set_logarithmic(axes, "y")
    axes.set(xlabel=r"filling factor $\phi$", ylabel=f"unloading modulus ({unit})")
