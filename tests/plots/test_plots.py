"""Figures: they come out, say what they show, and leave matplotlib as it was."""

import matplotlib
import numpy as np
import pytest
import synthetic
from figures import legend, line

from dusttaichi import analysis, plots
from dusttaichi.analysis.profile import without_cut_bins
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import dynamic_law
from dusttaichi.plots import style


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    slow = synthetic.compression_run(folder / "slow" / "result.nc")
    fast = synthetic.compression_run(folder / "fast" / "result.nc", law=dynamic_law(2.0))
    with analysis.open_run(slow) as one, analysis.open_run(fast) as other:
        yield [one, other]


def test_save_all(runs, tmp_path):
    before = dict(matplotlib.rcParams)
    paths = plots.save_all(runs[0], tmp_path / "figures")
    names = {path.name for path in paths}
    assert names == {"compression.png", "coordination.png", "ledger.png", "profile.png"}
    for path in paths:
        image = matplotlib.image.imread(path)
        assert image.shape[0] > 500 and image.shape[1] > 800  # fit for print
        assert image[..., :3].std() > 0.05  # not blank
    assert dict(matplotlib.rcParams) == before
    (tmp_path / "file").write_text("")
    with pytest.raises(DustError, match="cannot be written"):
        plots.save_all(runs[0], tmp_path / "file" / "figures")


def test_compression_shows_runs_and_laboratory(runs):
    figure = plots.compression(runs, ["slow", "fast"], laws=[dynamic_law(2.0)])
    (axes,) = figure.axes
    labels = legend(axes)
    assert {"slow", "fast", "S12 eq 33 at 2 m/s"} <= set(labels)
    assert any("S12 eq 31" in label for label in labels)
    assert any("G09" in label for label in labels)
    assert "kPa" in axes.get_xlabel() and axes.get_xscale() == "log"
    curve = analysis.compression_curve(runs[0])
    np.testing.assert_allclose(line(axes, "slow").get_xdata(), curve.pressure / 1e3)
    assert not any("unidirectional" in label for label in labels)
    with pytest.raises(DustError, match="labels"):
        plots.compression(runs, ["one"])


def test_ledger_and_profile_have_units(runs):
    upper, lower = plots.ledger(runs[0]).axes
    assert "J)" in upper.get_ylabel() and lower.get_yscale() == "log"
    assert "s)" in lower.get_xlabel() and len(legend(upper)) == 8
    (axes,) = plots.profile(runs[0], most=3).axes
    assert "µm" in axes.get_ylabel() and len(legend(axes)) == 4


def test_a_scene_without_walls_has_a_ledger_only(tmp_path):
    features = {"snapshots"}
    with synthetic.writer(tmp_path / "result.nc", 2, features=features) as writer:
        for step in range(3):
            writer.append("series", synthetic.series_record(step, features))
    with analysis.open_run(tmp_path) as run:
        assert [path.stem for path in plots.save_all(run, tmp_path, ".svg")] == ["ledger"]


def test_styles_differ_in_size_and_keep_the_proportions(runs):
    sizes = {}
    for name in style.STYLES:
        with style.using(name):
            sizes[name] = plots.coordination(runs[0]).get_size_inches()
    assert sizes["column"][0] == 3.46 and sizes["talk"][0] > sizes["page"][0]
    assert len({round(height / width, 6) for width, height in sizes.values()}) == 1
    with pytest.raises(DustError, match="allowed: page, column, talk"):
        with style.using("poster"):
            pass


def test_a_legend_that_would_hide_a_curve_stands_below():
    figure, (axes,) = style.new_figure()
    for n in range(40):  # curves everywhere
        axes.plot([0, 1], [n / 40, n / 40], label=f"curve {n}" if n < 5 else None)
    style.legend(axes)
    assert axes.get_legend() is None and len(figure.legends) == 1
    figure, (axes,) = style.new_figure()
    axes.plot([0, 1], [0, 0.1], label="low")
    axes.set_ylim(0, 1)
    style.legend(axes)
    assert axes.get_legend() is not None and not figure.legends


def test_a_bin_that_the_wall_cuts_is_one_with_the_next(runs):
    before = analysis.profile(runs[0])
    after = without_cut_bins(before)
    thick = (before.bin_upper.clip(max=before.height) - before.bin_lower).clip(min=0)
    thick = thick.transpose("profile", "bin").values
    cut = 0
    for n, own in enumerate(thick):
        last = np.flatnonzero(own > 0)[-1]
        one = own[last] < 0.5 * own[0]
        assert np.isnan(after.middle.values[n, last]) == one
        cut += one
        phi = [np.nan_to_num(d.filling_factor.values[n]) for d in (before, after)]
        whole = own.copy()
        if one:
            whole[last - 1] += own[last]
        assert phi[0] @ own == pytest.approx(phi[1] @ whole)  # no grain is lost
    assert 0 < cut < len(thick)
