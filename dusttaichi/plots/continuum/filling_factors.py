"""Share of the dust by filling factor."""

from dusttaichi.analysis.continuum import has_dust, histogram
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


def _with_dust(run):
    return run.snapshots is not None and has_dust(run)


@figure("Share of the dust by filling factor", 172, applies=_with_dust)
def filling_factors(run):
    """Share of the dust by filling factor, at the start and at the end of a Run."""
    figure, (axes,) = style.new_figure()
    for number, (snapshot, label) in enumerate(((0, "start"), (-1, "end"))):
        edges, share = histogram(run, snapshot)
        axes.stairs(share, edges, label=label, **style.run_style(number))
    style.logarithmic(axes, "y")
    axes.set(xlabel=r"filling factor $\phi$", ylabel="share of the volume")
    style.legend(axes)
    return figure
