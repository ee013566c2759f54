"""Stress while a sample is stretched (T19 Fig 3)."""

import numpy as np

from dusttaichi.analysis import tensile as tensile_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Stress while it is stretched", 110, applies=lambda run: run.stretches, together=True)
def tensile(runs, labels=None, stage=None):
    """Stress along the axis of stretching against filling factor, for one run or several.

    The averages with their uncertainty, the maximum marked; with a single run the records
    themselves and T19 eq 33 too. Time runs from right to left.

    Parameters
    ----------
    stage : str or int, optional
        As in `analysis.tensile`.

    Raises
    ------
    DustError
        Nothing is stretched, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    results = [tensile_of(run, stage) for run in runs]
    figure, (axes,) = style.new_figure()
    scale, unit = style.scaled(max(abs(t.strength) for t in results), style.PRESSURES)
    for number, (t, label) in enumerate(zip(results, labels, strict=True)):
        line_style = style.run_style(number)
        if len(runs) == 1:
            style.records(axes, t.raw_filling_factor, t.raw_stress * scale, number)
        _averages(axes, t, scale, label=label, number=number)
        axes.plot(
            t.strength_phi,
            t.strength * scale,
            "o",
            markersize=6,
            color=line_style["color"],
            markeredgecolor="white",
            label=_text(t, scale, unit) if len(runs) == 1 else None,
            zorder=4,
        )
    if len(runs) == 1 and np.isfinite(results[0].law):
        (t,) = results
        text = rf"strength by T19 eq 33 for $\phi_{{\rm init}}$ = {t.phi_init:.3g}"
        axes.axhline(t.law * scale, label=text, **style.look(style.BLACK, 1.0, style.DASHED))
    axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    if max(t.strength for t in results) > 10 * min(t.strength for t in results) > 0:
        _logarithmic(axes, results, scale)
    else:
        _linear(axes, results, scale)
    axes.set_xlabel(r"filling factor $\phi$ (stretching proceeds to the left)")
    along = f" along {results[0].axis}" if len({t.axis for t in results}) == 1 else ""
    axes.set_ylabel(f"tensile stress{along} ({unit})")
    style.legend(axes)
    return figure


def _averages(axes, t, scale, *, label, number):
    """The averages of a Tensile, with a band of their uncertainty where it is known."""
    phi, stress = t.filling_factor, t.stress * scale
    if np.isfinite(t.sigma).all():
        style.bands(phi, stress, t.sigma * scale, axes, label=label, number=number)
    else:
        axes.plot(phi, stress, label=label, **style.run_style(number))


def _linear(axes, results, scale):
    low = min(np.min(t.stress - np.nan_to_num(t.sigma)) for t in results) * scale
    high = max(max(t.strength, np.nan_to_num(t.law)) for t in results) * scale
    if high > 0:
        axes.set_ylim(min(1.3 * low, -0.1 * high), 1.5 * high)  # space for the legend
    axes.set_xlim(0.0, 1.04 * max(t.phi_init for t in results))


def _logarithmic(axes, results, scale):
    """For strengths that differ more than tenfold. Where there is pressure nothing is drawn."""
    axes.set(xscale="log", yscale="log")
    style.few_ticks(axes.xaxis)
    strengths = [t.strength * scale for t in results]
    axes.set_ylim(0.05 * min(strengths), 20 * max(strengths))


def _text(t, scale, unit):
    most = "largest average" if t.passed else "so far at least"
    sigma = "" if np.isnan(t.strength_sigma) else f" ± {t.strength_sigma * scale:.2g}"
    return rf"{most}: {t.strength * scale:.3g}{sigma} {unit} at $\phi$ = {t.strength_phi:.3g}"
