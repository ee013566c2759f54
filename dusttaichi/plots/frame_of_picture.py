"""Frame of a picture of grains: the edges of the cell, and a scale bar."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.plots import style
from dusttaichi.plots.spheres import Lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.frame import Frame
    from dusttaichi.physics.geometry import Floats


def find_cell_edges(frame: Frame) -> tuple[Floats, NDArray[np.bool_]]:
    """Edges of the present faces: ends (L, 2, 3) [m], and which are dashed (L,).

    A face without a neighbour ends where the grains end. Edges of periodic faces alone are dashed.
    """
    low = (frame.position - frame.radius[:, None]).min(axis=0)
    high = (frame.position + frame.radius[:, None]).max(axis=0)
    present = np.isfinite(frame.cell)
    ends = np.where(present, frame.cell, np.stack([low, high], axis=1))
    wall = present & ~frame.periodic[:, None]
    segments, dashed = [], []
    for axis in range(3):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        for side in np.ndindex(2, 2):
            if not (present[second, side[0]] or present[third, side[1]]):
                continue
            segment = np.empty((2, 3))
            segment[:, axis] = ends[axis]
            segment[:, second], segment[:, third] = ends[second, side[0]], ends[third, side[1]]
            if frame.tilt:  # sheared about its centre
                height = (segment[:, 2] - ends[2, 0]) / (ends[2, 1] - ends[2, 0])
                segment[:, 0] += frame.tilt * (height - 0.5)
            segments.append(segment)
            dashed.append(not (wall[second, side[0]] or wall[third, side[1]]))
    return np.array(segments).reshape(-1, 2, 3), np.array(dashed, dtype=bool)


def make_cell_lines(frame: Frame, dpi: int) -> Lines | None:
    """The edges of the cell as Lines of half a point, or None."""
    segments, dashed = find_cell_edges(frame)
    return Lines(segments, dashed, width=0.0065 * dpi) if len(segments) else None


def round_length(largest: float) -> float:
    """The largest of 1, 2, 5 x 10^n that is no more than `largest`."""
    power = 10.0 ** np.floor(np.log10(largest))
    # with a tolerance for rounding
    return float(max(m for m in (1, 2, 5) if m * power <= largest * (1 + 1e-9)) * power)


def draw_scale_bar(figure: Figure, widest: float, scale: float, margin: float, foot: float) -> None:
    """Draw a bar of a round length below the picture, at its left.

    widest [m]: width of the picture; scale [inches/m]; margin, foot: on the left and below
    [inches].
    """
    width, height = figure.get_size_inches()
    length = round_length(0.25 * widest)
    factor, unit = style.choose_unit(length * (1 + 1e-9), style.LENGTHS)
    axes = figure.add_axes((0.0, 0.0, 1.0, foot / height))
    axes.set(xlim=(0.0, width), ylim=(0.0, foot))
    axes.set_axis_off()
    long = length * scale
    axes.plot(
        [margin, margin + long], [0.22, 0.22], color="black", linewidth=2.4, solid_capstyle="butt"
    )
    axes.text(
        margin + long + 0.08,
        0.22,
        f"{length * factor:g} {unit}",
        ha="left",
        va="center_baseline",
        fontsize=9,
    )
