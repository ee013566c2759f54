"""Fractal dimension of a fragment."""

import numpy as np

from dusttaichi.analysis.fragments import fragment_dimension as dimension_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure
from dusttaichi.plots.structure import has_structure


def _in_the_open(run):
    return has_structure(run) and "box" not in run.tree["snapshots"]


@figure("Fractal dimension of the largest fragment", 132, applies=_in_the_open, optional=True)
def fragment_dimension(run, snapshot=-1, fragment=0):
    """N(<R) of a fragment of a snapshot of a Run, with the line whose slope is its dimension.

    fragment: its number in the order of falling mass. Raises DustError for one that is too small.
    """
    found = dimension_of(run, snapshot, fragment)
    figure, (axes,) = style.new_figure(height=3.4)
    x = found.radius / found.grain_radius
    axes.plot(x, found.number, "o", color=style.BLUE, label=f"{found.grains} grains")
    line = np.exp(np.mean(np.log(found.number)) - found.dimension * np.mean(np.log(x)))
    axes.plot(x, line * x**found.dimension, color=style.ORANGE, label=f"D = {found.dimension:.2f}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    style.few_ticks(axes.xaxis)
    style.few_ticks(axes.yaxis)
    axes.set_xlabel("R over the mean radius of a grain")
    axes.set_ylabel("grains within R of a grain of the core")
    style.legend(axes)
    return figure
