"""Vertical profile of the filling factor at several times (S12 Fig 5)."""

from dusttaichi.analysis import profile as profile_of
from dusttaichi.analysis.profile import without_cut_bins
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Filling factor over the height", 150, applies=lambda run: run.profiles is not None)
def profile(run, most=8):
    """Height against filling factor for some profiles of a run.

    Parameters
    ----------
    run : Run
    most : int
        Largest number of profiles.

    Raises
    ------
    DustError
        The result has no profiles.
    """
    profiles = without_cut_bins(profile_of(run, most))
    written = run.profiles.sizes["profile"]
    figure, (axes,) = style.new_figure(height=4.0)
    count = profiles.sizes["profile"]
    colours = style.gradient(count)
    for number in range(count):
        one = profiles.isel(profile=number)
        axes.plot(
            one.filling_factor,
            one.middle * 1e6,
            color=colours[number],
            label=rf"$\phi$ = {float(one.box_filling_factor):.2f}",
        )
        axes.axhline(float(one.height) * 1e6, **style.look(colours[number], 0.6, style.DOTTED))
    axes.set(
        xlim=(0, None),
        ylim=(0, 1.04 * float(profiles.height.max()) * 1e6),
        xlabel=r"filling factor, averaged horizontally",
        ylabel="height above the bottom wall (µm)",
    )
    axes.plot([], [], label="top wall", **style.look(style.GREY, 0.6, style.DOTTED))
    left = f", {count} of {written} profiles" if count < written else ""
    style.legend(axes, title=f"whole box{left}")
    return figure
