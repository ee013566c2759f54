"""The map of `dust extremes`: result of every cell, and estimated against measured limit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch, Rectangle

from dusttaichi.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, RED, apply_style, create_canvas

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.plots.style import Look

COLOURS = {"stable": GREEN, "refused": GREY, "stopped": ORANGE, "WRONG": BLACK}
SHADES = (-16.0, -2.0)  # powers of ten of the residual, from pale to full
BAND = 0.2
ABREAST = 56  # letters of the column names that fit horizontally


@apply_style
def extremes(data: xr.Dataset) -> Figure:
    """Figure of a map, the dataset of extremes.results: a panel a group.

    Colours are verdicts; the shade of a stable cell, and the number in it, is the power of ten of
    its residual. The last panel has the ratio of estimated and measured limits within its band.
    """
    groups = list(dict.fromkeys(data.group.values.tolist()))
    cells_by_group = [data.where(data.group == name, drop=True) for name in groups]
    heights = [2.2 + len(_list_values(cells, "row")) for cells in cells_by_group] + [9.0]
    left_panels, right_panels = _split_columns(heights)
    tallest = max(sum(heights[n] for n in numbers) for numbers in (left_panels, right_panels))
    figure = create_canvas(11.5, 0.19 * tallest + 0.9, layout="constrained")
    halves: Any = figure.subfigures(1, 2, wspace=0.03)  # two of them
    for half, members in zip(halves, (left_panels, right_panels), strict=True):
        axes = half.subplots(
            len(members), 1, squeeze=False, height_ratios=[heights[n] for n in members]
        )[:, 0]
        for panel, n in zip(axes, members, strict=True):
            if n == len(cells_by_group):
                _draw_limits(panel, data, groups)
            else:
                _draw_cells(panel, cells_by_group[n], groups[n])
    handles = [Patch(color=colour, label=verdict) for verdict, colour in COLOURS.items()]
    title = "number in a stable cell: power of ten of the ledger's residual"
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), title=title)
    return figure


def _split_columns(heights: Sequence[float]) -> tuple[list[int], list[int]]:
    """Numbers of the panels of two columns of about the same height, in their order."""
    total, half = sum(heights), 0.0
    for n, height in enumerate(heights):
        if n and half + 0.5 * height > 0.5 * total:
            return list(range(n)), list(range(n, len(heights)))
        half += height
    return list(range(len(heights) - 1)), [len(heights) - 1]


def _list_values(cells: xr.Dataset, name: str) -> list[str]:
    return list(dict.fromkeys(cells[name].values.tolist()))


def _draw_cells(axes: Axes, cells: xr.Dataset, title: str) -> None:
    rows, columns = _list_values(cells, "row"), _list_values(cells, "column")
    if all(_is_number(c) for c in columns):
        columns.sort(key=float)
    for row, column, verdict, residual in zip(
        cells.row.values,
        cells.column.values,
        cells.verdict.values,
        cells.residual.values,
        strict=True,
    ):
        x, y = columns.index(column), rows.index(row)
        power, alpha = "", 1.0
        if verdict == "stable":
            exact = np.log10(max(float(residual), 1e-16))
            power = f"{exact:.0f}"
            alpha = 0.25 + 0.75 * np.clip((exact - SHADES[0]) / (SHADES[1] - SHADES[0]), 0.0, 1.0)
        square = Rectangle((x - 0.46, y - 0.44), 0.92, 0.88, alpha=float(alpha), edgecolor="none")
        square.set_facecolor(COLOURS[verdict])
        axes.add_patch(square)
        axes.text(x, y, power, ha="center", va="center", fontsize=5.5, color=BLACK)
    axes.set(xlim=(-0.5, len(columns) - 0.5), ylim=(len(rows) - 0.5, -0.5))
    axes.set_title(title, fontsize=9, loc="left", pad=3)
    axes.set_yticks(range(len(rows)), rows, fontsize=6)
    long = max(len(c) for c in columns) > 6 or sum(len(c) + 1 for c in columns) > ABREAST
    axes.set_xticks(range(len(columns)), columns, fontsize=5.5, rotation=90 if long else 0)
    axes.tick_params(length=0, top=False, right=False)
    for side in axes.spines.values():
        side.set_visible(False)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _draw_limits(axes: Axes, data: xr.Dataset, groups: Sequence[str]) -> None:
    """Draw the estimated over the measured limit against the measured one."""
    markers = "osD^v<>Ph"
    axes.axhspan(1.0 - BAND, 1.0 + BAND, color=BLUE, alpha=0.12, linewidth=0)
    axes.axhline(1.0, color=GREY, linewidth=0.8)
    measured = np.isfinite(data.ratio.values.astype(float))
    for n, group in enumerate(groups):
        of_group = measured & (data.group.values == group)
        if of_group.any():
            line_style: Look = {"markersize": 3.5, "color": (BLUE, RED, GREEN, ORANGE)[n % 4]}
            axes.plot(
                data.measured.values[of_group],
                data.ratio.values[of_group],
                markers[n % len(markers)],
                label=group,
                **line_style,
            )
    axes.set_title("largest stable step", fontsize=9, loc="left", pad=3)
    axes.set(xlabel="measured (s)", ylabel="estimated / measured", ylim=(0.7, 1.3))
    if measured.any():  # nothing outside is hidden
        ratios = data.ratio.values[measured].astype(float)
        axes.set_ylim(min(0.7, 0.95 * ratios.min()), max(1.3, 1.05 * ratios.max()))
    if measured.any():
        axes.set_xscale("log")
        axes.legend(loc="upper right", ncols=3)
