"""Colouring of grains in a picture: colours, and the colour bar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap
from numpy.typing import NDArray

from dusttaichi.analysis.fragments import Fragments
from dusttaichi.plots import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.physics.geometry import Floats

# colours of the largest fragments; the others and single grains have another one
PALETTE = [style.SKY, style.ORANGE, style.GREEN, style.PURPLE, style.RED, style.BLUE, style.YELLOW]
BODY_NAMES, BODY_COLOURS = ("target", "projectile"), (style.SKY, style.ORANGE)  # of a collision


@dataclass(frozen=True)
class Colouring:
    """Colouring of grains. colours: (N, 3). The rest is for the colour bar.

    bar: None without one. ticks, names: of discrete values, None of continuous ones.
    """

    colours: Floats
    bar: ScalarMappable | None = None
    label: str = ""
    ticks: list[int] | None = None
    names: list[str] | None = None
    extend: str = "neither"


def make_colour_map() -> Colormap:
    """Viridis without its darkest part and paler, since shading darkens it."""
    colours = colormaps["viridis"](np.linspace(0.08, 1.0, 256))
    colours[:, :3] += 0.1 * (1.0 - colours[:, :3])
    return ListedColormap(colours)


def colour_by_number(values: NDArray[np.integer], largest: int) -> Colouring:
    """Colour whole numbers from 0 to `largest`, each in a colour."""
    colours = ListedColormap(make_colour_map()(np.linspace(0.0, 1.0, largest + 1)))
    bar = ScalarMappable(BoundaryNorm(np.arange(-0.5, largest + 1.0), largest + 1), colours)
    step = max(1, -(-(largest + 1) // 12))
    ticks = list(range(0, largest + 1, step))
    return Colouring(bar.to_rgba(values)[:, :3], bar, "contacts of a grain", ticks)


def colour_by_body(bodies: Fragments | NDArray[np.integer]) -> Colouring:
    """Colour by body: Fragments, or the numbers of the two bodies of a collision."""
    if isinstance(bodies, Fragments):
        return colour_by_fragment(bodies, "grains of the body at the start")
    bar = ScalarMappable(BoundaryNorm([-0.5, 0.5, 1.5], 2), ListedColormap(BODY_COLOURS))
    return Colouring(bar.to_rgba(bodies)[:, :3], bar, "", [0, 1], list(BODY_NAMES))


def colour_by_fragment(fragments: Fragments, label: str) -> Colouring:
    """Colour by Fragments, the largest ones each in a colour."""
    count_named = min(int(np.count_nonzero(fragments.grains > 1)), len(PALETTE))
    palette = PALETTE[:count_named]
    names = [f"{count:,}" for count in fragments.grains[:count_named]]
    if len(fragments) > count_named:
        palette.append("#CFCFCF")
        names.append(f"others ({len(fragments) - count_named:,})")
    count = len(palette)
    bar = ScalarMappable(BoundaryNorm(np.arange(-0.5, count), count), ListedColormap(palette))
    colours = bar.to_rgba(np.minimum(fragments.label, count - 1))[:, :3]
    return Colouring(colours, bar, label, list(range(count)), names)


def draw_colour_bar(
    figure: Figure, rectangle: tuple[float, float, float, float], colouring: Colouring
) -> None:
    """Draw the bar of a Colouring in a rectangle (left, bottom, width, height) of a figure."""
    if colouring.bar is None:
        return
    bar = figure.colorbar(colouring.bar, cax=figure.add_axes(rectangle), extend=colouring.extend)
    bar.set_label(colouring.label)
    bar.outline.set_linewidth(0.6)
    bar.ax.tick_params(
        which="both",
        length=0 if colouring.ticks else 3,
        direction="out",
        right=True,
        left=False,
        top=False,
    )
    if colouring.ticks is not None:
        bar.minorticks_off()
        bar.set_ticks(colouring.ticks, labels=colouring.names)
    if colouring.names is not None:
        bar.ax.invert_yaxis()  # the largest on top
