"""Figures: they come out, say what they show, and leave matplotlib as it was."""

import matplotlib
import numpy as np
import pytest
import synthetic

from dusttaichi import analysis, plots
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import dynamic_law


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    slow = synthetic.compression_run(folder / "slow" / "result.nc")
    fast = synthetic.compression_run(folder / "fast" / "result.nc", law=dynamic_law(2.0))
    with analysis.open_run(slow) as one, analysis.open_run(fast) as other:
        yield [one, other]


def texts(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


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
    labels = texts(axes)
    assert {"slow", "fast", "S12 eq 33 at 2 m/s"} <= set(labels)
    assert any("S12 eq 31" in label for label in labels)
    assert any("G09" in label for label in labels)
    assert "kPa" in axes.get_xlabel() and axes.get_xscale() == "log"
    curve = analysis.compression_curve(runs[0])
    line = next(line for line in axes.lines if line.get_label() == "slow")
    np.testing.assert_allclose(line.get_xdata(), curve.pressure / 1e3)
    assert not any("unidirectional" in label for label in labels)
    with pytest.raises(DustError, match="labels"):
        plots.compression(runs, ["one"])


def test_ledger_and_profile_have_units(runs):
    upper, lower = plots.ledger(runs[0]).axes
    assert "J)" in upper.get_ylabel() and lower.get_yscale() == "log"
    assert "s)" in lower.get_xlabel() and len(texts(upper)) == 8
    (axes,) = plots.profile(runs[0], most=3).axes
    assert "µm" in axes.get_ylabel() and len(texts(axes)) == 4


def test_a_scene_without_walls_has_a_ledger_only(tmp_path):
    features = {"snapshots"}
    with synthetic.writer(tmp_path / "result.nc", 2, features=features) as writer:
        for step in range(3):
            writer.append("series", synthetic.series_record(step, features))
    with analysis.open_run(tmp_path) as run:
        assert [path.stem for path in plots.save_all(run, tmp_path, ".svg")] == ["ledger"]
