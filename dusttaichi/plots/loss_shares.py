"""Where the energy goes while a cell is pressed from all sides, at each filling factor."""

import numpy as np

from dusttaichi.analysis import loss_shares as shares_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Share of each channel in the losses", 55, applies=lambda run: run.shrinks, optional=True)
def loss_shares(run, stage=None):
    """Share of each channel in what a Run loses while its filling factor grows by a tenth of a
    decade (Tatsuuma et al. 2023: rolling below 0.1, sliding and twisting above).

    stage: see `analysis.loss_shares`. Raises DustError where the filling factor grows too little.
    """
    result = shares_of(run, stage)
    figure, (axes,) = style.new_figure()
    for name, share in result.by_channel.items():
        if np.any(share):
            colour = style.CHANNEL_COLOURS.get(name, style.GREY)
            axes.plot(result.filling_factor, share, color=colour, label=name)
    axes.set_xscale("log")
    style.few_ticks(axes.xaxis)
    axes.set_ylim(0.0, None)
    axes.set_xlabel(r"filling factor $\phi$")
    axes.set_ylabel("share of the energy lost")
    style.legend(axes)
    return figure
