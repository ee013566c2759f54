"""Components of the stress over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run


@figure("Stress", 120, applies=lambda run: len(run.series.time) > 1 and "stress" in run.series)
def stress(run: Run) -> Figure:
    """Diagonal and shear components of the stress of a run over time, positive in tension.

    Dotted lines separate the stages.

    Raises
    ------
    DustError
        The result has no stress.
    """
    if "stress" not in run.series:
        raise DustError(f"{run.path} has no stress: it needs a periodic boundary.")
    tensor = run.series.stress.transpose("time", "xyz", "axis").values
    figure, (axes, below) = style.create_figure(height=4.6, rows=2, ratios=[2, 1])
    time = run.series.time.values
    per_time, time_unit = style.choose_unit(np.max(time, initial=0.0), style.TIMES)
    finite_sizes = np.abs(tensor[np.isfinite(tensor)])
    scale, unit = style.choose_unit(np.max(finite_sizes, initial=0.0), style.PRESSURES)
    for number, axis in enumerate("xyz"):
        axes.plot(
            time * per_time,
            tensor[:, number, number] * scale,
            linewidth=1.1,
            color=style.RUN_COLOURS[number],
            label=rf"$\sigma_{{{axis}{axis}}}$",
        )
    for number, (a, b) in enumerate(((0, 1), (0, 2), (1, 2))):
        below.plot(
            time * per_time,
            0.5 * (tensor[:, a, b] + tensor[:, b, a]) * scale,
            linewidth=1.0,
            color=style.RUN_COLOURS[number + 3],
            label=rf"$\sigma_{{{'xyz'[a]}{'xyz'[b]}}}$",
        )
    for panel in (axes, below):
        panel.axhline(0.0, color=style.GREY, linewidth=0.6)
    style.name_stages(axes, run, per_time)
    for segment in run.parts[1:]:
        start = float(segment.start.time) * per_time
        below.axvline(start, **style.line_look(style.GREY, 0.9, style.DOTTED))
    axes.set(
        xlim=(time[0] * per_time, time[-1] * per_time),
        ylabel=f"stress, positive in tension ({unit})",
    )
    below.set(ylabel=f"shear ({unit})", xlabel=f"time ({time_unit})")
    for panel in (axes, below):
        style.draw_legend(panel, ncols=3)
    return figure
