"""Sizes of the pores of a snapshot."""

from dusttaichi.analysis.pores import pores as pores_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure
from dusttaichi.plots.structure import has_structure


def _in_a_room(run):
    return has_structure(run) and "box" in run.tree["snapshots"]


@figure("Sizes of the pores", 131, applies=_in_a_room, optional=True)
def pores(run, snapshot=-1):
    """Share of the void in pores of at least a radius, for a snapshot of a Run.

    Raises DustError where its room is open.
    """
    found = pores_of(run, snapshot)
    figure, (axes,) = style.new_figure(height=3.2)
    factor, unit = style.scaled(found.largest, style.LENGTHS)
    axes.plot(found.radius * factor, found.share, color=style.BLUE)
    axes.axvline(
        found.median * factor,
        color=style.GREY,
        linewidth=0.8,
        linestyle=(0, (4, 2)),
        label=f"half of the void: {found.median * factor:.3g} {unit}",
    )
    axes.set_xlabel(f"radius of the pore ({unit})")
    axes.set_ylabel("share in pores at least as large")
    axes.set_xlim(0, None)
    axes.set_ylim(0, 1.05)
    axes.set_title(f"void: {found.void:.3f} of the room", fontsize=8)
    style.legend(axes)
    return figure
