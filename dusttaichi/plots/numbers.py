"""The numbers of the runs of an ensemble or a sweep against the swept keys: a panel for each."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from dusttaichi.analysis.ensemble_tables import Against, against, table_numbers, title_of
from dusttaichi.analysis.numbers import known
from dusttaichi.analysis.symbols import key_label
from dusttaichi.plots import style

WIDE = 10.0  # ratio of the largest to the smallest value from which an axis is logarithmic
MOST_LINES = 12
LOOK = {"marker": "o", "markersize": 3.5, "linewidth": 1.1, "capsize": 2, "elinewidth": 1.0}


@style.styled
def numbers(data):
    """Each number of the table of a dataset of `analysis.gather` against the swept key.

    x is the swept key with most values that are numbers, or the replica without a sweep; each point
    of the other keys is a line. Bars are standard deviations over the replicas, faint points the
    runs. None where no number differs between the runs.
    """
    drawn = [against(data, name) for name in table_numbers(data)]
    drawn = [one for one in drawn if one.varies]
    if not drawn:
        return None
    figure, panels = style.new_grid(len(drawn), 3, 1.6)
    for panel, one in zip(panels, drawn, strict=True):
        _panel(panel, one)
    handles, labels = panels[0].get_legend_handles_labels()
    if len(handles) > 1:
        columns = max(1, 64 // (8 + max(map(len, labels))))
        figure.legend(handles, labels, loc="outside lower center", ncols=columns)
    return figure


def _panel(panel, one: Against):
    count = min(len(one.lines), MOST_LINES)
    chosen = np.linspace(0, len(one.lines) - 1, count).round().astype(int)
    for own, n in zip(style.looks(count), chosen, strict=True):
        label, look = one.lines[n], LOOK | own
        runs = np.broadcast_to(one.x[:, None], one.runs[n].shape)
        if one.runs.shape[-1] > 1:
            dots = {"markersize": 2.5, "markeredgewidth": 0, "alpha": 0.4}
            panel.plot(runs.ravel(), one.runs[n].ravel(), "o", color=look["color"], **dots)
        bars = np.where(np.isfinite(one.std[n]), one.std[n], 0.0)
        if one.ticks is not None:  # nothing is between two names, or two samples
            look = look | {"linestyle": "none"}
        label = style.typeset(label) or "_"
        # with a gap where no run has the number
        panel.errorbar(one.x, one.mean[n], bars, label=label, **look)
    _axes(panel, one)


def _axes(panel, one):
    if one.ticks is not None:
        panel.set_xticks(one.x, one.ticks)
        panel.set_xlim(one.x[0] - 0.4, one.x[-1] + 0.4)
    elif _wide(one.x):
        panel.set_xscale("log")
        style.few_ticks(panel.xaxis)
    elif np.ptp(one.x) > 0.0:  # the same in all panels, also where few runs have the number
        margin = 0.06 * np.ptp(one.x)
        panel.set_xlim(one.x.min() - margin, one.x.max() + margin)
    if _wide(one.runs):
        panel.set_yscale("log")
        if np.nanmax(one.runs) < 100 * np.nanmin(one.runs):
            style.few_ticks(panel.yaxis)
    else:
        panel.yaxis.set_major_locator(MaxNLocator(4))
    panel.set_title(_named(one.name, one.unit), loc="left", fontsize="small", pad=4)
    unit = f" ({style.typeset(one.x_unit)})" if one.x_unit else ""
    panel.set_xlabel(f"{key_label(one.key)}{unit}", fontsize="small")
    panel.tick_params(which="both", labelsize="x-small")


def _named(name, unit):
    number = known().get(name)
    text = number and number.symbol or title_of(name)
    return f"{text} ({style.typeset(unit)})" if unit else text


def _wide(values):
    known = values[np.isfinite(values)]
    return len(known) and known.min() > 0 and known.max() >= WIDE * known.min()
