"""A picture of the grains of a snapshot: shaded spheres, the cell, a scale bar, a colour bar."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import ArrayLike, NDArray

from dusttaichi.analysis.fragments import Fragments, find_fragments, find_frame_fragments
from dusttaichi.analysis.frame import count_frames, read_frame, read_grain_masses
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.colouring import (
    Colouring,
    colour_by_body,
    colour_by_fragment,
    colour_by_number,
    draw_colour_bar,
    make_colour_map,
)
from dusttaichi.plots.figure_registry import Picture
from dusttaichi.plots.frame_of_picture import draw_scale_bar, find_cell_edges, make_cell_lines
from dusttaichi.plots.spheres import Camera, compute_camera_axes, render_spheres

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run
    from dusttaichi.physics.geometry import Floats
    from dusttaichi.plots.spheres import Reals

Colour = str | ArrayLike  # a name of COLOURS, or numbers, (N,)
View = str | Sequence[float]  # a name of VIEWS, or a direction

VIEWS = {
    "oblique": (-0.5, -1.0, 0.42),
    "front": (0.0, -1.0, 0.0),
    "side": (1.0, 0.0, 0.0),
    "top": (0.0, 0.0, 1.0),
    "bottom": (0.0, 0.0, -1.0),
}
RIGID = (0.55, 0.58, 0.62)  # colour of a rigid sphere among the grains
USUAL = "coordination"  # default colour
COLOURS = (USUAL, "speed", "height", "fragment", "body", "uniform")
WIDTH, TALLEST = 6.4, 8.0  # of the figure [inches]
LOWEST = 1.7  # least height of a picture with a colour bar and its label [inches]
MARGIN, FOOT, HEAD = 0.12, 0.42, 0.2  # around the picture, for the scale bar, for a note
BAR, NAMES = 0.95, 0.5  # for the colour bar, and for names beside it
SPEEDS = ((1.0, "m/s"), (1e-2, "cm/s"), (1e-3, "mm/s"), (1e-6, "µm/s"))


@dataclass(frozen=True)
class Appearance:
    """Appearance of frames, the same for a whole film. limits: of the colours, see `grains`."""

    color: Colour
    view: tuple[float, ...]
    limits: tuple[float, float] | None
    label: str
    cell: bool
    bounds: Floats  # (2, 2) [m]: ends along right and up
    dpi: int
    bodies: Fragments | NDArray[np.integer] | None = None  # of number_bodies, for that colour


@style.apply_style
def grains(
    run: Run,
    snapshot: int = -1,
    color: Colour = USUAL,
    view: View = "oblique",
    *,
    limits: tuple[float, float] | None = None,
    label: str | None = None,
    cell: bool = True,
    dpi: int = 300,
) -> Figure:
    """The grains of a snapshot as shaded spheres, in parallel projection.

    Parameters
    ----------
    run : Run
    snapshot : int
    color : str or array
        "coordination", "speed", "height", "fragment" (connected by contacts; a colour for each of
        the largest ones), "body" (fragment of a grain in the first snapshot), "uniform", or
        numbers, (N,).
    view : str or tuple
        Direction towards the viewer, a name of VIEWS or three numbers (x, y, z), z upwards.
    limits : tuple, optional
        Ends of the colour bar of speed, height or numbers, in SI.
    label : str, optional
        Label of the colour bar of numbers.
    cell : bool
        Draw walls (solid) and periodic faces (dashed).
    dpi : int
        Pixels per inch.

    Raises
    ------
    DustError
        A name is unknown.
    """
    frame = read_frame(run, snapshot)
    masses = read_grain_masses(run) if isinstance(color, str) and color == "fragment" else None
    appearance = choose_appearance(
        [frame],
        color,
        view,
        limits=limits,
        label=label,
        cell=cell,
        dpi=dpi,
        bodies=number_bodies(run, color),
    )
    return draw_frame(frame, appearance, masses)


def number_bodies(run: Run, color: Colour) -> Fragments | NDArray[np.intp] | None:
    """Bodies for that colour: of a collision the numbers of the bodies of the grains, (N,).

    Else the Fragments of the first snapshot; None for another colour.
    """
    if not (isinstance(color, str) and color == "body"):
        return None
    if not run.collides:
        return find_fragments(run, 0)
    target, projectile = run.bodies()
    number = np.zeros(len(target) + len(projectile), np.intp)
    number[projectile] = 1
    return number


def choose_appearance(
    frames: Sequence[Frame],
    color: Colour,
    view: View,
    *,
    limits: tuple[float, float] | None = None,
    label: str | None = None,
    cell: bool = True,
    dpi: int = 300,
    bodies: Fragments | NDArray[np.intp] | None = None,
) -> Appearance:
    """The Appearance for all of `frames`: common colours and bounds. bodies: of `number_bodies`."""
    view = parse_direction(view)
    if isinstance(color, str) and color not in COLOURS:
        raise DustError(f'There is no colour by "{color}"; allowed: {", ".join(COLOURS)}.')
    low, high = zip(
        *(_find_extent(frame, compute_camera_axes(view), cell) for frame in frames), strict=True
    )
    ends = [pair for frame in frames if (pair := _find_limits(frame, color)) is not None]
    if limits is None and ends:
        limits = (min(first for first, _ in ends), max(last for _, last in ends))
    bounds = np.array([np.min(low, axis=0), np.max(high, axis=0)])
    return Appearance(color, view, limits, label or "", cell, bounds, dpi, bodies)


def parse_direction(view: View) -> tuple[float, ...]:
    """A direction (3,) from a name of VIEWS, or three numbers, also as text "1,0,0.5"."""
    if isinstance(view, str) and view in VIEWS:
        return VIEWS[view]
    try:
        numbers = view.split(",") if isinstance(view, str) else view
        vector = tuple(float(number) for number in numbers)
    except (TypeError, ValueError):
        vector = ()
    if len(vector) != 3 or not np.isfinite(vector).all() or not any(vector):
        raise DustError(
            f'There is no view "{view}"; allowed: {", ".join(VIEWS)}, or three numbers "x,y,z".'
        )
    return vector


@style.apply_style
def draw_frame(
    frame: Frame, appearance: Appearance, masses: Floats | None = None, note: str | None = None
) -> Figure:
    """Draw a Frame as a Figure with an Appearance. note: text at the top left.

    masses: of the grains [kg], (N,), for the colours of fragments.
    """
    colouring = colour_grains(frame, appearance, masses)
    bar = 0.0 if colouring.bar is None else BAR + NAMES * (colouring.names is not None)
    head = MARGIN + HEAD if note else MARGIN
    camera, (width, height) = _aim_camera(appearance, bar, head)
    lines = make_cell_lines(frame, appearance.dpi) if appearance.cell else None
    centres, radii, colours = frame.position, frame.radius, colouring.colours
    if frame.sphere is not None:
        centres, radii = np.vstack([centres, frame.sphere[:3]]), np.append(radii, frame.sphere[3])
        colours = np.vstack([colours, RIGID])
    image = render_spheres(camera, centres, radii, colours, lines=lines)
    figure = style.create_canvas(width, height, dpi=appearance.dpi)
    picture_size = (camera.width / appearance.dpi / width, camera.height / appearance.dpi / height)
    axes = figure.add_axes((MARGIN / width, FOOT / height, *picture_size))
    axes.imshow(image, interpolation="none", aspect="auto")
    axes.set_axis_off()
    widest = camera.width / camera.scale
    draw_scale_bar(figure, widest, camera.scale / appearance.dpi, MARGIN, FOOT)
    if note:
        figure.text(MARGIN / width, 1.0 - MARGIN / height, note, ha="left", va="top", fontsize=9)
    if colouring.bar is not None:
        long = min(picture_size[1], 2.6 / height)
        middle = FOOT / height + 0.5 * picture_size[1]
        bar_rectangle = (1.0 - (bar - 0.12) / width, middle - 0.5 * long, 0.14 / width, long)
        draw_colour_bar(figure, bar_rectangle, colouring)
    return figure


def _aim_camera(appearance: Appearance, bar: float, head: float) -> tuple[Camera, Floats]:
    """Camera of an Appearance, and width and height of the figure [inches].

    bar, head: width of the colour bar, margin above the picture [inches].
    """
    extent = appearance.bounds[1] - appearance.bounds[0]
    available = np.array([WIDTH - 2 * MARGIN - bar, TALLEST - MARGIN - FOOT])
    scale = (available / extent).min()  # inches a metre
    seen = np.maximum(extent, (0.0, LOWEST / scale if bar else 0.0))
    columns, rows = np.ceil(seen * scale * appearance.dpi).astype(int)
    # the rounded number of pixels sees a little more, so that pixels stay square
    seen = np.array([columns, rows]) / (scale * appearance.dpi)
    low = appearance.bounds.mean(axis=0) - 0.5 * seen
    camera = Camera(compute_camera_axes(appearance.view), low, low + seen, int(columns), int(rows))
    inches = np.array([columns, rows]) / appearance.dpi + (2 * MARGIN + bar, head + FOOT)
    return camera, np.ceil(inches * appearance.dpi) / appearance.dpi


def _find_extent(frame: Frame, axes: Reals, cell: bool) -> Floats:
    """Ends of the drawn objects along right and up, (2, 2) [m], with a small margin."""
    centres, radius = frame.position, frame.radius[:, None]
    if frame.sphere is not None:
        centres, radius = (
            np.vstack([centres, frame.sphere[:3]]),
            np.vstack([radius, frame.sphere[3]]),
        )
    seen = centres @ axes[:2].T
    low, high = (seen - radius).min(axis=0), (seen + radius).max(axis=0)
    if cell:
        corners = find_cell_edges(frame)[0].reshape(-1, 3) @ axes[:2].T
        if len(corners):
            low, high = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
    margin = 0.012 * (high - low).max()
    return np.array([low - margin, high + margin])


def _colour_values(frame: Frame, color: Colour) -> Floats | None:
    """Numbers to colour by, (N,) SI, of a continuous scale; None for other colours."""
    if not isinstance(color, str):
        values = np.asarray(color, dtype=float)
        if values.shape != frame.radius.shape:
            raise DustError(
                f"There are {len(frame.radius)} grains; numbers of shape {values.shape} cannot "
                "colour them."
            )
        return values
    if color == "speed":
        speeds: Floats = np.linalg.norm(frame.velocity, axis=1)
        return speeds
    heights: Floats = frame.position[:, 2]
    return heights if color == "height" else None


def _find_limits(frame: Frame, color: Colour) -> tuple[float, float] | None:
    if isinstance(color, str) and color == "coordination":
        return 0, int(frame.coordination.max())
    values = _colour_values(frame, color)
    if values is None:
        return None
    if isinstance(color, str) and color == "speed":
        # a few fast grains would leave the rest in one colour
        return 0.0, float(np.percentile(values, 99.0))
    return float(values.min()), float(values.max())


def colour_grains(frame: Frame, appearance: Appearance, masses: Floats | None) -> Colouring:
    """The Colouring of the grains of a Frame; masses [kg] (N,): only of colour by fragment."""
    color, (low, high) = appearance.color, appearance.limits or (0.0, 0.0)
    if isinstance(color, str):
        if color == "uniform":
            return Colouring(np.tile((0.78, 0.74, 0.67), (len(frame.radius), 1)))
        if color == "fragment" and masses is not None:
            return colour_by_fragment(find_frame_fragments(frame, masses), "grains of the fragment")
        if color == "body" and appearance.bodies is not None:
            return colour_by_body(appearance.bodies)
        if color == "coordination":
            return colour_by_number(frame.coordination, int(high))
    values = np.asarray(_colour_values(frame, color))
    factor, label = 1.0, appearance.label
    if isinstance(color, str):
        units = SPEEDS if color == "speed" else style.LENGTHS
        factor, unit = style.choose_unit(max(abs(low), abs(high)), units)
        label = f"{color} ({unit})"
    norm = Normalize(factor * low, factor * high if high > low else factor * low + 1.0)
    bar = ScalarMappable(norm, make_colour_map())
    above = (values > high).any()
    return Colouring(
        bar.to_rgba(factor * values)[:, :3], bar, label, extend="max" if above else "neither"
    )


def _draw_film(
    run: Run, color: Colour | None, view: View, *, cell: bool, dpi: int
) -> Iterator[Figure]:
    """Figures of the snapshots of a run of grains, one after another."""
    color, frames = color or USUAL, [read_frame(run, n) for n in range(count_frames(run))]
    masses = read_grain_masses(run) if color == "fragment" else None
    bodies = number_bodies(run, color)
    appearance = choose_appearance(frames, color, view, cell=cell, dpi=dpi, bodies=bodies)
    factor, unit = style.choose_unit(frames[-1].time, style.TIMES)
    for f in frames:
        yield draw_frame(
            f, appearance, masses, f"{f.time * factor:.3g} {unit}{_format_filling_factor(run, f)}"
        )


def _format_filling_factor(run: Run, frame: Frame) -> str:
    """The filling factor at the time of a frame, where the run has one."""
    series = run.series
    if "filling_factor" not in series or not len(series.time):
        return ""
    phi = np.interp(frame.time, series.time.values, series.filling_factor.values)
    return rf"   $\phi$ = {phi:.3f}" if np.isfinite(phi) else ""


PICTURE = Picture(
    "grains",
    lambda run, snapshot, color, view, **options: grains(
        run, snapshot, color or USUAL, view, **options
    ),
    _draw_film,
)
