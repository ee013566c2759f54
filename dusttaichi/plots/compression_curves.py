"""Pressure, filling factor, contacts of a box (S12 Fig 4) and a cell (Kataoka et al. 2013b)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.analysis import choose_compression_law, measure_compression_curve
from dusttaichi.analysis import measure_isotropic_compression as isotropic_of
from dusttaichi.analysis.isotropic import find_law_numbers
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import (
    EXPERIMENT_SCATTER,
    G09_OMNIDIRECTIONAL,
    S12_STATIC,
    UNIDIRECTIONAL,
    isotropic_pressure,
)
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure
from dusttaichi.results.shown import PRESSURES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run
    from dusttaichi.physics.geometry import Floats
    from dusttaichi.physics.laws import CompressionLaw
    from dusttaichi.plots.style import Look


def draw_laboratory_laws(
    axes: Axes, pressure: Floats, drawn: Sequence[CompressionLaw] = (S12_STATIC,)
) -> None:
    """Draw the laws that belong to the runs: of the laboratory, and of S12 for fast walls."""
    scatter = f"scatter of the experiment, ±{EXPERIMENT_SCATTER}"
    bold, dash_dotted = style.line_look(style.BLACK, 1.2), (0, (5, 1, 1, 1))
    if S12_STATIC in drawn:
        _draw_scatter(axes, pressure, S12_STATIC, scatter)
        _draw_law(axes, pressure, S12_STATIC, "laboratory, S12 eq 31", bold)
        dashed = bold | {"linestyle": style.DASHED}
        _draw_law(axes, pressure, G09_OMNIDIRECTIONAL, "laboratory, fit of G09", dashed)
    if UNIDIRECTIONAL in drawn:
        _draw_scatter(axes, pressure, UNIDIRECTIONAL, None if S12_STATIC in drawn else scatter)
        look = bold | {"linestyle": dash_dotted}
        _draw_law(axes, pressure, UNIDIRECTIONAL, "laboratory, unidirectional (G09)", look)
    fast = {law.name: law for law in drawn if law not in (S12_STATIC, UNIDIRECTIONAL)}
    for number, law in enumerate(fast.values()):
        _draw_law(axes, pressure, law, law.name, style.law_style(number))


LEAST = 1e-6  # of the largest pressure, down to which the axis reaches at most


def _draw_law(
    axes: Axes, pressure: Floats, law: CompressionLaw, label: str | None, look: Look
) -> None:
    axes.plot(pressure / 1e3, law.filling_factor(pressure), label=label, **look)


def _draw_scatter(axes: Axes, pressure: Floats, law: CompressionLaw, label: str | None) -> None:
    phi = law.filling_factor(pressure)
    low, high = phi - EXPERIMENT_SCATTER, phi + EXPERIMENT_SCATTER
    axes.fill_between(pressure / 1e3, low, high, label=label, color="#D9D9D9", linewidth=0)


@figure("Filling factor against pressure", 40, applies=lambda run: run.compresses, together=True)
def compression(
    runs: Run | Sequence[Run],
    labels: Sequence[str] | None = None,
    laws: Sequence[CompressionLaw] = (),
) -> Figure:
    """Filling factor against pressure on the top wall for one run or several.

    The laws behind are those of `analysis.choose_compression_law`: the laboratory's,
    omnidirectional in a box, unidirectional between plates, S12's for the speed of a fast wall.
    Between plates the filling factor of the inner cylinder (PD08) is drawn as well, dotted. A
    single run shows the records themselves too.

    Parameters
    ----------
    laws : sequence of CompressionLaw
        Further laws to draw, thin.

    Raises
    ------
    DustError
        A run has no compression curve, or labels do not match the runs.
    """
    runs, labels = style.label_runs(runs, labels)
    figure, (axes,) = style.create_figure()
    pressure = np.logspace(1, 7, 301)
    drawn = [choose_compression_law(run) for run in runs]
    draw_laboratory_laws(axes, pressure, drawn)
    for law in laws:
        _draw_law(axes, pressure, law, law.name, style.line_look(style.GREY, 1.0, style.FINE))
    top, bottom = max(law.phi2 for law in drawn) + EXPERIMENT_SCATTER, 0.1
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        curve = measure_compression_curve(run)
        line_style = style.run_style(number)
        if len(runs) == 1:
            style.draw_records(axes, curve.raw_pressure / 1e3, curve.raw_filling_factor, number)
        axes.plot(curve.pressure / 1e3, curve.filling_factor, label=label, **line_style)
        if "inner_filling_factor" in run.series:
            inner = measure_compression_curve(run, quantity="inner_filling_factor")
            fine = style.line_look(line_style["color"], 1.2, style.FINE)
            axes.plot(inner.pressure / 1e3, inner.filling_factor, label="inner cylinder", **fine)
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
    style.draw_legend(axes)
    return figure


@figure("Pressure against filling factor", 50, applies=lambda run: run.shrinks, together=True)
def isotropic(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Mean pressure against filling factor for one run or several, on logarithmic axes.

    Lines are (E_roll/r^3) phi^3 (T19 eq 9) for each material and modifier of rolling, and, dashed,
    the laws of extensions; a single run shows the records themselves too.

    Raises
    ------
    DustError
        There is no stress, or labels do not match the runs.
    """
    runs, labels = style.label_runs(runs, labels)
    results = [isotropic_of(run) for run in runs]
    drawn = {r"$(E_{\rm roll}/r^3)\,\phi^3$, T19 eq 9": isotropic_pressure, **PRESSURES}
    figure, (axes,) = style.create_figure()
    raw = np.concatenate([t.raw_filling_factor for t in results])
    phi = np.geomspace(0.8 * raw.min(), min(1.2 * raw.max(), 0.7), 200)
    shown = np.concatenate([t.pressure for t in results])
    for numbers, name in _name_laws(runs, labels).items():
        for number, (text, law) in enumerate(drawn.items()):
            look = style.line_look(style.BLACK, 1.1, style.DASHED if number else "-")
            axes.plot(phi, law(phi, *numbers), label=text + name, **look)
    for number, (t, label) in enumerate(zip(results, labels, strict=True)):
        look = style.run_style(number)
        if len(runs) == 1:
            up = t.raw_pressure > 0
            style.draw_records(axes, t.raw_filling_factor[up], t.raw_pressure[up], number)
        axes.plot(t.filling_factor, t.pressure, label=label, **look)
    axes.set(xscale="log", yscale="log")
    style.set_few_ticks(axes.xaxis)
    _limit_pressures(axes, shown)
    axes.set(xlabel=r"filling factor $\phi$", ylabel="mean pressure (Pa)")
    style.draw_legend(axes)
    return figure


def _name_laws(runs: Sequence[Run], labels: Sequence[str]) -> dict[tuple[float, float, float], str]:
    """Endings of the labels of laws, by the numbers of a law: material or first run, if several."""
    runs_by_numbers: dict[tuple[float, float, float], tuple[str, str]] = {}
    for run, label in zip(runs, labels, strict=True):
        numbers, material = find_law_numbers(run), run.material
        if numbers is not None and material is not None:
            runs_by_numbers.setdefault(numbers, (material.name, label))
    names = {numbers: name for numbers, (name, _) in runs_by_numbers.items()}
    if len(set(names.values())) < len(names):  # which differ by their rolling alone, or are custom
        names = {numbers: label for numbers, (_, label) in runs_by_numbers.items()}
    several = len(names) > 1
    return {numbers: f" ({name})" if several else "" for numbers, name in names.items()}


def _limit_pressures(axes: Axes, pressure: Floats) -> None:
    """Limit the axis from below: fluctuations about zero pressure reach down to any power."""
    if len(pressure):
        lowest = max(np.min(pressure[pressure > 0], initial=np.inf), LEAST * pressure.max())
        axes.set_ylim(0.3 * lowest, 10 * pressure.max())


@figure("Contacts", 60, applies=lambda run: run.compresses or run.shrinks)
def coordination(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Mean number of contacts per grain against filling factor, for one run or several.

    Raises
    ------
    DustError
        A run has no filling factor, or labels do not match the runs.
    """
    runs, labels = style.label_runs(runs, labels)
    figure, (axes,) = style.create_figure(height=3.4)
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        if "filling_factor" not in run.series:
            raise DustError(f"{run.path} has no filling factor: it has no volume to fill.")
        axes.plot(
            run.series.filling_factor.values,
            run.series.coordination_number.values,
            label=label,
            **style.run_style(number),
        )
    axes.set(xlabel=r"filling factor $\phi$", ylabel="coordination number", ylim=(0, None))
    style.draw_legend(axes)
    return figure
