"""Vertical profile of the filling factor at several times (S12 Fig 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dusttaichi.analysis import read_profiles as profile_of
from dusttaichi.analysis.profile import join_cut_bins
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure
from dusttaichi.results.datasets import take_record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run


@figure("Filling factor over the height", 150, applies=lambda run: run.profiles is not None)
def profile(run: Run, max_profiles: int = 8) -> Figure:
    """Height against filling factor for some profiles of a run.

    Parameters
    ----------
    run : Run
    max_profiles : int
        Largest number of profiles.

    Raises
    ------
    DustError
        The result has no profiles.
    """
    profiles = join_cut_bins(profile_of(run, max_profiles))
    written = 0 if run.profiles is None else run.profiles.sizes["profile"]
    figure, (axes,) = style.create_figure(height=4.0)
    count = profiles.sizes["profile"]
    colours = style.sample_gradient(count)
    for number in range(count):
        layer_means = take_record(profiles, "profile", number)
        axes.plot(
            layer_means.filling_factor.values,
            layer_means.middle.values * 1e6,
            color=colours[number],
            label=rf"$\phi$ = {float(layer_means.box_filling_factor):.2f}",
        )
        axes.axhline(
            float(layer_means.height) * 1e6, **style.line_look(colours[number], 0.6, style.DOTTED)
        )
    axes.set(
        xlim=(0, None),
        ylim=(0, 1.04 * float(profiles.height.values.max()) * 1e6),
        xlabel=r"filling factor, averaged horizontally",
        ylabel="height above the bottom wall (µm)",
    )
    axes.plot([], [], label="top wall", **style.line_look(style.GREY, 0.6, style.DOTTED))
    remark = f", {count} of {written} profiles" if count < written else ""
    style.draw_legend(axes, title=f"whole box{remark}")
    return figure
