"""Contact network, pores and fractal dimension of a snapshot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from dusttaichi.analysis import measure_fractal
from dusttaichi.analysis.pores import measure_pores
from dusttaichi.analysis.structure import CENTRES, measure_structure
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run
    from dusttaichi.analysis.structure import Structure

FEW = 10  # least number of grains


def has_structure(run: Run) -> bool:
    """True where the last snapshot has the contact forces of FEW grains or more."""
    return run.has_forces and (run.grains or 0) >= FEW


def has_box(run: Run) -> bool:
    """True where the snapshots have the walls or the faces of the cell."""
    return run.snapshots is not None and "box" in run.snapshots


@figure("Contacts: neighbours, directions, forces", 130, applies=has_structure)
def structure(run: Run, snapshot: int = -1) -> Figure:
    """Neighbours, directions and normal forces of contacts, and pair correlation of a snapshot.

    Quantities that the run does not have are left out.

    Parameters
    ----------
    run : Run
    snapshot : int

    Raises
    ------
    DustError
        The snapshot has no contacts.
    """
    network = measure_structure(run, snapshot)
    panels = [_draw_neighbours, _draw_directions]
    panels += [_draw_forces] if len(network.normal_force) else []
    panels += [_draw_correlation] if np.isfinite(network.correlation).any() else []
    height = 1.2 + 1.9 * len(panels)
    figure, axes = style.create_figure(height=height, rows=len(panels), shared=False)
    for draw_panel, panel_axes in zip(panels, axes, strict=True):
        draw_panel(network, panel_axes)
    return figure


def _draw_neighbours(network: Structure, axes: Axes) -> None:
    axes.bar(
        np.arange(len(network.coordination)), network.coordination, color=style.BLUE, width=0.8
    )
    axes.xaxis.set_major_locator(MaxNLocator(10, integer=True))
    axes.set(xlabel="grains that a grain touches", ylabel="share of the grains")


def _draw_directions(network: Structure, axes: Axes) -> None:
    """Draw the contacts by the cosine of their angle to each axis: constant if isotropic."""
    bins = np.linspace(0.0, 1.0, 11)
    highest = 1.0
    for column, name in enumerate("xyz"):
        fractions = np.histogram(np.abs(network.normal[:, column]), bins)[0] / len(network.normal)
        label = f"{name}: fabric {network.fabric[column, column]:.3f}"
        highest = max(highest, 10.0 * fractions.max())
        axes.stairs(10.0 * fractions, bins, baseline=None, label=label, **style.run_style(column))
    axes.axhline(1.0, color=style.GREY, linewidth=0.8)
    axes.set(
        ylim=(0, 1.05 * highest),
        xlabel="cosine of the angle of a contact to an axis",
        ylabel="contacts over isotropic",
    )
    style.draw_legend(axes)


def _draw_forces(network: Structure, axes: Axes) -> None:
    scale, unit = 1e9, "nN"
    low, high = np.percentile(network.normal_force, [0.5, 99.5]) * scale
    axes.hist(network.normal_force * scale, bins=60, range=(low, high), color=style.ORANGE)
    axes.axvline(0.0, color=style.GREY, linewidth=0.8)
    axes.set(xlabel=f"normal force ({unit}), positive for repulsion", ylabel="contacts")


def _draw_correlation(network: Structure, axes: Axes) -> None:
    axes.plot(network.distance, network.correlation, color=style.GREEN)
    axes.axhline(1.0, color=style.GREY, linewidth=0.8)
    axes.set(xlabel="distance (mean diameters)", ylabel="g(r)")
    largest = float(np.nanmax(network.correlation_error))
    if largest > 0.0:
        title = f"about {CENTRES:,} random grains, standard error at most {largest:.2g}"
        axes.set_title(title, fontsize="small")


@figure(
    "Sizes of the pores",
    131,
    applies=lambda run: has_structure(run) and has_box(run),
    optional=True,
)
def pores(run: Run, snapshot: int = -1) -> Figure:
    """Share of the void in pores of at least a radius, for a snapshot of a run.

    Parameters
    ----------
    run : Run
    snapshot : int

    Raises
    ------
    DustError
        The boundary is open.
    """
    void_pores = measure_pores(run, snapshot)
    figure, (axes,) = style.create_figure(height=3.2)
    factor, unit = style.choose_unit(void_pores.largest, style.LENGTHS)
    axes.plot(void_pores.radius * factor, void_pores.share, color=style.BLUE)
    axes.axvline(
        void_pores.median * factor,
        label=f"half of the void: {void_pores.median * factor:.3g} {unit}",
        **style.line_look(style.GREY, 0.8, style.DASHED),
    )
    axes.set(
        xlabel=f"radius of the pore ({unit})",
        ylabel="share in pores at least as large",
        xlim=(0, None),
        ylim=(0, 1.05),
    )
    title = (
        f"void fraction {void_pores.void:.3f} ± {void_pores.void_error:.3f}, "
        f"{void_pores.points:,} random points"
    )
    axes.set_title(title, fontsize="small")
    style.draw_legend(axes)
    return figure


def _has_frames(run: Run) -> bool:
    """True where a run is stretched, with at least two snapshots, in a cell without a tilt."""
    frames = run.part_that("stretches").snapshots if run.stretches else None
    return frames is not None and frames.sizes["snapshot"] > 1 and "tilt" not in frames


@figure("Fractal dimension", 113, applies=_has_frames)
def fractal(run: Run, snapshots: Sequence[int] | None = None) -> Figure:
    """N(r < r_in) and its local slope for some snapshots of a run; see `analysis.measure_fractal`.

    Slopes of 2 and 3 are drawn beside the numbers.

    Parameters
    ----------
    run : Run
    snapshots : sequence of int, optional
        As in `analysis.measure_fractal`.

    Raises
    ------
    DustError
        There are no snapshots.
    """
    result = measure_fractal(run, snapshots)
    figure, (axes, below) = style.create_figure(height=4.8, rows=2, ratios=[2.4, 1])
    x = result.radius_in / result.grain_radius
    colours = style.sample_gradient(len(result.number))
    phi = result.filling_factor
    per_time, time_unit = style.choose_unit(result.time.max(), style.TIMES)
    for number, colour in enumerate(colours):
        text = rf"$\phi$ = {phi[number]:.3g}"
        if np.isnan(phi[number]):
            text = f"{result.time[number] * per_time:.3g} {time_unit}"
        if np.isfinite(result.dimension[number]):
            text += rf", $D$ = {result.dimension[number]:.2f}"
        shown = np.where(result.number[number] > 0, result.number[number], np.nan)
        axes.plot(x, shown, color=colour, linewidth=1.3, label=text)
        below.plot(x, result.slope[number], color=colour, linewidth=1.1)
    first = result.number[0]
    for slope, dashes, at in ((2, style.DASHED, np.argmax(first >= 1)), (3, style.FINE, -1)):
        line = first[at] * (x / x[at]) ** slope
        axes.plot(
            x,
            line,
            label=rf"$\propto r_{{\rm in}}^{slope}$",
            **style.line_look(style.BLACK, 0.9, dashes),
        )
        below.axhline(slope, **style.line_look(style.BLACK, 0.9, dashes))
    axes.set(xscale="log", yscale="log")
    style.set_few_ticks(below.xaxis)
    axes.set(ylim=(0.5, 2 * result.number.max()), ylabel=r"grains nearer than $r_{\rm in}$")
    style.draw_legend(axes, ncols=2)
    below.set(
        ylim=(0.0, 4.0), ylabel="local slope $D$", xlabel=r"$r_{\rm in}$ over the radius of a grain"
    )
    return figure
