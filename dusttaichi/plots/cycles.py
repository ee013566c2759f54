"""Loading and letting go: the path of pressure and filling factor, and the moduli of letting go."""

import numpy as np

from dusttaichi.analysis.cycles import pressure_of, releases
from dusttaichi.plots import style

LEAST = 1e-4  # of the largest pressure, down to which the axis reaches at most


@style.styled
def cycles(run):
    """Filling factor against pressure over all stages of a Run, and below it the modulus of every
    stage that lets go against its filling factor. Raises DustError where nothing is let go."""
    known = [release for release in releases(run) if np.isfinite(release.modulus)]
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
    largest, names = 0.0, {True: "unloading", False: "loading"}
    for part in run.parts:
        lets_go = part.unloads
        records = (part.start, part.series)
        pressure = np.hstack([pressure_of(one) for one in records]) / 1e3
        phi = np.hstack([one.filling_factor.values for one in records])
        shown = pressure > 0.0
        axes.plot(
            pressure[shown],
            phi[shown],
            color=style.ORANGE if lets_go else style.BLUE,
            linewidth=1.4 if lets_go else 0.9,
            zorder=3 if lets_go else 2,
            label=names.pop(lets_go, None),
        )
        largest = max(largest, *pressure)
    axes.set_xscale("log")
    if largest > 0.0:
        axes.set_xlim(max(axes.get_xlim()[0], LEAST * largest), 1.5 * largest)
    axes.set_xlabel("pressure (kPa)")
    axes.set_ylabel(r"filling factor $\phi$")


def _moduli(axes, known):
    """The modulus of every Release that has one against its filling factor."""
    scale, unit = style.scaled(max(release.modulus for release in known), style.PRESSURES)
    axes.errorbar(
        [release.filling_factor for release in known],
        [release.modulus * scale for release in known],
        [release.modulus_sigma * scale for release in known],
        fmt="o-",
        color=style.ORANGE,
        markersize=4,
        linewidth=1.0,
    )
    axes.set_xlabel(r"filling factor $\phi$")
    axes.set_ylabel(f"unloading modulus ({unit})")
    axes.set_yscale("log")
    style.few_ticks(axes.yaxis)
