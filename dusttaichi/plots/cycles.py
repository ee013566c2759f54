"""Loading and unloading: pressure against filling factor, and the unloading moduli."""

import numpy as np

from dusttaichi.analysis.cycles import pressure_of, unloadings
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure

LEAST = 1e-4  # lower end of the axis, over the largest pressure
LINEAR = 1e-2  # with tension the axis is linear below the decade of this share of the pressure
# colour, line width and order of each kind of stage
LOOKS = {
    "loading": (style.BLUE, 0.9, 2),
    "unloading": (style.ORANGE, 1.4, 3),
    "pulling": (style.GREEN, 0.9, 2),
}


@figure("Loading and unloading", 70, applies=lambda run: run.unloads)
def cycles(run):
    """Filling factor against pressure of all stages of a run, and the unloading moduli.

    Below, the modulus of every stage that unloads against its filling factor.

    Raises
    ------
    DustError
        No stage unloads.
    """
    known = [unloading for unloading in unloadings(run) if np.isfinite(unloading.modulus)]
    if known:
        figure, (path, moduli) = style.new_figure(5.6, rows=2, ratios=(1.6, 1.0), shared=False)
        _moduli(moduli, known)
    else:
        figure, (path,) = style.new_figure()
    _path(path, run)
    style.legend(path)
    return figure


def _path(axes, run):
    """Pressure and filling factor of all records of a Run."""
    kinds = {
        part.stage_name: "pulling" if part.stretches else "unloading" if part.unloads else "loading"
        for part in run.parts
    }
    pulled, largest, named = "pulling" in kinds.values(), 0.0, set()
    for part in run.parts:
        records, kind = (part.start, part.series), kinds[part.stage_name]
        pressure = np.hstack([pressure_of(one) for one in records]) / 1e3
        phi = np.hstack([one.filling_factor.values for one in records])
        shown = np.isfinite(pressure) if pulled else pressure > 0.0
        color, width, order = LOOKS[kind]
        label = None if kind in named else kind
        axes.plot(
            pressure[shown], phi[shown], color=color, linewidth=width, zorder=order, label=label
        )
        named.add(kind)
        largest = max(largest, *pressure)
    if pulled:
        decade = np.ceil(np.log10(LINEAR * largest)) if largest > 0.0 else 0.0
        axes.set_xscale("symlog", linthresh=10.0**decade)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.axvline(0.0, color=style.GREY, linewidth=0.6)
    else:
        axes.set_xscale("log")
    if largest > 0.0 and not pulled:
        axes.set_xlim(max(axes.get_xlim()[0], LEAST * largest), 1.5 * largest)
    axes.set(
        xlabel="pressure (kPa)" + (", negative in tension" if pulled else ""),
        ylabel=r"filling factor $\phi$",
    )


def _moduli(axes, known):
    """The modulus of every Release that has one against its filling factor."""
    scale, unit = style.scaled(max(unloading.modulus for unloading in known), style.PRESSURES)
    axes.errorbar(
        [unloading.filling_factor for unloading in known],
        [unloading.modulus * scale for unloading in known],
        [unloading.modulus_sigma * scale for unloading in known],
        fmt="o-",
        color=style.ORANGE,
        markersize=4,
        linewidth=1.0,
    )
    style.logarithmic(axes, "y")
    axes.set(xlabel=r"filling factor $\phi$", ylabel=f"unloading modulus ({unit})")
