"""Figures: they come out, say what they show, and leave matplotlib as it was."""

from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
import synthetic
from figures import legend, line
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from dusttaichi import analysis, plots
from dusttaichi.analysis.profile import join_cut_bins
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import dynamic_law
from dusttaichi.plots import style
from dusttaichi.plots.notebook import ShownFigures
from dusttaichi.plots.structure import _draw_forces


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    slow = synthetic.compression_run(folder / "slow" / "result.nc")
    fast = synthetic.compression_run(folder / "fast" / "result.nc", law=dynamic_law(2.0))
    with analysis.open_run(slow) as slow_run, analysis.open_run(fast) as fast_run:
        yield [slow_run, fast_run]


def test_save_figures(runs, tmp_path):
    rcparams_before = dict(matplotlib.rcParams)
    paths = plots.save_figures(runs[0], tmp_path / "figures")
    names = {path.name for path in paths}
    assert names == {"compression.png", "coordination.png", "ledger.png", "profile.png"}
    for path in paths:
        image = matplotlib.image.imread(path)
        assert image.shape[0] > 500 and image.shape[1] > 800  # fit for print
        assert image[..., :3].std() > 0.05  # not blank
    assert dict(matplotlib.rcParams) == rcparams_before
    (tmp_path / "file").write_text("")
    with pytest.raises(DustError, match="cannot be written"):
        plots.save_figures(runs[0], tmp_path / "file" / "figures")


def test_compression_shows_runs_and_laboratory(runs):
    figure = plots.compression(runs, ["slow", "fast"], laws=[dynamic_law(2.0)])
    (axes,) = figure.axes
    labels = legend(axes)
    assert {"slow", "fast", "S12 eq 33 at 2 m/s"} <= set(labels)
    assert any("S12 eq 31" in label for label in labels)
    assert any("G09" in label for label in labels)
    assert "kPa" in axes.get_xlabel() and axes.get_xscale() == "log"
    curve = analysis.measure_compression_curve(runs[0])
    np.testing.assert_allclose(line(axes, "slow").get_xdata(), curve.pressure / 1e3)
    assert not any("unidirectional" in label for label in labels)
    with pytest.raises(DustError, match="labels"):
        plots.compression(runs, ["one"])


def test_ledger_and_profile_have_units(runs):
    upper, lower = plots.ledger(runs[0]).axes
    assert "J)" in upper.get_ylabel() and lower.get_yscale() == "log"
    assert "s)" in lower.get_xlabel() and len(legend(upper)) == 8
    (axes,) = plots.profile(runs[0], max_profiles=3).axes
    assert "µm" in axes.get_ylabel() and len(legend(axes)) == 4


def test_a_scene_without_walls_has_a_ledger_only(tmp_path):
    features = {"snapshots"}
    with synthetic.writer(tmp_path / "result.nc", 2, features=features) as writer:
        for step in range(3):
            writer.append("series", synthetic.series_record(step, features))
    with analysis.open_run(tmp_path) as run:
        assert [path.stem for path in plots.save_figures(run, tmp_path, ".svg")] == ["ledger"]


def test_styles_differ_in_size_and_keep_the_proportions(runs):
    sizes = {}
    for name in style.STYLES:
        with style.use_style(name):
            sizes[name] = plots.coordination(runs[0]).get_size_inches()
    assert sizes["column"][0] == 3.46 and sizes["talk"][0] > sizes["page"][0]
    assert len({round(height / width, 6) for width, height in sizes.values()}) == 1
    with pytest.raises(DustError, match="allowed: page, column, talk"):
        with style.use_style("poster"):
            pass


def test_notebooks_show_figures():
    """As a PNG on the screen's scale, also where no backend of matplotlib is active."""
    figure, (axes,) = style.create_figure()
    axes.plot([0, 1], [0, 1])
    png, size = figure._repr_png_()
    assert png.startswith(b"\x89PNG") and size == {"width": 499, "height": 355}
    shown = ShownFigures(line=figure, twice=figure)._repr_html_()
    assert shown.count('<img src="data:image/png;base64,') == 2 and "twice" in shown


def test_a_legend_that_would_hide_a_curve_stands_below():
    figure, (axes,) = style.create_figure()
    for n in range(40):  # curves everywhere
        axes.plot([0, 1], [n / 40, n / 40], label=f"curve {n}" if n < 5 else None)
    style.draw_legend(axes)
    assert axes.get_legend() is None and len(figure.legends) == 1
    figure, (axes,) = style.create_figure()
    axes.plot([0, 1], [0, 0.1], label="low")
    axes.set_ylim(0, 1)
    style.draw_legend(axes)
    assert axes.get_legend() is not None and not figure.legends


@style.apply_style
def draw_two_panels(draw_legend=style.draw_legend):
    figure, panels = style.create_figure(rows=2)
    for panel in panels:
        panel.plot([0, 1], [0, 0.1], label="low")
        panel.set(ylim=(0, 1), ylabel="a long label of the axis beside a low panel")
        draw_legend(panel)
    return figure


def test_a_figure_is_laid_out_once_for_its_legends_and_labels_and_once_to_be_saved(
    tmp_path, monkeypatch
):
    layouts, execute = [], ConstrainedLayoutEngine.execute
    monkeypatch.setattr(
        ConstrainedLayoutEngine,
        "execute",
        lambda engine, figure: layouts.append(figure) or execute(engine, figure),
    )
    figure = draw_two_panels()
    assert len(layouts) == 1
    assert all("\n" in axes.get_ylabel() for axes in figure.axes)
    plots.save(figure, tmp_path / "a.png")
    assert len(layouts) == 2


def test_legends_of_helpers_and_failed_figures_go_to_no_other_figure():
    @style.apply_style
    def fail():
        draw_two_panels.__wrapped__()
        raise DustError("no")

    nested = style.apply_style(style.draw_legend)
    assert [legend(axes) for axes in draw_two_panels(nested).axes] == [["low"], ["low"]]
    with pytest.raises(DustError):
        fail()
    assert [legend(axes) for axes in draw_two_panels().axes] == [["low"], ["low"]]


def test_forces_that_are_all_equal_are_drawn():
    figure, (axes,) = style.create_figure()
    _draw_forces(SimpleNamespace(normal_force=np.zeros(5)), axes)
    areas = [bar.get_width() * bar.get_height() for bar in axes.patches]
    assert np.sum(np.array(areas) > 0.0) == 1 and max(bar.get_height() for bar in axes.patches) == 5


def test_a_bin_that_the_wall_cuts_is_one_with_the_next(runs):
    profiles = analysis.read_profiles(runs[0])
    joined_profiles = join_cut_bins(profiles)
    thick = (profiles.bin_upper.clip(max=profiles.height) - profiles.bin_lower).clip(min=0)
    thick = thick.transpose("profile", "bin").values
    cut = 0
    for n, thickness in enumerate(thick):
        last = np.flatnonzero(thickness > 0)[-1]
        is_cut = thickness[last] < 0.5 * thickness[0]
        assert np.isnan(joined_profiles.middle.values[n, last]) == is_cut
        cut += is_cut
        phi = [np.nan_to_num(d.filling_factor.values[n]) for d in (profiles, joined_profiles)]
        expected_thickness = thickness.copy()
        if is_cut:
            expected_thickness[last - 1] += thickness[last]
        assert phi[0] @ thickness == pytest.approx(phi[1] @ expected_thickness)  # no grain is lost
    assert 0 < cut < len(thick)


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """Three cells of different initial filling factor, and two cakes: pressed, pulled apart."""
    folder = tmp_path_factory.mktemp("cells")
    paths = [
        synthetic.cell_run(folder / f"cell{phi}" / "result.nc", phi, last=0.3 * phi, seed=2)
        for phi in (0.1, 0.05, 0.2)
    ]
    paths.append(synthetic.plates_run(folder / "pressed" / "result.nc"))
    paths.append(synthetic.plates_run(folder / "pulled" / "result.nc", pull=2e3))
    opened = [analysis.open_run(path) for path in paths]
    yield opened
    for run in opened:
        run.close()


def test_what_each_run_and_several_have_figures_for(cells, tmp_path):
    cell, _, _, pressed, pulled = cells
    expected = {
        cell: {"ledger", "isotropic", "coordination", "tensile", "losses", "fractal", "stress"},
        pressed: {"ledger", "compression", "coordination"},
        pulled: {"ledger", "tensile", "losses"},
    }
    for run, names in expected.items():
        assert set(plots.draw_figures(run)) == names
    names = {path.stem for path in plots.save_figures(cells, tmp_path, ".svg")}
    assert names == {"isotropic", "tensile", "strength"}  # one alone is compressed by a wall
    # of runs that have nothing else in common what moves
    assert set(plots.draw_figures([cells[3], cells[4]])) == {"kinetic"}
    with pytest.raises(DustError, match="no figure"):
        plots.save_figures([cells[3]], tmp_path)


def test_tensile_of_one_run_and_several(cells):
    (axes,) = plots.tensile(cells[0]).axes
    result = analysis.measure_tensile_strength(cells[0])
    np.testing.assert_allclose(line(axes, "test").get_ydata(), result.stress / 1e3)
    np.testing.assert_allclose(line(axes, "test").get_xdata(), result.filling_factor)
    labels = legend(axes)
    assert any(f"{result.strength / 1e3:.3g} ±" in text for text in labels)
    assert any("T19 eq 33" in text for text in labels)
    assert "kPa" in axes.get_ylabel() and "along x" in axes.get_ylabel()
    top = next(text for text in labels if "largest average" in text)
    assert line(axes, top).get_xdata() == [result.strength_phi]
    (axes,) = plots.tensile(cells[:3], ["a", "b", "c"]).axes
    assert legend(axes) == ["a", "b", "c"] and axes.get_yscale() == "log"  # 12 times as strong
    (axes,) = plots.tensile([cells[0]] * 2, ["a", "b"]).axes
    assert axes.get_yscale() == "linear"
    with pytest.raises(DustError, match="labels"):
        plots.tensile(cells[:2], ["a"])


def test_strength(cells):
    (axes,) = plots.strength(cells[:3], ["a", "b", "c"]).axes
    labels = legend(axes)
    assert {"a", "b", "c"} < set(labels) and axes.get_xscale() == axes.get_yscale() == "log"
    fit = analysis.fit_strength([analysis.measure_tensile_strength(run) for run in cells[:3]])
    assert any(f"{fit.exponent:.2f}" in text and "fit" in text for text in labels)
    # of one material there is one law; a fit over two would mean nothing
    assert sum("T19 eq 33" in text for text in labels) == 1
    both = legend(plots.strength([cells[0], cells[4]]).axes[0])
    assert sum("T19 eq 33" in text for text in both) == 2
    assert not any("fit" in text for text in both)


def test_tensile_isotropic_and_plates(cells):
    (axes,) = plots.isotropic(cells[0]).axes
    result = analysis.measure_isotropic_compression(cells[0])
    np.testing.assert_allclose(line(axes, "test").get_ydata(), result.pressure)
    assert axes.get_xscale() == axes.get_yscale() == "log" and "Pa" in axes.get_ylabel()
    assert sum("E_" in text for text in legend(axes)) == 1
    (axes,) = plots.compression(cells[3]).axes
    labels = legend(axes)
    assert "laboratory, unidirectional (G09)" in labels and "inner cylinder" in labels
    assert not any("S12" in text for text in labels)


def test_fractal_and_losses_and_stress(cells):
    upper, lower = plots.fractal(cells[0]).axes
    assert len(legend(upper)) == 6 and "radius" in lower.get_xlabel()  # four snapshots, two slopes
    (axes,) = plots.losses(cells[0]).axes
    assert "J)" in axes.get_ylabel() and "largest stress" in legend(axes)
    assert "largest stress" not in legend(plots.losses(cells[0].stage("press")).axes[0])
    upper, lower = plots.stress(cells[0]).axes
    assert "in tension" in upper.get_ylabel() and "s)" in lower.get_xlabel()
    assert len(legend(upper)) == len(legend(lower)) == 3
    with pytest.raises(DustError, match="has no stress"):
        plots.stress(cells[3])


def test_bands():
    axes = Figure().subplots()
    x, mean, std = np.arange(4.0), np.array([1.0, 2.0, np.nan, 4.0]), np.full(4, 0.5)
    drawn = plots.draw_bands(x, mean, std, axes, label="ten replicas", number=2)
    assert drawn.get_label() == "ten replicas"
    np.testing.assert_array_equal(drawn.get_ydata(), mean)
    (band,) = axes.collections
    low, high = (f([v for p in band.get_paths() for v in p.vertices[:, 1]]) for f in (min, max))
    assert (low, high) == (0.5, 4.5)
