"""Contact network of a snapshot: neighbours, directions, forces, pair correlation."""

import numpy as np
from matplotlib.ticker import MaxNLocator

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
