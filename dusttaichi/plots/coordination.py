"""Coordination number against filling factor."""

from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Contacts", 60, applies=lambda run: run.compresses or run.shrinks)
def coordination(runs, labels=None):
    """Mean number of contacts per grain against filling factor, for one run or several.

    Raises
    ------
    DustError
        A run has no filling factor, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure(height=3.4)
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        if "filling_factor" not in run.series:
            raise DustError(f"{run.path} has no filling factor: it has no volume to fill.")
        axes.plot(
            run.series.filling_factor,
            run.series.coordination_number,
            label=label,
            **style.run_style(number),
        )
    axes.set(xlabel=r"filling factor $\phi$", ylabel="coordination number", ylim=(0, None))
    style.legend(axes)
    return figure
