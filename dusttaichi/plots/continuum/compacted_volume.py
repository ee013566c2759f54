"""Volume of dust denser than a filling factor (G09 Figs 11, 15)."""

from dusttaichi.analysis.continuum import cumulated_volume, laboratory
from dusttaichi.plots import style
from dusttaichi.plots.continuum.dust import intrudes
from dusttaichi.plots.registry import figure


@figure("Volume of the compacted dust", 176, applies=intrudes, together=True)
def compacted_volume(runs, labels=None, scatter=0.0):
    """Volume of dust denser than a filling factor, in volumes of the bead (G09 Figs 11, 15).

    Parameters
    ----------
    scatter : float
        Standard deviation of the filling factors of the laboratory's dust, with which those of a
        run are convolved.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure()
    low, high = laboratory.COMPACTED
    axes.axhspan(low, high, color="#D9D9D9", linewidth=0, label="compacted volume (G09 3.4.2)")
    axes.axvline(
        laboratory.LEAST_COMPARED,
        label="compared from here on (G09 Fig 15)",
        **style.look(style.GREY, 0.8, style.DOTTED),
    )
    ends = []
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        found = cumulated_volume(run, scatter=scatter)
        axes.plot(found.filling_factor, found.volume, label=label, **style.run_style(number))
        ends.append(found.filling_factor[-1])
    axes.set(
        xlim=(0.14, max(0.3, *ends)),
        ylim=(0.0, 3.0),
        xlabel=r"filling factor $\phi$",
        ylabel="volume that is denser (volumes of the bead)",
    )
    style.legend(axes)
    return figure
