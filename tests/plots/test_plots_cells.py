"""Figures of stretched and pressed cells, of plates, and of several runs in one."""

import numpy as np
import pytest
import synthetic
from figures import legend, line
from matplotlib.figure import Figure

from dusttaichi import analysis, plots
from dusttaichi.errors import DustError


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Three cells of different initial filling factor, and two cakes: pressed, pulled apart."""
    folder = tmp_path_factory.mktemp("runs")
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


def test_what_each_run_has_figures_for(runs):
    cell, _, _, pressed, pulled = runs
    expected = {
        cell: {"ledger", "isotropic", "coordination", "tensile", "losses", "fractal", "stress"},
        pressed: {"ledger", "compression", "coordination"},
        pulled: {"ledger", "tensile", "losses"},
    }
    for run, names in expected.items():
        assert set(plots.figures_of(run)) == names


def test_tensile(runs):
    (axes,) = plots.tensile(runs[0]).axes
    result = analysis.tensile(runs[0])
    np.testing.assert_allclose(line(axes, "test").get_ydata(), result.stress / 1e3)
    np.testing.assert_allclose(line(axes, "test").get_xdata(), result.filling_factor)
    said = legend(axes)
    assert any(f"{result.strength / 1e3:.3g} ±" in text for text in said)
    assert any("T19 eq 33" in text for text in said)
    assert "kPa" in axes.get_ylabel() and "along x" in axes.get_ylabel()
    top = next(text for text in said if "largest average" in text)
    assert line(axes, top).get_xdata() == [result.strength_phi]


def test_several_tensile(runs):
    (axes,) = plots.tensile(runs[:3], ["a", "b", "c"]).axes
    assert legend(axes) == ["a", "b", "c"] and axes.get_yscale() == "log"  # 12 times as strong
    (axes,) = plots.tensile([runs[0]] * 2, ["a", "b"]).axes
    assert axes.get_yscale() == "linear"
    with pytest.raises(DustError, match="labels"):
        plots.tensile(runs[:2], ["a"])


def test_strength(runs):
    (axes,) = plots.strength(runs[:3], ["a", "b", "c"]).axes
    said = legend(axes)
    assert {"a", "b", "c"} < set(said) and axes.get_xscale() == axes.get_yscale() == "log"
    fit = analysis.fit_strength([analysis.tensile(run) for run in runs[:3]])
    assert any(f"{fit.exponent:.2f}" in text and "fit" in text for text in said)
    # of one material there is one law; a fit over two would mean nothing
    assert sum("T19 eq 33" in text for text in said) == 1
    both = legend(plots.strength([runs[0], runs[4]]).axes[0])
    assert sum("T19 eq 33" in text for text in both) == 2
    assert not any("fit" in text for text in both)


def test_isotropic(runs):
    (axes,) = plots.isotropic(runs[0]).axes
    result = analysis.isotropic(runs[0])
    np.testing.assert_allclose(line(axes, "test").get_ydata(), result.pressure)
    assert axes.get_xscale() == axes.get_yscale() == "log" and "Pa" in axes.get_ylabel()
    assert sum("E_" in text for text in legend(axes)) == 1


def test_fractal_and_losses_and_stress(runs):
    upper, lower = plots.fractal(runs[0]).axes
    assert len(legend(upper)) == 6 and "radius" in lower.get_xlabel()  # four snapshots, two slopes
    (axes,) = plots.losses(runs[0]).axes
    assert "J)" in axes.get_ylabel() and "largest stress" in legend(axes)
    assert "largest stress" not in legend(plots.losses(runs[0].stage("press")).axes[0])
    upper, lower = plots.stress(runs[0]).axes
    assert "in tension" in upper.get_ylabel() and "s)" in lower.get_xlabel()
    assert len(legend(upper)) == len(legend(lower)) == 3
    with pytest.raises(DustError, match="has no stress"):
        plots.stress(runs[3])


def test_compression_between_plates(runs):
    (axes,) = plots.compression(runs[3]).axes
    said = legend(axes)
    assert "laboratory, unidirectional (G09)" in said and "inner cylinder" in said
    assert not any("S12" in text for text in said)


def test_several_runs_in_one(runs, tmp_path):
    names = {path.stem for path in plots.save_all(runs, tmp_path, ".svg")}
    assert names == {"isotropic", "tensile", "strength"}  # one alone is compressed by a wall
    # of runs that have nothing else in common what moves
    assert set(plots.figures_of([runs[3], runs[4]])) == {"kinetic"}
    with pytest.raises(DustError, match="no figure"):
        plots.save_all([runs[3]], tmp_path)


def test_bands():
    axes = Figure().subplots()
    x, mean, std = np.arange(4.0), np.array([1.0, 2.0, np.nan, 4.0]), np.full(4, 0.5)
    drawn = plots.bands(x, mean, std, axes, label="ten replicas", number=2)
    assert drawn.get_label() == "ten replicas"
    np.testing.assert_array_equal(drawn.get_ydata(), mean)
    (band,) = axes.collections
    low, high = (f([v for p in band.get_paths() for v in p.vertices[:, 1]]) for f in (min, max))
    assert (low, high) == (0.5, 4.5)
