"""Two colliding bodies: pictures before, meanwhile and after; velocities and momenta."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

from dusttaichi.analysis import compute_orbital_momentum
from dusttaichi.analysis.frame import count_frames, read_frame
from dusttaichi.analysis.symbols import label_key
from dusttaichi.plots import style
from dusttaichi.plots.colouring import BODY_COLOURS, BODY_NAMES
from dusttaichi.plots.figure_registry import figure
from dusttaichi.plots.frame_of_picture import draw_scale_bar
from dusttaichi.plots.grain_picture import FOOT, MARGIN
from dusttaichi.plots.spheres import Camera, compute_camera_axes, render_spheres

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run
    from dusttaichi.physics.geometry import Floats
    from dusttaichi.plots.grain_picture import View
    from dusttaichi.plots.spheres import Reals

WIDTH, TALLEST, DPI = 6.4, 9.0, 200
NOTE = 0.24  # height of the time above a picture [inches]
MOMENTA = tuple((10.0**-n, rf"$10^{{-{n}}}$") for n in (15, 18, 21, 24, 27))


@figure("Before, meanwhile, after", 30, applies=lambda run: run.collides)
def collision(
    run: Run, snapshots: Sequence[int] | None = None, view: View = (0.0, 0.0, 1.0)
) -> Figure:
    """Pictures of a run with two colliding bodies, on one scale, coloured by body.

    They are in a row, or in a column if they are wide.

    Parameters
    ----------
    run : Run
    snapshots : sequence of int, optional
        Default: the first, the middle and the last one.
    view : tuple
        Direction (x, y, z) towards the viewer; the bodies fly along x, with their offset along y.
    """
    if snapshots is None:
        count = count_frames(run)
        snapshots = sorted({0, count // 2, count - 1})
    frames = [read_frame(run, number, False) for number in snapshots]
    colours = np.empty((len(frames[0].radius), 3))
    for grains, colour in zip(run.bodies(), BODY_COLOURS, strict=True):
        colours[grains] = to_rgb(colour)
    axes = compute_camera_axes(view)
    bounds = [_find_bounds(frame, axes) for frame in frames]
    size = np.array([high - low for low, high in bounds])  # of each, right and up [m]
    widest = float(size[:, 0].max())
    abreast = bool(len(size) * widest <= 4.0 * size[:, 1].max())  # not if they are wide
    scale = _compute_scale(size, abreast)
    cameras = [_aim_camera(low, high, widest, axes, scale) for low, high in bounds]
    inches = np.array([(c.width, c.height) for c in cameras]) / DPI
    corners, extent = _arrange_pictures(inches, abreast)
    figure = style.create_canvas(*extent, dpi=DPI)
    factor, unit = style.choose_unit(frames[-1].time, style.TIMES)
    for frame, camera, corner, panel_size in zip(frames, cameras, corners, inches, strict=True):
        x_of_panel, y_of_panel = corner / extent
        time = f"{frame.time * factor:.3g} {unit}"
        top = extent[1] if abreast else corner[1] + panel_size[1] + NOTE
        figure.text(x_of_panel, (top - 0.06) / extent[1], time, ha="left", va="top", fontsize=9)
        panel = figure.add_axes((x_of_panel, y_of_panel, *(panel_size / extent)))
        panel.imshow(
            render_spheres(camera, frame.position, frame.radius, colours),
            interpolation="none",
            aspect="auto",
        )
        panel.set_axis_off()
    draw_scale_bar(figure, widest, scale, MARGIN, FOOT)
    _name_bodies(figure)
    return figure


def _compute_scale(size: Floats, abreast: int) -> float:
    """Largest scale [inches/m] of all pictures."""
    across, up = size[:, 0].max(), size[:, 1]
    if abreast:
        wide, tall = WIDTH - (len(size) + 1) * MARGIN, TALLEST - FOOT - NOTE
        return float(min(wide / (len(size) * across), tall / up.max()))
    wide, tall = WIDTH - 2 * MARGIN, TALLEST - FOOT - len(size) * NOTE
    return float(min(wide / across, tall / up.sum()))


def _arrange_pictures(inches: Floats, abreast: int) -> tuple[Floats, Floats]:
    """Arrange pictures: (lower left corners (pictures, 2), extent of the figure (2,)) [inches]."""
    count, across, up = len(inches), inches[:, 0].max(), inches[:, 1]
    if abreast:
        x = MARGIN + np.arange(count) * (across + MARGIN)
        extent = np.array([x[-1] + across + MARGIN, up.max() + NOTE + FOOT])
        return np.stack([x, FOOT + 0.5 * (up.max() - up)], axis=1), extent
    below = np.append(np.cumsum((up + NOTE)[:0:-1])[::-1], 0.0)
    extent = np.array([across + 2 * MARGIN, (up + NOTE).sum() + FOOT])
    return np.stack([np.full(count, MARGIN), FOOT + below], axis=1), extent


def _name_bodies(figure: Figure) -> None:
    """Draw a legend of the two bodies beside the scale bar."""
    dots = [
        Line2D([], [], linestyle="", marker="o", markersize=7, color=colour, label=name)
        for name, colour in zip(BODY_NAMES, BODY_COLOURS, strict=True)
    ]
    figure.legend(handles=dots, loc="lower right", ncols=2, frameon=False, handletextpad=0.1)


def _find_bounds(frame: Frame, axes: Reals) -> Floats:
    """Ends of the grains along right and up, (2, 2) [m], with a small margin."""
    seen, reach = frame.position @ axes[:2].T, 1.2 * frame.radius[:, None]
    return np.array([(seen - reach).min(axis=0), (seen + reach).max(axis=0)])


def _aim_camera(low: Floats, high: Floats, widest: float, axes: Reals, scale: float) -> Camera:
    """A Camera that sees `widest` metres about the middle of low and high along right."""
    middle = 0.5 * (low[0] + high[0])
    columns, rows = (int(np.ceil(e * scale * DPI)) for e in (widest, high[1] - low[1]))
    left_edge, bottom_edge = middle - 0.5 * widest, low[1]
    # the rounded number of pixels sees a little more, so that pixels stay square
    upper_corner = np.array(
        [left_edge + columns / (scale * DPI), bottom_edge + rows / (scale * DPI)]
    )
    return Camera(axes, np.array([left_edge, bottom_edge]), upper_corner, columns, rows)


@figure(
    "Velocities and angular momenta",
    20,
    applies=lambda run: len(run.series.time) > 1 and "body_angular_momentum" in run.series,
)
def bodies(run: Run) -> Figure:
    """Velocities and angular momenta of the two bodies of a run over time.

    Velocities along x and y; angular momenta along z: orbital, of each about its centre, total.

    Raises
    ------
    DustError
        There are not two bodies.
    """
    orbital, series = compute_orbital_momentum(run)[:, 2], run.whole.series
    names, velocity = series.body.values.tolist(), series.body_velocity.values
    spin = dict(zip(names, series.body_angular_momentum.values[:, :, 2].T, strict=True))
    figure, (speeds, turning) = style.create_figure(height=5.2, rows=2)
    per_time, seconds = style.choose_unit(float(series.time[-1]), style.TIMES)
    time = series.time.values * per_time
    for number, name in enumerate(names):
        line = style.run_style(number)
        speeds.plot(time, velocity[:, number, 0], label=f"{name}, along x", **line)
        faint = line | {"linestyle": (0, (1, 1.5)), "linewidth": 1.0}
        speeds.plot(time, velocity[:, number, 1], label=f"{name}, along y", **faint)
    speeds.set_ylabel("velocity (m/s)")
    style.draw_legend(speeds, ncols=2)
    angular_momenta = {"about each other": orbital}
    angular_momenta |= {f"of the {name}": momentum for name, momentum in spin.items()}
    angular_momenta["of all"] = np.sum(list(angular_momenta.values()), axis=0)
    per_unit, unit = style.choose_unit(
        max(np.abs(a).max() for a in angular_momenta.values()), MOMENTA
    )
    for number, (name, values) in enumerate(angular_momenta.items()):
        line = style.run_style(number)
        if name == "of all":
            line = {"color": style.BLACK, "linewidth": 1.0, "linestyle": style.DASHED}
        turning.plot(time, values * per_unit, label=name, **line)
    turning.set(ylabel=f"angular momentum\nalong z ({unit} kg m²/s)", xlabel=f"time ({seconds})")
    style.draw_legend(turning, ncols=2)
    return figure


@style.apply_style
def restitution(
    speeds: ArrayLike,
    coefficients: ArrayLike,
    sticking_speed: float | None = None,
    label: str | Sequence[str] = "run",
) -> Figure:
    """Coefficient of restitution against the impact speed.

    Parameters
    ----------
    speeds
        [m/s], (n,).
    coefficients
        (n,), or rows of them with a label each.
    sticking_speed : float, optional
        Speed v_s [m/s]; draws e = sqrt(1 - (v_s/v)^2), the closed form for two grains that lose the
        same energy at any speed, 0 below v_s.
    label : str or list of str
        Label of the coefficients.
    """
    speeds, coefficients = np.asarray(speeds, float), np.asarray(coefficients, float)
    figure, (axes,) = style.create_figure(height=3.4)
    if sticking_speed is not None:
        low, high = min(speeds.min(), sticking_speed) * 0.8, max(speeds.max(), sticking_speed) * 1.2
        # dense where the curve leaves 0 with an upright tangent
        above = sticking_speed + (high - sticking_speed) * np.linspace(0.0, 1.0, 400) ** 3
        closed = np.sqrt(np.maximum(0.0, 1.0 - (sticking_speed / above) ** 2))
        x, y = np.append(low, above), np.append(0.0, closed)
        text = rf"$\sqrt{{1-(v_s/v)^2}}$, $v_s$ = {sticking_speed:.4g} m/s"
        axes.plot(x, y, label=text, **style.line_look(style.BLACK, 1.2))
    rows = np.atleast_2d(coefficients)
    labels = [label] if isinstance(label, str) else list(label)
    for number, (row, text) in enumerate(zip(rows, labels, strict=True)):
        colour = style.run_style(number)["color"]
        axes.plot(speeds, row, "o", ms=4, color=colour, label=text, clip_on=False, zorder=3)
    style.set_logarithmic(axes, "x")
    axes.set(ylim=(0.0, 1.02), xlabel="impact speed (m/s)", ylabel="coefficient of restitution")
    style.draw_legend(axes)
    return figure


def restitution_map(data: xr.Dataset) -> Figure:
    """Coefficients of restitution of a map of `dust sticking`, a row for each of its other keys.

    Parameters
    ----------
    data : xarray.Dataset

    Returns
    -------
    matplotlib Figure
    """
    *names, _ = data.restitution.dims
    points = itertools.product(*(data[name].values for name in names))
    labels = [", ".join(map(_format_key, names, point, itertools.repeat(data))) for point in points]
    closed = data.attrs["sticking_speed"] if data.attrs["closed_form"] else None
    rows = data.restitution.values.reshape(-1, data.sizes["speed"])
    return restitution(data.speed, rows, closed, labels if names else "simulated")


def _format_key(name: str, value: Any, data: xr.Dataset) -> str:
    """Key and value of a map for a legend: the label of the key, angles in degrees."""
    word, unit = label_key(name), style.typeset(data[name].attrs.get("units", ""))
    if isinstance(value, str):
        return f"{word} = {value}"
    if unit == "rad":
        return f"{word} = {np.degrees(value):.3g}°"
    return f"{word} = {value:.4g} {unit}".removesuffix(" 1").rstrip()
