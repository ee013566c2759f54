"""The numbers of the runs of an ensemble or a sweep against the swept keys: a panel for each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from dusttaichi.analysis.dependence import Against, against
from dusttaichi.analysis.ensemble_tables import table_numbers, title_of
from dusttaichi.analysis.numbers import index_observables
from dusttaichi.analysis.symbols import label_key
from dusttaichi.plots import style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.physics.geometry import Floats

WIDE = 10.0  # ratio of the largest to the smallest value from which an axis is logarithmic
MOST_LINES = 12
LOOK: style.Look = {
    "marker": "o",
    "markersize": 3.5,
    "linewidth": 1.1,
    "capsize": 2,
    "elinewidth": 1.0,
}


@style.apply_style
def numbers(data: xr.Dataset) -> Figure | None:
    """Each number of the table of a dataset of `analysis.gather` against the swept key.

    x is the swept key with most values that are numbers, or the replica without a sweep; each point
    of the other keys is a line. Bars are standard deviations over the replicas, faint points the
    runs. None where no number differs between the runs.
    """
    tables = [against(data, name) for name in table_numbers(data)]
    tables = [table for table in tables if table.varies]
    if not tables:
        return None
    figure, panels = style.create_grid(len(tables), 3, 1.6)
    for panel, table in zip(panels, tables, strict=True):
        _draw_panel(panel, table)
    handles, labels = panels[0].get_legend_handles_labels()
    if len(handles) > 1:
        columns = max(1, 64 // (8 + max(map(len, labels))))
        figure.legend(handles, labels, loc="outside lower center", ncols=columns)
    return figure


def _draw_panel(panel: Axes, table: Against) -> None:
    count = min(len(table.lines), MOST_LINES)
    line_numbers = np.linspace(0, len(table.lines) - 1, count).round().astype(int)
    for line_style, n in zip(style.run_styles(count), line_numbers, strict=True):
        label, look = table.lines[n], LOOK | line_style
        runs = np.broadcast_to(table.x[:, None], table.runs[n].shape)
        if table.runs.shape[-1] > 1:
            dots: style.Look = {"markersize": 2.5, "markeredgewidth": 0, "alpha": 0.4}
            panel.plot(runs.ravel(), table.runs[n].ravel(), "o", color=look["color"], **dots)
        bars = np.where(np.isfinite(table.std[n]), table.std[n], 0.0)
        if table.ticks is not None:  # nothing is between two names, or two samples
            look = look | {"linestyle": "none"}
        label = style.typeset(label) or "_"
        # with a gap where no run has the number
        panel.errorbar(table.x, table.mean[n], bars, label=label, **look)
    _set_axes(panel, table)


def _set_axes(panel: Axes, table: Against) -> None:
    if table.ticks is not None:
        panel.set_xticks(table.x, table.ticks)
        panel.set_xlim(table.x[0] - 0.4, table.x[-1] + 0.4)
    elif _is_wide(table.x):
        panel.set_xscale("log")
        style.set_few_ticks(panel.xaxis)
    elif np.ptp(table.x) > 0.0:  # the same in all panels, also where few runs have the number
        margin = 0.06 * np.ptp(table.x)
        panel.set_xlim(table.x.min() - margin, table.x.max() + margin)
    if _is_wide(table.runs):
        panel.set_yscale("log")
        if np.nanmax(table.runs) < 100 * np.nanmin(table.runs):
            style.set_few_ticks(panel.yaxis)
    else:
        panel.yaxis.set_major_locator(MaxNLocator(4))
    panel.set_title(_label_number(table.name, table.unit), loc="left", fontsize="small", pad=4)
    unit = f" ({style.typeset(table.x_unit)})" if table.x_unit else ""
    panel.set_xlabel(f"{label_key(table.key)}{unit}", fontsize="small")
    panel.tick_params(which="both", labelsize="x-small")


def _label_number(name: str, unit: str) -> str:
    number = index_observables().get(name)
    text = number and number.symbol or title_of(name)
    return f"{text} ({style.typeset(unit)})" if unit else text


def _is_wide(values: Floats) -> bool:
    finite = values[np.isfinite(values)]
    return len(finite) > 0 and bool(finite.min() > 0 and finite.max() >= WIDE * finite.min())
