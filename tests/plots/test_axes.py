"""Axes that can be read: ticks of logarithmic ones, long labels, names of stages."""

import numpy as np
import pytest

from dusttaichi.plots import style
from dusttaichi.plots.axes import break_text, finish_figure
from dusttaichi.report.dark import darken, darken_colour
from dusttaichi.report.interactive import convert_label, make_interactive


def shown_ticks(axes):
    axes.figure.canvas.draw()
    low, high = axes.get_ylim()
    ticks = axes.yaxis.get_major_ticks()
    return [t.label1.get_text() for t in ticks if low <= t.get_loc() <= high]


@pytest.mark.parametrize(
    ("limits", "first", "count"),
    [
        ((7.6, 8.9), "7.75", 5),  # where 8 alone would be labelled
        ((0.7, 1.2), "0.7", 4),
        ((1.1, 6.0), "2", 5),
        ((1.0, 60.0), "1", 6),
        ((1e-2, 1e3), "$10^{-2}$", 6),
        ((1e-20, 1e3), "$10^{-18}$", 8),
    ],
)
def test_every_logarithmic_axis_has_labels(limits, first, count):
    figure, (axes,) = style.create_figure()
    axes.plot([0, 1], limits)
    axes.set(yscale="log", ylim=limits)
    finish_figure(figure)
    ticks = shown_ticks(axes)
    assert ticks[0] == first and len(ticks) == count


def test_no_name_of_a_font_is_in_a_label():
    assert convert_label(r"$\mathdefault{2\times10^{-3}}$") == "2×10<sup>−3</sup>"
    figure, (axes,) = style.create_figure()
    axes.loglog([3.0, 40.0], [1.0, 2.0])  # as an extension may leave it
    layout = make_interactive(figure, "one", "One")["layout"]
    assert "math" not in str(layout) and layout["xaxis"]["ticktext"]


def test_a_label_longer_than_its_axes_is_broken():
    text = r"stress along x, $\sigma_{xx}$ of all, positive in tension (kPa)"
    assert break_text(text, 0.9) == text
    assert break_text(text, 1.3).count("\n") == 1 and "$\\sigma_{xx}$" in break_text(text, 1.9)
    figure, panels = style.create_grid(3, 3, 1.7, shared=True)
    for panel in panels:
        panel.plot([0, 1], [0, 1])
    figure.supylabel(text)
    finish_figure(figure)
    figure.canvas.draw()
    box = figure._supylabel.get_window_extent(figure.canvas.get_renderer())
    assert box.y0 >= 0 and box.y1 <= figure.bbox.y1


def staged_run(ends):
    """A run whose stages end at these times, in the shape that the names need."""

    def part(number, start):
        series = style_series(number)
        return type("Part", (), {"start": type("S", (), {"time": start}), "series": series})

    def style_series(number):
        return type("Series", (), {"stage": np.array([number])})

    names = [f"stage_{n}" for n in range(len(ends))]
    stages = [part(n, start) for n, start in enumerate([0.0, *ends[:-1]])]
    series = type("Series", (), {"time": np.array([0.0, ends[-1]])})
    return type("Run", (), {"stages": names, "parts": stages, "series": series})


def test_short_stages_are_named_too():
    figure, (axes,) = style.create_figure()
    axes.set_xlim(0.0, 10.0)
    style.name_stages(axes, staged_run([0.05, 9.9, 9.95, 10.0]), 1.0)
    names = [text.get_text() for text in axes.texts]
    assert sorted(names) == ["stage_0", "stage_1", "stage_2", "stage_3"]
    boxes = [text.get_window_extent() for text in axes.texts]
    assert not any(a.overlaps(b) for n, a in enumerate(boxes) for b in boxes[:n])
    axes.plot([0, 10], [0, 1])
    layout = make_interactive(figure, "one", "One")["layout"]
    shifts = [note["yshift"] for note in layout["annotations"]]
    assert len(set(shifts)) > 1 and layout["margin"]["t"] > max(shifts) + 12


def test_pictures_have_a_variant_for_dark_pages():
    figure, (axes,) = style.create_figure()
    image = axes.imshow([[0.0, 1.0]])
    figure.colorbar(image, label="numbers")
    colour_before = image.cmap(0.0)
    interactive = make_interactive(figure, "map", "Map")
    assert interactive["image"] != interactive["image_dark"]
    assert image.cmap(0.0) == colour_before and figure.patch.get_alpha() == 0.0
    assert min(axes.xaxis.label.get_color()[:3]) > 0.8 and axes.patch.get_alpha() == 1.0
    assert darken_colour("white")[0] < 0.1 and darken_colour("black")[0] > 0.8
    pixels = style.create_canvas(2, 2)
    panel = pixels.subplots()
    picture = panel.imshow(np.array([[[255, 255, 255], [9, 9, 9]]], np.uint8))
    darken(pixels)
    assert picture.get_array()[0, :, 3].tolist() == [0, 255]
