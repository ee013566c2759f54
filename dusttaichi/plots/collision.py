"""Figures of a run in which two bodies collide: pictures before, meanwhile and after; fragments."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from dusttaichi.analysis.frame import frame_count, read_frame
from dusttaichi.plots import style
from dusttaichi.plots.frame_of_picture import scale_bar
from dusttaichi.plots.grains import FOOT, MARGIN
from dusttaichi.plots.registry import figure
from dusttaichi.plots.spheres import Camera, axes_of, picture

BODIES = (style.SKY, style.ORANGE)
WIDTH, TALLEST, DPI = 6.4, 9.0, 200
NOTE = 0.24  # room above a picture for its time [inches]


@figure("Before, meanwhile, after", 30, applies=lambda run: run.collides)
def collision(run, snapshots=None, view=(0.0, 0.0, 1.0)):
    """Pictures of a run that `collides`, one below the other on one scale, coloured by body.

    snapshots: their numbers; by default the first, the one in which half of the time has gone, and
    the last. view: direction (x, y, z) from which one looks; the bodies fly along x, beside each
    other along y.
    """
    if snapshots is None:
        count = frame_count(run)
        snapshots = sorted({0, count // 2, count - 1})
    frames = [read_frame(run, number, False) for number in snapshots]
    colours = np.empty((len(frames[0].radius), 3))
    for grains, colour in zip(run.bodies(), BODIES, strict=True):
        colours[grains] = to_rgb(colour)
    axes = axes_of(view)
    ends = [_ends(frame, axes) for frame in frames]
    widest = max(high[0] - low[0] for low, high in ends)
    tallest = sum(high[1] - low[1] for low, high in ends)
    room = TALLEST - FOOT - len(frames) * NOTE
    scale = min((WIDTH - 2 * MARGIN) / widest, room / tallest)  # inches a metre
    cameras = [_camera(low, high, widest, axes, scale) for low, high in ends]
    height = sum(c.height / DPI + NOTE for c in cameras) + FOOT
    figure = Figure(figsize=(widest * scale + 2 * MARGIN, height), dpi=DPI)
    FigureCanvasAgg(figure)
    width, below = figure.get_figwidth(), height
    factor, unit = style.scaled(frames[-1].time, style.TIMES)
    for frame, camera in zip(frames, cameras, strict=True):
        figure.text(
            MARGIN / width,
            (below - 0.06) / height,
            f"{frame.time * factor:.3g} {unit}",
            ha="left",
            va="top",
            fontsize=9,
        )
        below -= NOTE + camera.height / DPI
        part = (camera.width / DPI / width, camera.height / DPI / height)
        panel = figure.add_axes((MARGIN / width, below / height, *part))
        panel.imshow(
            picture(camera, frame.position, frame.radius, colours),
            interpolation="none",
            aspect="auto",
        )
        panel.set_axis_off()
    scale_bar(figure, widest, scale, MARGIN, FOOT)
    return figure


def _ends(frame, axes):
    """Ends of the grains along right and up, (2, 2) [m], with a little room around them."""
    seen, reach = frame.position @ axes[:2].T, 1.2 * frame.radius[:, None]
    return np.array([(seen - reach).min(axis=0), (seen + reach).max(axis=0)])


def _camera(low, high, widest, axes, scale):
    """A Camera that sees `widest` metres about the middle of low and high along right."""
    middle = 0.5 * (low[0] + high[0])
    columns, rows = (int(np.ceil(e * scale * DPI)) for e in (widest, high[1] - low[1]))
    left, bottom = middle - 0.5 * widest, low[1]
    # the rounded number of pixels sees a little more, so that pixels stay square
    far = np.array([left + columns / (scale * DPI), bottom + rows / (scale * DPI)])
    return Camera(axes, np.array([left, bottom]), far, columns, rows)
