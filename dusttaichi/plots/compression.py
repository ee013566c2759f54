"""Filling factor against pressure, with the laboratory behind (S12 Fig 4)."""

import numpy as np

from dusttaichi.analysis import compression_curve, compression_law
from dusttaichi.physics.laws import (
    EXPERIMENT_SCATTER,
    G09_OMNIDIRECTIONAL,
    S12_STATIC,
    UNIDIRECTIONAL,
)
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


def laboratory(axes, pressure, drawn=(S12_STATIC,)):
    """Laws that belong to the runs: of the laboratory, and of S12 where the wall is fast."""
    scatter = f"scatter of the experiment, ±{EXPERIMENT_SCATTER}"
    if S12_STATIC in drawn:
        _scatter(axes, pressure, S12_STATIC, scatter)
        axes.plot(
            pressure / 1e3,
            S12_STATIC.filling_factor(pressure),
            color=style.BLACK,
            linewidth=1.2,
            label="laboratory, S12 eq 31",
        )
        axes.plot(
            pressure / 1e3,
            G09_OMNIDIRECTIONAL.filling_factor(pressure),
            label="laboratory, fit of G09",
            **style.look(style.BLACK, 1.2, style.DASHED),
        )
    if UNIDIRECTIONAL in drawn:
        _scatter(axes, pressure, UNIDIRECTIONAL, None if S12_STATIC in drawn else scatter)
        axes.plot(
            pressure / 1e3,
            UNIDIRECTIONAL.filling_factor(pressure),
            label="laboratory, unidirectional (G09)",
            **style.look(style.BLACK, 1.2, (0, (5, 1, 1, 1))),
        )
    fast = {law.name: law for law in drawn if law not in (S12_STATIC, UNIDIRECTIONAL)}
    for number, law in enumerate(fast.values()):
        axes.plot(
            pressure / 1e3,
            law.filling_factor(pressure),
            label=law.name,
            **style.look(style.BLACK, 1.0, style.RUN_DASHES[number % len(style.RUN_DASHES)]),
        )


def _scatter(axes, pressure, law, label):
    phi = law.filling_factor(pressure)
    axes.fill_between(
        pressure / 1e3,
        phi - EXPERIMENT_SCATTER,
        phi + EXPERIMENT_SCATTER,
        color="#D9D9D9",
        linewidth=0,
        label=label,
    )


@figure("Filling factor against pressure", 40, applies=lambda run: run.compresses, together=True)
def compression(runs, labels=None, laws=(), raw=None):
    """Filling factor against pressure on the top wall for one run or several.

    The laws behind are those of `analysis.compression_law`: the laboratory's, omnidirectional in a
    box, unidirectional between plates, S12's for the speed of a fast wall. Between plates the
    filling factor of the inner cylinder (PD08) is drawn as well, dotted.

    Parameters
    ----------
    runs : Run or list of Run
    labels : list of str, optional
        One for each run. Default: their names.
    laws : sequence of CompressionLaw
        Further laws to draw, thin.
    raw : bool, optional
        Show the unsmoothed points too. Default: with a single run.

    Raises
    ------
    DustError
        A run has no compression curve, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure()
    pressure = np.logspace(1, 7, 301)
    drawn = [compression_law(run) for run in runs]
    laboratory(axes, pressure, drawn)
    for law in laws:
        axes.plot(
            pressure / 1e3,
            law.filling_factor(pressure),
            label=law.name,
            **style.look(style.GREY, 1.0, style.FINE),
        )
    top, bottom = max(law.phi2 for law in drawn) + EXPERIMENT_SCATTER, 0.1
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        curve = compression_curve(run)
        line_style = style.run_style(number)
        if raw or (raw is None and len(runs) == 1):
            style.records(axes, curve.raw_pressure / 1e3, curve.raw_filling_factor, number)
        axes.plot(curve.pressure / 1e3, curve.filling_factor, label=label, **line_style)
        if "inner_filling_factor" in run.series:
            inner = compression_curve(run, of="inner_filling_factor")
            axes.plot(
                inner.pressure / 1e3,
                inner.filling_factor,
                label="inner cylinder",
                **style.look(line_style["color"], 1.2, style.FINE),
            )
            top = max(top, np.max(inner.filling_factor, initial=0) + 0.02)
        top = max(top, np.max(curve.raw_filling_factor, initial=0) + 0.02)
        bottom = min(bottom, np.min(curve.raw_filling_factor, initial=1) - 0.02)
    axes.set(
        xscale="log",
        xlim=(0.05, 2e3),
        ylim=(max(bottom, 0), min(top, 0.8)),
        xlabel="pressure on the top wall (kPa)",
        ylabel=r"filling factor $\phi$",
    )
    style.legend(axes)
    return figure
