"""Pressure against filling factor of a cell pressed from all sides (Kataoka et al. 2013b)."""

import numpy as np

from dusttaichi.analysis import isotropic as isotropic_of
from dusttaichi.physics import laws
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure

LEAST = 1e-6  # of the largest pressure, down to which the axis reaches at most


@figure("Pressure against filling factor", 50, applies=lambda run: run.shrinks, together=True)
def isotropic(runs, labels=None, stage=None):
    """Mean pressure against filling factor for one run or several, on logarithmic axes.

    Lines are (E_roll/r^3) phi^3 (T19 eq 9) and the law of Tatsuuma et al. 2023 for each material;
    a single run shows the records themselves too.

    Parameters
    ----------
    stage : str or int, optional
        As in `analysis.isotropic`.

    Raises
    ------
    DustError
        There is no stress, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    results = [isotropic_of(run, stage) for run in runs]
    figure, (axes,) = style.new_figure()
    raw = np.concatenate([t.raw_filling_factor for t in results])
    phi = np.geomspace(0.8 * raw.min(), min(1.2 * raw.max(), 0.7), 200)
    shown = np.concatenate([t.pressure for t in results])
    materials = {
        (m.surface_energy, m.radius, m.critical_rolling): m.name
        for m in (run.material for run in runs)
        if m
    }
    for numbers, name in materials.items():
        name = f" ({name})" if len(materials) > 1 else ""
        for law, look, text in (
            (laws.isotropic_pressure, "-", r"$(E_{\rm roll}/r^3)\,\phi^3$, T19 eq 9"),
            (
                laws.compressive_strength,
                style.DASHED,
                r"$(E_{\rm roll}/r^3)(1/\phi-1/0.74)^{-3}$, Tatsuuma+ 2023",
            ),
        ):
            axes.plot(
                phi, law(phi, *numbers), label=text + name, **style.look(style.BLACK, 1.1, look)
            )
    for number, (t, label) in enumerate(zip(results, labels, strict=True)):
        look = style.run_style(number)
        if len(runs) == 1:
            up = t.raw_pressure > 0
            style.records(axes, t.raw_filling_factor[up], t.raw_pressure[up], number)
        axes.plot(t.filling_factor, t.pressure, label=label, **look)
    axes.set(xscale="log", yscale="log")
    style.few_ticks(axes.xaxis)
    _limit(axes, shown)
    axes.set(xlabel=r"filling factor $\phi$", ylabel="mean pressure (Pa)")
    style.legend(axes)
    return figure


def _limit(axes, pressure):
    """Fluctuations about no pressure at all reach down as far as numbers do; the axis does not."""
    if len(pressure):
        lowest = max(np.min(pressure[pressure > 0], initial=np.inf), LEAST * pressure.max())
        axes.set_ylim(0.3 * lowest, 10 * pressure.max())
