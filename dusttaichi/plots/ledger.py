"""The energy ledger: where the work of walls and faces went, and what is left unexplained."""

import numpy as np

from dusttaichi.analysis import ledger as ledger_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure

SHOWN = 1e-5  # of the largest residual: what is smaller, as that of the first records, says nothing


@figure("Energy", 10, applies=lambda run: len(run.series.time) > 1 and "loss" in run.series)
def ledger(run):
    """Losses by channel on top of each other, the work, and the residual of a Run over time.

    The sum of the losses must follow the dashed line, the work less what is stored. The lower
    panel shows the residual over the energy that has gone through the system.
    """
    energies = ledger_of(run)
    figure, (axes, below) = style.new_figure(height=4.8, rows=2, ratios=[3, 1])
    per_time, time_unit = style.scaled(np.max(energies.time, initial=0.0), style.TIMES)
    lost = {name: values for name, values in energies.losses.items() if np.any(values)}
    kept = energies.work - energies.stored
    sizes = (energies.work, kept, sum(energies.losses.values()))
    largest = max(np.max(np.abs(values), initial=0.0) for values in sizes)
    per_energy, energy_unit = style.scaled(largest, style.ENERGIES)
    time = energies.time * per_time
    if lost:
        axes.stackplot(
            time,
            [values * per_energy for values in lost.values()],
            labels=[f"lost by {name}" for name in lost],
            colors=[style.CHANNEL_COLOURS.get(name, style.GREY) for name in lost],
            linewidth=0,
        )
    done = "work done from outside"
    axes.plot(time, energies.work * per_energy, color=style.BLACK, label=done)
    axes.plot(
        time,
        kept * per_energy,
        color=style.BLACK,
        linewidth=1.2,
        linestyle=(0, (4, 2)),
        label="work less what is stored",
    )
    axes.set_ylabel(f"energy since the start ({energy_unit})")
    axes.set_xlim(time[0], time[-1])
    axes.margins(y=0.05)
    shown = np.where(energies.relative == 0, np.nan, np.abs(energies.relative))
    below.semilogy(time, shown, color=style.RED, linewidth=1.0)
    top = np.max(shown[np.isfinite(shown)], initial=0.0)
    if top > 0.0:
        below.set_ylim(SHOWN * top, 3.0 * top)
    below.set_ylabel("relative\nresidual")
    style.name_stages(axes, run, per_time)
    below.set_xlabel(f"time ({time_unit})")
    handles, labels = axes.get_legend_handles_labels()
    work = labels.index(done)
    order = [work, work + 1, *reversed(range(work))]  # as they lie above each other
    style.legend(axes, [handles[i] for i in order], [labels[i] for i in order], ncols=2)
    return figure
