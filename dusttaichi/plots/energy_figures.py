"""Energies of a run with their losses by channel, and kinetic energies of several runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.analysis import compute_ledger as ledger_of
from dusttaichi.analysis import measure_losses, measure_tensile_strength
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run
    from dusttaichi.physics.geometry import Floats

SHOWN = 1e-5  # smallest residual shown, over the largest


@figure("Energy", 10, applies=lambda run: len(run.series.time) > 1 and "loss" in run.series)
def ledger(run: Run) -> Figure:
    """Losses by channel (stacked), work and residual of a Run over time.

    The sum of the losses must follow the dashed line, the work less the stored energy. The lower
    panel shows the residual over the energy that has gone through the system.
    """
    energies = ledger_of(run)
    figure, (axes, below) = style.create_figure(height=4.8, rows=2, ratios=[3, 1])
    per_time, time_unit = style.choose_unit(np.max(energies.time, initial=0.0), style.TIMES)
    lost = {name: values for name, values in energies.losses.items() if np.any(values)}
    dissipated = energies.work - energies.stored
    sizes = (energies.work, dissipated, sum(energies.losses.values()))
    largest = max(np.max(np.abs(values), initial=0.0) for values in sizes)
    per_energy, energy_unit = style.choose_unit(largest, style.ENERGIES)
    time = energies.time * per_time
    if lost:
        axes.stackplot(
            time,
            [values * per_energy for values in lost.values()],
            labels=[f"lost by {name}" for name in lost],
            colors=[style.CHANNEL_COLOURS.get(name, style.GREY) for name in lost],
            linewidth=0,
        )
    work_label = "work done from outside"
    axes.plot(time, energies.work * per_energy, color=style.BLACK, label=work_label)
    axes.plot(
        time,
        dissipated * per_energy,
        label="work less what is stored",
        **style.line_look(style.BLACK, 1.2, style.DASHED),
    )
    axes.set(ylabel=f"energy since the start ({energy_unit})", xlim=(time[0], time[-1]))
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
    work = labels.index(work_label)
    order = [work, work + 1, *reversed(range(work))]  # as they lie above each other
    style.draw_legend(axes, [handles[i] for i in order], [labels[i] for i in order], ncols=2)
    return figure


@figure("Losses by channel", 112, applies=lambda run: run.stretches)
def losses(run: Run) -> Figure:
    """Energy lost by channel against filling factor, since the start of the stage that stretches.

    In a run that is stretched a line marks the largest stress.

    Raises
    ------
    DustError
        There is no filling factor.
    """
    result = measure_losses(run)
    figure, (axes,) = style.create_figure()
    scale, unit = style.choose_unit(max(result.total.max(), 0.0), style.ENERGIES)
    axes.plot(result.filling_factor, result.total * scale, color=style.BLACK, label="all losses")
    for name, energy in result.by_channel.items():
        axes.plot(
            result.filling_factor,
            energy * scale,
            linewidth=1.3,
            label=f"by {name}",
            color=style.CHANNEL_COLOURS.get(name, style.GREY),
        )
    if run.stretches:
        axes.axvline(
            measure_tensile_strength(run).strength_phi,
            label="largest stress",
            **style.line_look(style.GREY, 1.0, style.DASHED),
        )
    axes.set(ylim=(0.0, None), xlabel=r"filling factor $\phi$", ylabel=f"energy lost ({unit})")
    style.draw_legend(axes)
    return figure


def _select_moving(runs: Sequence[Run], figure_names: Sequence[str]) -> list[Run]:
    """All of several Runs, where they collide, or have nothing else in common."""
    return (
        list(runs) if len(runs) > 1 and (all(r.collides for r in runs) or not figure_names) else []
    )


@figure("Kinetic energy", 1000, together=_select_moving, optional=True)
def kinetic(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Kinetic energy over its largest value against time, for several runs of any kind.

    Raises
    ------
    DustError
        No run has a kinetic energy, or labels do not match the runs.
    """
    runs, labels = style.label_runs(runs, labels)
    energies = [_sum_kinetic(run) for run in runs]
    if all(energy is None for energy in energies):
        raise DustError("None of these runs has records of its kinetic energy.")
    figure, (axes,) = style.create_figure()
    last = max(float(run.series.time[-1]) for run in runs if len(run.series.time))
    per_time, unit = style.choose_unit(last, style.TIMES)
    for number, (run, energy, label) in enumerate(zip(runs, energies, labels, strict=True)):
        if energy is not None:
            time = run.series.time.values * per_time
            axes.plot(time, energy / energy.max(), label=label, **style.run_style(number))
    axes.set(ylim=(0.0, 1.05), xlabel=f"time ({unit})", ylabel="kinetic energy over its largest")
    style.draw_legend(axes)
    return figure


def _sum_kinetic(run: Run) -> Floats | None:
    energies = [run.series[n].values for n in run.series if str(n).startswith("kinetic")]
    total = np.sum(energies, axis=0) if energies else np.zeros(0)
    return total if total.ndim == 1 and len(total) and total.max() > 0.0 else None
