"""Loading and letting go: the path of pressure and filling factor, and the moduli of letting go."""

import numpy as np

from dusttaichi.analysis.cycles import pressure_of, releases
from dusttaichi.plots import style


@style.styled
def cycles(run):
    """Filling factor against pressure over all stages of a Run, and below it the modulus of every
    stage that lets go against its filling factor. Raises DustError where nothing is let go."""
    found = releases(run)
    figure, (path, moduli) = style.new_figure(height=5.6, rows=2, ratios=(1.6, 1.0), shared=False)
    names = {True: "unloading", False: "loading"}
    for part in run.parts:
        lets_go = part.unloads
        records = [part.start] + [part.series.isel(time=k) for k in range(len(part.series.time))]
        pressure = np.array([pressure_of(record) for record in records]) / 1e3
        phi = np.array([float(record.filling_factor) for record in records])
        shown = pressure > 0.0
        path.plot(
            pressure[shown],
            phi[shown],
            color=style.ORANGE if lets_go else style.BLUE,
            linewidth=1.4 if lets_go else 0.9,
            zorder=3 if lets_go else 2,
            label=names.pop(lets_go, None),
        )
    path.set_xscale("log")
    path.set_xlabel("pressure (kPa)")
    path.set_ylabel(r"filling factor $\phi$")
    style.legend(path)
    known = [release for release in found if np.isfinite(release.modulus)]
    phi = [release.filling_factor for release in known]
    scale, unit = style.scaled(max((r.modulus for r in known), default=1.0), style.PRESSURES)
    moduli.errorbar(
        phi,
        [release.modulus * scale for release in known],
        [release.modulus_sigma * scale for release in known],
        fmt="o-",
        color=style.ORANGE,
        markersize=4,
        linewidth=1.0,
    )
    moduli.set_xlabel(r"filling factor $\phi$")
    moduli.set_ylabel(f"unloading modulus ({unit})")
    if known:
        moduli.set_yscale("log")
        style.few_ticks(moduli.yaxis)
    return figure
