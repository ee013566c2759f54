"""Pictures of grains: what hides what, where it lies, what the colours say; films."""

import sys
from importlib import import_module

import matplotlib
import numpy as np
import pytest
import snapshots
from PIL import Image
from program import dust

from dusttaichi import analysis, plots
from dusttaichi.analysis.frame import read_frame
from dusttaichi.errors import DustError
from dusttaichi.plots.frame_of_picture import find_cell_edges, round_length
from dusttaichi.plots.spheres import Camera, Lines, compute_camera_axes, render_spheres

# functions of these names stand before the modules
drawing = import_module("dusttaichi.plots.grain_picture")
film = import_module("dusttaichi.plots.animation")

RED, BLUE = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)
PIXELS = 120
EYE = np.array([0.3, -1.0, 0.4])


def camera(view, half=3.0, pixels=PIXELS):
    return Camera(
        compute_camera_axes(view), np.array([-half, -half]), np.array([half, half]), pixels, pixels
    )


def is_red(pixel):
    return pixel[0] > 2 * pixel[2]


def is_white(pixel):
    return np.all(pixel > 0.99)


@pytest.mark.parametrize("view", [(0, -1, 0), (1, 0, 0), (0, 0, 1), (0, 0, -1), EYE])
def test_axes_are_a_right_handed_frame(view):
    axes = compute_camera_axes(view)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(axes[2], np.array(view) / np.linalg.norm(view))
    assert axes[1] @ [0, 0, 1] >= -1e-15  # up is up


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearer_sphere_hides_the_farther_one(order):
    """Either one in front, whatever its place in the list."""
    toward = EYE / np.linalg.norm(EYE)
    position = np.array([toward, -toward])[list(order)]
    colour = np.array([RED, BLUE])[list(order)]
    image = render_spheres(camera(EYE), position, np.array([0.8, 0.8]), colour)
    assert is_red(image[PIXELS // 2, PIXELS // 2])
    assert not (image[..., 2] > 2 * image[..., 0]).any()  # no blue anywhere


def test_each_pixel_is_that_of_a_ray_through_it():
    """Owners of pixels against rays traced one by one through overlapping random spheres."""
    rng = np.random.default_rng(3)
    position, radius = rng.uniform(-1.8, 1.8, (30, 3)), rng.uniform(0.3, 0.9, 30)
    colour = np.eye(3)[np.arange(30) % 3]
    view = camera(EYE, pixels=60)
    image = render_spheres(view, position, radius, colour, samples=1)
    seen = position @ view.axes.T
    for row, column in rng.integers(0, 60, (400, 2)):
        ray = np.array([-3 + (column + 0.5) * 0.1, 3 - (row + 0.5) * 0.1])
        square = radius**2 - ((seen[:, :2] - ray) ** 2).sum(axis=1)
        depth = np.where(square > 0, seen[:, 2] + np.sqrt(np.maximum(square, 0)), -1e9)
        best = np.sort(depth)[-2:]
        if np.abs(square).min() < 1e-4 or 0 < best[1] - best[0] < 1e-4:
            continue  # on an edge or a crease, within single precision
        pixel = image[row, column]
        if square.max() < 0:
            assert is_white(pixel)
        else:
            # a glint is white: the own colour is the largest part all the same
            assert np.argmax(pixel) == np.argmax(depth) % 3


def test_size_place_and_edges():
    """One sphere off centre: its area and its middle to a part of a pixel."""
    axes = compute_camera_axes(EYE)
    position = (np.array([0.73, -0.41, 0.0]) @ axes)[None]
    image = render_spheres(camera(EYE), position, np.array([1.0]), np.array([[0.0, 0.0, 0.0]]))
    # black but for its glint, so darkness on the sphere's outer half measures coverage
    cover = 1.0 - image.min(axis=2)
    rows, columns = np.nonzero(cover > 0.02)
    scale = PIXELS / 6.0
    # the outermost covered samples lie within a third of a pixel of the edge
    assert columns.min() + 0.5 == pytest.approx((3.73 - 1.0) * scale, abs=1.0)
    assert columns.max() + 0.5 == pytest.approx((3.73 + 1.0) * scale, abs=1.0)
    assert rows.min() + 0.5 == pytest.approx((3.41 - 1.0) * scale, abs=1.0)
    assert rows.max() + 0.5 == pytest.approx((3.41 + 1.0) * scale, abs=1.0)
    levels = np.unique(np.round(9 * cover[cover < 0.8]))
    assert len(levels) >= 7  # antialiased: pixels at the edge are covered by ninths


def test_light_comes_from_the_upper_left():
    image = render_spheres(
        camera(EYE), np.zeros((1, 3)), np.array([2.0]), np.array([[0.5, 0.5, 0.5]])
    )
    middle, off = PIXELS // 2, PIXELS // 5
    assert image[middle - off, middle - off, 1] > 1.3 * image[middle + off, middle + off, 1]


def test_a_sphere_casts_its_shadow():
    """On what lies behind it, away from the light; light itself falls beside it."""
    from dusttaichi.plots.spheres import LIGHT

    axes = compute_camera_axes(EYE)
    light = LIGHT / np.linalg.norm(LIGHT)
    grey = np.full((2, 3), 0.5)
    alone = render_spheres(camera(EYE), np.zeros((1, 3)), np.array([1.5]), grey[:1])
    both = render_spheres(
        camera(EYE), np.array([np.zeros(3), 4.0 * light @ axes]), np.array([1.5, 0.4]), grey
    )
    column = int((3.0 + 1.5 * light[0]) * PIXELS / 6.0)
    row = int((3.0 - 1.5 * light[1]) * PIXELS / 6.0)
    assert both[row, column, 1] < 0.85 * alone[row, column, 1]
    # the unshaded side differs by what the far neighbour hides of the sky alone
    away = int(PIXELS * 0.6)
    np.testing.assert_allclose(both[away, away], alone[away, away], atol=0.02)


@pytest.mark.parametrize("depth, shown", [(1.5, True), (-1.5, False)])
def test_lines_pass_in_front_and_behind(depth, shown):
    axes = compute_camera_axes(EYE)
    ends = (np.array([[-2.5, 0.0, depth], [2.5, 0.0, depth]]) @ axes)[None]
    lines = Lines(ends, np.array([False]), colour=(0.0, 1.0, 0.0))
    image = render_spheres(
        camera(EYE), np.zeros((1, 3)), np.array([1.0]), np.array([RED]), lines=lines
    )
    green = (image[..., 1] > 0.9) & (image[..., 0] < 0.3)
    middle = PIXELS // 2
    assert green[middle - 1 : middle + 1, middle].any() == shown
    assert green[middle - 1 : middle + 1, 15].any()  # beside the sphere it is always seen


# Figures.

R = 0.5e-6


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Three snapshots of a box that shrinks, with a trimer, a pair and a single grain."""
    x = np.array([[1, 1, 1], [2, 1, 1], [3, 1, 1], [1, 3, 2], [1, 3, 3], [3, 3, 3.4]]) * 1e-6
    v = np.arange(18.0).reshape(6, 3) * 1e-2
    frames = [
        {
            "position": x * [1, 1, f],
            "velocity": v,
            "pairs": [[0, 1], [1, 2], [3, 4]],
            "box": np.array([0.5, 3.5, 0.5, 3.5, 0.3, 4.2 * f]) * 1e-6,
        }
        for f in (1.0, 0.95, 0.9)
    ]
    path = tmp_path_factory.mktemp("run") / "result.nc"
    with analysis.open_run(snapshots.write(path, frames, R, box=np.zeros(6))) as opened:
        yield opened


def pixels(figure):
    return film._image(figure).astype(float) / 255.0


@pytest.mark.parametrize(
    "color, ticks", [("coordination", ["0", "1", "2"]), ("fragment", ["3", "2", "others (1)"])]
)
def test_discrete_colours(run, color, ticks):
    figure = plots.grains(run, color=color, dpi=60)
    bar = figure.axes[-1]
    assert [label.get_text() for label in bar.get_yticklabels()] == ticks


def test_continuous_colours_have_units(run):
    speed = plots.grains(run, color="speed", dpi=60).axes[-1]
    height = plots.grains(run, color="height", dpi=60).axes[-1]
    assert "cm/s" in speed.get_ylabel() and "µm" in height.get_ylabel()
    # the lowest and the highest grain
    np.testing.assert_allclose(height.get_ylim(), (0.9, 0.9 * 3.4), rtol=1e-12)
    axes = plots.grains(run, color=np.arange(6.0), label="number", dpi=60).axes[-1]
    assert axes.get_ylabel() == "number"
    assert len(plots.grains(run, color="uniform", dpi=60).axes) == 2  # picture and scale bar
    rcparams_before = dict(matplotlib.rcParams)
    plots.grains(run, dpi=40)
    assert dict(matplotlib.rcParams) == rcparams_before


def test_nothing_is_clipped(run):
    """A white frame remains around grains and cell in every view."""
    for view in drawing.VIEWS:
        figure = plots.grains(run, color="uniform", view=view, dpi=50)
        shown = figure.axes[0].images[0].get_array()
        for edge in (shown[0], shown[-1], shown[:, 0], shown[:, -1]):
            assert np.all(edge > 0.99), view
        assert (shown < 0.6).any()


def test_a_chain_leaves_room_for_its_colour_bar(tmp_path):
    chain = {"position": np.arange(30.0)[:, None] * [2 * R, 0.0, 0.0]}
    with analysis.open_run(snapshots.write(tmp_path / "result.nc", [chain], R)) as opened_run:
        figure = plots.grains(opened_run, view="front", color="speed", dpi=60)
    figure.canvas.draw()
    text = figure.axes[-1].yaxis.label.get_window_extent()
    assert text.y0 > 0 and text.y1 < figure.bbox.height and text.x1 < figure.bbox.width


def test_scale_bar_has_its_length(run):
    figure = plots.grains(run, view="front", color="uniform", dpi=100)
    (line,), (text,) = figure.axes[1].lines, figure.axes[1].texts
    assert text.get_text() == "500 nm"
    inches = np.ptp(line.get_xdata())
    shown = figure.axes[0].images[0].get_array()
    # seen from the front, the cell is 3 um wide: its upright edges are the outermost dark columns
    dark = np.flatnonzero((shown.max(axis=2) < 0.9).mean(axis=0) > 0.5)
    metres = 3e-6 / (dark[-1] - dark[0])  # a pixel, to the width of the lines
    assert inches * 100 * metres == pytest.approx(500e-9, rel=0.01)


@pytest.mark.parametrize(
    "largest, nice", [(5.0, 5.0), (4.99, 2.0), (1e-6, 1e-6), (9.9e-7, 5e-7), (0.3, 0.2)]
)
def test_nice_length(largest, nice):
    assert round_length(largest) == pytest.approx(nice)


def test_edges_of_cells(run, tmp_path):
    nan = np.nan

    def segments(box, periodic=""):
        name = f"{len(list(tmp_path.iterdir()))}.nc"
        frame = {"position": np.full((1, 3), 0.5e-6)}
        path = snapshots.write(tmp_path / name, [frame], R, box=np.array(box), periodic=periodic)
        with analysis.open_run(path) as opened_run:
            return find_cell_edges(read_frame(opened_run))

    ends, dashed = segments([0, 1e-6] * 3)
    assert len(ends) == 12 and not dashed.any()
    ends, dashed = segments([0, 1e-6] * 3, "x y z")
    assert len(ends) == 12 and dashed.all()
    ends, dashed = segments([0, 1e-6] * 3, "x y")  # a floor and a lid: only uprights are dashed
    assert len(ends) == 12 and np.array_equal(dashed, np.ptp(ends[:, :, 2], axis=1) > 0)
    ends, dashed = segments([nan] * 4 + [0, 1e-6])  # plates: two squares
    assert len(ends) == 8 and np.all(np.ptp(ends[:, :, 2], axis=1) == 0)
    ends, dashed = segments([nan] * 4 + [0, nan])  # a floor
    assert len(ends) == 4 and np.all(ends[..., 2] == 0)
    assert len(segments([nan] * 6)[0]) == 0


def test_refusals(run):
    with pytest.raises(DustError, match="allowed: coordination, speed"):
        plots.grains(run, color="red")
    for view in ("left", "0,0,0", "1,2", (1.0, np.nan, 0.0)):
        with pytest.raises(DustError, match="allowed: oblique, front"):
            plots.grains(run, view=view)
    with pytest.raises(DustError, match="There are 6 grains"):
        plots.grains(run, color=[1.0, 2.0], dpi=40)


def test_films(run, tmp_path, monkeypatch):
    path = plots.animation(run, tmp_path / "a.gif", dpi=50)
    with Image.open(path) as images:
        assert images.n_frames == 3 and images.info["loop"] == 0
        first = np.asarray(images.convert("RGB"), float)
        images.seek(2)
        assert np.abs(np.asarray(images.convert("RGB"), float) - first).max() > 100  # it moves
    path = plots.animation(run, tmp_path / "a.mp4", color="fragment", dpi=50)
    assert path.read_bytes()[4:8] == b"ftyp"
    with pytest.raises(DustError, match=r"allowed: \.gif and \.mp4"):
        plots.animation(run, tmp_path / "a.avi")
    with pytest.raises(DustError, match="ffmpeg could not write"):
        plots.animation(run, tmp_path / "missing" / "a.mp4", dpi=50)
    monkeypatch.setattr(film.shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(DustError, match=r"allowed: \.gif.*dusttaichi\[export\]"):
        plots.animation(run, tmp_path / "a.mp4", dpi=40)


def test_command(run, tmp_path):
    path = tmp_path / "a.png"
    call = ["render", run.path, "--snapshot", 0, "--color", "height", "--view", "1,-1,1"]
    dust(*call, "--dpi", 100, "-o", path)
    image = matplotlib.image.imread(path)
    assert image.shape[1] > 600  # some six inches
    assert image[..., :3].std() > 0.05  # not blank
