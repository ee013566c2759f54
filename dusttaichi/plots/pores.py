"""Sizes of the pores of a snapshot."""

from dusttaichi.analysis.pores import pores as pores_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure
from dusttaichi.plots.structure import has_structure


def _is_bounded(run):
    return has_structure(run) and "box" in run.tree["snapshots"]


@figure("Sizes of the pores", 131, applies=_is_bounded, optional=True)
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
    axes.set_title(f"void fraction {found.void:.3f}", fontsize=8)
    style.legend(axes)
    return figure
