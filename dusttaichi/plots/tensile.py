"""Stress while a sample is stretched (T19 Fig 3), strengths (T19 Fig 5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from dusttaichi.analysis import fit_strength
from dusttaichi.analysis import measure_tensile_strength as tensile_of
from dusttaichi.errors import DustError
from dusttaichi.physics import laws
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure, select_in_common

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run
    from dusttaichi.analysis.tensile import Tensile


class Cohesive(Protocol):
    """Numbers of a material of grains that T19 eq 33 needs, SI."""

    @property
    def name(self) -> str: ...
    @property
    def surface_energy(self) -> float: ...
    @property
    def radius(self) -> float: ...


@figure("Stress while it is stretched", 110, applies=lambda run: run.stretches, together=True)
def tensile(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Stress along the axis of stretching against filling factor, for one run or several.

    The averages with their uncertainty, the maximum marked; with a single run the records
    themselves and T19 eq 33 too. Time runs from right to left.

    Raises
    ------
    DustError
        Nothing is stretched, or labels do not match the runs.
    """
    runs, labels = style.label_runs(runs, labels)
    results = [tensile_of(run) for run in runs]
    figure, (axes,) = style.create_figure()
    scale, unit = style.choose_unit(max(abs(t.strength) for t in results), style.PRESSURES)
    for number, (t, label) in enumerate(zip(results, labels, strict=True)):
        line_style = style.run_style(number)
        if len(runs) == 1:
            style.draw_records(axes, t.raw_filling_factor, t.raw_stress * scale, number)
        _draw_averages(axes, t, scale, label=label, number=number)
        axes.plot(
            t.strength_phi,
            t.strength * scale,
            "o",
            markersize=6,
            color=line_style["color"],
            markeredgecolor="white",
            label=_describe_strength(t, scale, unit) if len(runs) == 1 else None,
            zorder=4,
        )
    if len(runs) == 1 and np.isfinite(results[0].law):
        (t,) = results
        text = rf"strength by T19 eq 33 for $\phi_{{\rm init}}$ = {t.phi_init:.3g}"
        axes.axhline(t.law * scale, label=text, **style.line_look(style.BLACK, 1.0, style.DASHED))
    axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    if max(t.strength for t in results) > 10 * min(t.strength for t in results) > 0:
        _set_logarithmic(axes, results, scale)
    else:
        _set_linear(axes, results, scale)
    axes.set_xlabel(r"filling factor $\phi$ (stretching proceeds to the left)")
    along = f" along {results[0].axis}" if len({t.axis for t in results}) == 1 else ""
    axes.set_ylabel(f"tensile stress{along} ({unit})")
    style.draw_legend(axes)
    return figure


def _draw_averages(axes: Axes, t: Tensile, scale: float, *, label: str, number: int) -> None:
    """Draw the averages of a Tensile, with a band of their uncertainty where it is known."""
    phi, stress = t.filling_factor, t.stress * scale
    if np.isfinite(t.sigma).all():
        style.draw_bands(phi, stress, t.sigma * scale, axes, label=label, number=number)
    else:
        axes.plot(phi, stress, label=label, **style.run_style(number))


def _set_linear(axes: Axes, results: Sequence[Tensile], scale: float) -> None:
    low = min(np.min(t.stress - np.nan_to_num(t.sigma)) for t in results) * scale
    high = max(max(t.strength, np.nan_to_num(t.law)) for t in results) * scale
    if high > 0:
        axes.set_ylim(min(1.3 * low, -0.1 * high), 1.5 * high)  # space for the legend
    axes.set_xlim(0.0, 1.04 * max(t.phi_init for t in results))


def _set_logarithmic(axes: Axes, results: Sequence[Tensile], scale: float) -> None:
    """Set logarithmic axes, for strengths that differ more than tenfold; pressures are hidden."""
    axes.set(xscale="log", yscale="log")
    style.set_few_ticks(axes.xaxis)
    strengths = [t.strength * scale for t in results]
    axes.set_ylim(0.05 * min(strengths), 20 * max(strengths))


def _describe_strength(t: Tensile, scale: float, unit: str) -> str:
    maximum = "largest average" if t.passed else "so far at least"
    sigma = "" if np.isnan(t.strength_sigma) else f" ± {t.strength_sigma * scale:.2g}"
    return rf"{maximum}: {t.strength * scale:.3g}{sigma} {unit} at $\phi$ = {t.strength_phi:.3g}"


@figure("Tensile strength", 111, together=select_in_common(lambda run: run.stretches))
def strength(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Tensile strength against initial filling factor for several runs, on logarithmic axes.

    With T19 eq 33 for each material among them and, where the runs differ in filling factor, the
    fitted power law. Hollow: the stress had not fallen yet.

    Raises
    ------
    DustError
        Nothing is stretched, or labels do not match the runs.
    """
    runs, labels = style.label_runs(runs, labels)
    return strengths([tensile_of(run) for run in runs], labels, [run.material for run in runs])


@style.apply_style
def strengths(
    results: Sequence[Tensile], labels: Sequence[str], materials: Sequence[Cohesive | None]
) -> Figure:
    """The figure of `strength` of Tensile results, with a label each and the materials of them."""
    if any(t.strength <= 0 for t in results):
        raise DustError(
            "The largest stress of a run is still a pressure: it has no tensile strength to draw."
        )
    figure, (axes,) = style.create_figure()
    scale, unit = style.choose_unit(max(t.strength for t in results), style.PRESSURES)
    phi = [t.phi_init for t in results]
    line = np.geomspace(0.7 * min(phi), 1.4 * max(phi), 100)
    distinct = {(m.surface_energy, m.radius): m for m in materials if m}
    for number, m in enumerate(distinct.values()):
        law = laws.tensile_strength(line, m.surface_energy, m.radius)
        name = f" ({m.name})" if len(distinct) > 1 else ""
        text = rf"T19 eq 33, $0.12\,(F_{{\rm c}}/r^2)\,\phi^{{1.8}}${name}"
        axes.plot(line, law * scale, label=text, **style.law_style(number + 1, 1.2))
    fit = fit_strength(results) if len(distinct) <= 1 else None
    if fit is not None:
        sigma = "" if np.isnan(fit.exponent_sigma) else rf"\pm{fit.exponent_sigma:.2f}"
        text = rf"fit, $\propto\phi^{{{fit.exponent:.2f}{sigma}}}$"
        axes.plot(line, fit.strength(line) * scale, label=text, **style.line_look(style.GREY))
    _draw_points(axes, results, labels, scale)
    style.set_logarithmic(axes)
    axes.set_xlabel(r"initial filling factor $\phi_{\rm init}$")
    axes.set_ylabel(f"tensile strength ({unit})")
    style.draw_legend(axes)
    return figure


def _draw_points(
    axes: Axes, results: Sequence[Tensile], labels: Sequence[str], scale: float
) -> None:
    """Draw a point for each Tensile with its standard error, and the key of the symbols."""
    exceeds_colours = len(results) > len(style.RUN_COLOURS)  # more than there are colours
    for number, (t, label) in enumerate(zip(results, labels, strict=True)):
        colour = style.BLUE if exceeds_colours else style.run_style(number)["color"]
        look: style.Look = {
            "fmt": "o",
            "markersize": 5,
            "capsize": 2,
            "color": colour,
            "label": label,
        }
        look["markerfacecolor"] = colour if t.passed else "white"
        sigma = np.nan_to_num(t.strength_sigma)
        axes.errorbar(t.phi_init, t.strength * scale, sigma * scale, **look)
    if not all(t.passed for t in results):
        hollow: style.Look = {"marker": "o", "color": "none", "markeredgecolor": style.GREY}
        axes.plot([], [], label="hollow: at least, the stress had not fallen yet", **hollow)
    if any(t.strength_sigma > 0 for t in results):
        axes.plot([], [], "|", color=style.GREY, label="bars: standard error of the average")
