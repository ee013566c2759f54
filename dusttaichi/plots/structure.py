"""Directions and forces of the contacts of a snapshot, neighbours, and distances of grains."""

import numpy as np

from dusttaichi.analysis.structure import structure as structure_of
from dusttaichi.plots import style


@style.styled
def structure(run, snapshot=-1):
    """Neighbours of a grain, normal forces of contacts and the pair correlation of a snapshot of a
    Run, as far as it has them. Raises DustError where it has no contacts."""
    found = structure_of(run, snapshot)
    drawn = [_neighbours]
    drawn += [_forces] if len(found.normal_force) else []
    drawn += [_correlation] if np.isfinite(found.correlation).any() else []
    figure, axes = style.new_figure(height=1.2 + 1.9 * len(drawn), rows=len(drawn), shared=False)
    for draw, place in zip(drawn, axes, strict=True):
        draw(found, place)
    diagonal = ", ".join(f"{value:.3f}" for value in np.diag(found.fabric))
    axes[0].set_title(f"fabric tensor, diagonal {diagonal}", fontsize=8)
    return figure


def _neighbours(found, axes):
    axes.bar(np.arange(len(found.coordination)), found.coordination, color=style.BLUE, width=0.8)
    axes.set_xlabel("grains that a grain touches")
    axes.set_ylabel("share of the grains")


def _forces(found, axes):
    scale, unit = 1e9, "nN"
    low, high = np.percentile(found.normal_force, [0.5, 99.5]) * scale
    axes.hist(found.normal_force * scale, np.linspace(low, high, 61), color=style.ORANGE)
    axes.axvline(0.0, color=style.GREY, linewidth=0.8)
    axes.set_xlabel(f"normal force ({unit}), positive where it pushes")
    axes.set_ylabel("contacts")


def _correlation(found, axes):
    axes.plot(found.distance, found.correlation, color=style.GREEN)
    axes.axhline(1.0, color=style.GREY, linewidth=0.8)
    axes.set_xlabel("distance (mean diameters)")
    axes.set_ylabel("g(r)")
