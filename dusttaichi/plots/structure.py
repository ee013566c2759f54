"""Contact network, pores and fractal dimension of a snapshot."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from dusttaichi.analysis import fractal as fractal_of
from dusttaichi.analysis.pores import pores as pores_of
from dusttaichi.analysis.structure import CENTRES
from dusttaichi.analysis.structure import structure as structure_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure

FEW = 10  # least number of grains


def has_structure(run):
    """True where the last snapshot has the contact forces of FEW grains or more."""
    return run.has_forces and run.grains >= FEW


@figure("Contacts: neighbours, directions, forces", 130, applies=has_structure)
def structure(run, snapshot=-1):
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
    found = structure_of(run, snapshot)
    drawn = [_neighbours, _directions]
    drawn += [_forces] if len(found.normal_force) else []
    drawn += [_correlation] if np.isfinite(found.correlation).any() else []
    figure, axes = style.new_figure(height=1.2 + 1.9 * len(drawn), rows=len(drawn), shared=False)
    for draw, place in zip(drawn, axes, strict=True):
        draw(found, place)
    return figure


def _neighbours(found, axes):
    axes.bar(np.arange(len(found.coordination)), found.coordination, color=style.BLUE, width=0.8)
    axes.xaxis.set_major_locator(MaxNLocator(10, integer=True))
    axes.set(xlabel="grains that a grain touches", ylabel="share of the grains")


def _directions(found, axes):
    """Share of the contacts by the cosine of their angle to each axis: constant if isotropic."""
    bins = np.linspace(0.0, 1.0, 11)
    highest = 1.0
    for column, name in enumerate("xyz"):
        share = np.histogram(np.abs(found.normal[:, column]), bins)[0] / len(found.normal)
        label = f"{name}: fabric {found.fabric[column, column]:.3f}"
        highest = max(highest, 10.0 * share.max())
        axes.stairs(10.0 * share, bins, baseline=None, label=label, **style.run_style(column))
    axes.axhline(1.0, color=style.GREY, linewidth=0.8)
    axes.set(
        ylim=(0, 1.05 * highest),
        xlabel="cosine of the angle of a contact to an axis",
        ylabel="contacts over isotropic",
    )
    style.legend(axes)


def _forces(found, axes):
    scale, unit = 1e9, "nN"
    low, high = np.percentile(found.normal_force, [0.5, 99.5]) * scale
    axes.hist(found.normal_force * scale, np.linspace(low, high, 61), color=style.ORANGE)
    axes.axvline(0.0, color=style.GREY, linewidth=0.8)
    axes.set(xlabel=f"normal force ({unit}), positive for repulsion", ylabel="contacts")


def _correlation(found, axes):
    axes.plot(found.distance, found.correlation, color=style.GREEN)
    axes.axhline(1.0, color=style.GREY, linewidth=0.8)
    axes.set(xlabel="distance (mean diameters)", ylabel="g(r)")
    largest = float(np.nanmax(found.correlation_error))
    if largest > 0.0:
        title = f"about {CENTRES:,} random grains, standard error at most {largest:.2g}"
        axes.set_title(title, fontsize=8)


@figure(
    "Sizes of the pores",
    131,
    applies=lambda run: has_structure(run) and "box" in run.tree["snapshots"],
    optional=True,
)
def pores(run, snapshot=-1):
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
    found = pores_of(run, snapshot)
    figure, (axes,) = style.new_figure(height=3.2)
    factor, unit = style.scaled(found.largest, style.LENGTHS)
    axes.plot(found.radius * factor, found.share, color=style.BLUE)
    axes.axvline(
        found.median * factor,
        label=f"half of the void: {found.median * factor:.3g} {unit}",
        **style.look(style.GREY, 0.8, style.DASHED),
    )
    axes.set(
        xlabel=f"radius of the pore ({unit})",
        ylabel="share in pores at least as large",
        xlim=(0, None),
        ylim=(0, 1.05),
    )
    title = (
        f"void fraction {found.void:.3f} ± {found.void_error:.3f}, {found.points:,} random points"
    )
    axes.set_title(title, fontsize=8)
    style.legend(axes)
    return figure


def _frames(run):
    """True where it is stretched, with at least two snapshots, in a cell without a tilt."""
    frames = run.part_that("stretches").snapshots if run.stretches else None
    return frames is not None and frames.sizes["snapshot"] > 1 and "tilt" not in frames


@figure("Fractal dimension", 113, applies=_frames)
def fractal(run, snapshots=None):
    """N(r < r_in) and its local slope for some snapshots of a run; see `analysis.fractal`.

    Slopes of 2 and 3 are drawn beside the numbers.

    Parameters
    ----------
    run : Run
    snapshots : sequence of int, optional
        As in `analysis.fractal`.

    Raises
    ------
    DustError
        There are no snapshots.
    """
    result = fractal_of(run, snapshots)
    figure, (axes, below) = style.new_figure(height=4.8, rows=2, ratios=[2.4, 1])
    x = result.radius_in / result.grain_radius
    colours = style.gradient(len(result.number))
    phi = result.filling_factor
    per_time, time_unit = style.scaled(result.time.max(), style.TIMES)
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
            **style.look(style.BLACK, 0.9, dashes),
        )
        below.axhline(slope, **style.look(style.BLACK, 0.9, dashes))
    axes.set(xscale="log", yscale="log")
    style.few_ticks(below.xaxis)
    axes.set(ylim=(0.5, 2 * result.number.max()), ylabel=r"grains nearer than $r_{\rm in}$")
    style.legend(axes, ncols=2)
    below.set(
        ylim=(0.0, 4.0), ylabel="local slope $D$", xlabel=r"$r_{\rm in}$ over the radius of a grain"
    )
    return figure
