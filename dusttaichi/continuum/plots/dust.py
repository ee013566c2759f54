"""Dust of the continuum: pictures of the plane x-z, shares by filling factor, pressure on faces."""

import numpy as np
from matplotlib import colormaps
from matplotlib.patches import Circle, Rectangle

from dusttaichi.analysis.frame import count_frames
from dusttaichi.continuum.analysis import has_dust, histogram, read_particles, section
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import Picture, figure
from dusttaichi.results.roles import WALL
from dusttaichi.results.variables import LABELS

COLOURS = {
    "filling_factor": (r"filling factor $\phi$", "viridis"),
    "pressure": ("pressure (Pa)", "magma"),
    "speed": ("speed (m/s)", "cividis"),
}
EVERYDAY = "filling_factor"
WIDTH, TALLEST = 6.0, 7.0  # of the figure [inches]


def values_of(frame, color):
    """Values that colour a ParticleFrame, (N,), in SI.

    NaN for rigid particles; elastic ones have no filling factor. Raises DustError for an unknown
    colour.
    """
    if color not in COLOURS:
        raise DustError(f'There is no colour by "{color}"; allowed: {", ".join(COLOURS)}.')
    if color == "filling_factor":
        return frame.filling_factor
    values = frame.pressure if color == "pressure" else np.linalg.norm(frame.velocity, axis=1)
    return np.where(frame.is_dust | frame.flies, values, np.nan)


def limits_of(frames, color):
    """Ends of the colours that suit all frames: 0.3 % of the dust may be beyond the upper one."""
    frame_values = [values_of(frame, color) for frame in frames]
    low = min(np.nanmin(values) for values in frame_values)
    high = max(np.nanpercentile(values, 99.7) for values in frame_values)
    return (low, high) if high > low else (low - 1e-3, high + 1e-3)


def extent_of(frames):
    """Left, right, bottom, top [m] of the particles of all frames, rows of walls left out."""
    half = frames[0].spacing
    seen = [f.position[f.role != WALL] for f in frames]
    low = np.min([x.min(axis=0) for x in seen], axis=0) - half
    high = np.max([x.max(axis=0) for x in seen], axis=0) + half
    return low[0], high[0], low[2], high[2]


def intrudes(run):
    """True where a bead falls on dust, and snapshots show it."""
    return run.snapshots is not None and run.intrudes


def everyday(run):
    """The colour of a Run that asks for none: by the filling factor where there is dust."""
    return EVERYDAY if has_dust(run) else "pressure"


@figure("Filling factor in the plane", 171, applies=lambda run: run.snapshots is not None)
def dust(run, snapshot=-1, color=None, *, limits=None, dpi=200):
    """The plane x-z of a snapshot of a run of the continuum, in three dimensions its middle.

    Parameters
    ----------
    run : Run
    snapshot : int
    color : str, optional
        "filling_factor" (the default), "pressure" (the default without dust) or "speed".
    limits : tuple, optional
        Ends of the colours, in SI.
    dpi : int
        Pixels per inch.

    Raises
    ------
    DustError
        There is no such colour or snapshot.
    """
    frame = read_particles(run, snapshot)
    color = everyday(run) if color is None else color
    limits = limits_of([frame], color) if limits is None else limits
    return draw(run, frame, color, limits, extent_of([frame]), dpi=dpi)


@style.apply_style
def draw(run, frame, color, limits, extent, *, note=None, dpi=200):
    """One ParticleFrame as a Figure. extent: left, right, bottom, top [m]. note: text above."""
    x_begin, x_end, bottom, top = extent
    height = min((WIDTH - 1.4) * (top - bottom) / (x_end - x_begin) + 0.7, TALLEST)
    figure = style.create_canvas(WIDTH, max(height, 2.4), dpi=dpi, layout="constrained")
    axes = figure.subplots()
    image = paint(axes, run, frame, color, limits, extent=extent)
    label = COLOURS[color][0]
    figure.colorbar(image, ax=axes, label=label, extend="max", shrink=0.9, pad=0.02)
    if note:
        axes.set_title(note, fontsize=9, loc="left")
    return figure


def paint(axes, run, frame, color, limits, *, extent):
    """Draw a frame into axes, in millimetres. Returns the image, for a colour bar."""
    values = section(frame, values_of(frame, color), extent, pixels=500)
    extent = np.array(values.extent) * 1e3
    image = axes.imshow(
        values.values,
        origin="lower",
        extent=extent,
        cmap=colormaps[COLOURS[color][1]],
        vmin=limits[0],
        vmax=limits[1],
        interpolation="none",
    )
    _rigid(axes, run, frame, elastic=color == EVERYDAY)
    axes.set_xlim(*extent[:2])
    axes.set_ylim(*extent[2:])
    axes.set(xlabel="x (mm)", ylabel="z (mm)")
    return image


def _rigid(axes, run, frame, *, elastic):
    """Draw the outline of the projectile, and particles of other rigid bodies as dots.

    Elastic ones are dots too where they have no colour.
    """
    bead = run.sample.get("projectile", {})
    rigid = frame.is_bead
    look = {"facecolor": "#C8C8C8", "edgecolor": style.BLACK, "linewidth": 0.8}
    if rigid.any() and "density" in bead:
        x, _, z = np.average(frame.position[rigid], axis=0, weights=frame.mass[rigid]) * 1e3
        wide, tall = bead["diameter"] * 1e3, bead.get("height", bead["diameter"]) * 1e3
        if bead["shape"] == "sphere":
            axes.add_patch(Circle((x, z), wide / 2, **look))
        else:
            axes.add_patch(Rectangle((x - wide / 2, z - tall / 2), wide, tall, **look))
        return
    if not elastic:
        rigid &= ~frame.flies
    near = np.abs(frame.position[rigid, 1]) < 1.5 * frame.spacing
    axes.plot(*frame.position[rigid][near][:, [0, 2]].T * 1e3, ".", color=style.GREY, markersize=2)


def _film(run, color, view, *, cell, dpi):
    """Figures of the snapshots of a run of the continuum, one after another; there is one view."""
    color = color or everyday(run)
    frames = [read_particles(run, number) for number in range(count_frames(run))]
    limits, extent = limits_of(frames, color), extent_of(frames)
    factor, unit = style.choose_unit(frames[-1].time, style.TIMES)
    for frame in frames:
        note = f"{frame.time * factor:.3g} {unit}"
        yield draw(run, frame, color, limits, extent, note=note, dpi=dpi)


PICTURE = Picture(
    "dust",
    lambda run, snapshot, color, view, **options: dust(run, snapshot, color, **options),
    _film,
)


@figure(
    "Share of the dust by filling factor",
    172,
    applies=lambda run: run.snapshots is not None and has_dust(run),
)
def filling_factors(run):
    """Share of the dust by filling factor, at the start and at the end of a Run."""
    figure, (axes,) = style.create_figure()
    for number, (snapshot, label) in enumerate(((0, "start"), (-1, "end"))):
        edges, fractions = histogram(run, snapshot)
        axes.stairs(fractions, edges, label=label, **style.run_style(number))
    style.set_logarithmic(axes, "y")
    axes.set(xlabel=r"filling factor $\phi$", ylabel="share of the volume")
    style.draw_legend(axes)
    return figure


def _between_faces(run):
    faces = set(LABELS["wall"]) & set(run.scene.get("boundary", {}))
    return len(run.series.time) > 1 and "pressure" in run.series and bool(faces)


@figure("Pressure on the faces", 170, applies=_between_faces)
def wall_forces(run):
    """Pressure on those faces of a Run of the continuum that are walls, over time."""
    series = run.whole.series
    boundary = run.scene.get("boundary", {})
    figure, (axes,) = style.create_figure()
    per_time, unit = style.choose_unit(float(series.time[-1]), style.TIMES)
    pressure, walls = series.pressure.values, [str(wall) for wall in series.wall.values]
    seen = [n for n, wall in enumerate(walls) if boundary.get(wall, "open") != "open"]
    largest = np.nanmax(np.abs(pressure[:, seen]))
    per_pressure, pressure_unit = style.choose_unit(largest, style.PRESSURES)
    for number, n in enumerate(seen):
        axes.plot(
            series.time.values * per_time,
            pressure[:, n] * per_pressure,
            label=walls[n],
            **style.run_style(number),
        )
    axes.set(xlabel=f"time ({unit})", ylabel=f"pressure on the face ({pressure_unit})")
    style.draw_legend(axes)
    return figure
