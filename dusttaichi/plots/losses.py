"""Where the energy went while a sample was stretched (T19 Fig 9)."""

from dusttaichi.analysis import losses_against_filling_factor, tensile
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Losses by channel", 112, applies=lambda run: run.stretches)
def losses(run, stage=None):
    """Energy lost since the start of the stage by channel against filling factor of a Run.

    Where it is stretched a line marks the largest stress. stage: name or number (default: the
    first that stretches). Raises DustError where there is no filling factor.
    """
    result = losses_against_filling_factor(run, stage)
    figure, (axes,) = style.new_figure()
    scale, unit = style.scaled(max(result.total.max(), 0.0), style.ENERGIES)
    axes.plot(result.filling_factor, result.total * scale, color=style.BLACK, label="all losses")
    for name, energy in result.by_channel.items():
        axes.plot(
            result.filling_factor,
            energy * scale,
            linewidth=1.3,
            label=f"by {name}",
            color=style.CHANNEL_COLOURS.get(name, style.GREY),
        )
    if run.part_that("stretches", stage).stretches:
        axes.axvline(
            tensile(run, stage).strength_phi,
            color=style.GREY,
            linewidth=1.0,
            linestyle=(0, (4, 2)),
            label="largest stress",
        )
    axes.set_ylim(0.0, None)
    axes.set_xlabel(r"filling factor $\phi$")
    axes.set_ylabel(f"energy lost ({unit})")
    style.legend(axes)
    return figure
