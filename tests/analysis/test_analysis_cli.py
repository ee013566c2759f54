"""`dust plot` and `dust compare` on results of every kind."""

import pytest
import synthetic
from program import dust

from dusttaichi import analysis
from dusttaichi.errors import DustError


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    synthetic.cell_run(folder / "a" / "result.nc")
    synthetic.cell_run(folder / "b" / "result.nc", phi_init=0.2, last=0.06)
    synthetic.compression_run(folder / "box" / "result.nc")
    return folder


def test_plot_one_and_several(folder, tmp_path):
    dust("plot", folder / "a", "--output", tmp_path / "one")
    assert (tmp_path / "one" / "tensile.png").exists()
    dust("plot", folder / "a", folder / "b", "--output", tmp_path / "two")
    names = {path.name for path in (tmp_path / "two").iterdir()}
    assert names == {"isotropic.png", "tensile.png", "strength.png"}


def test_compare(folder, tmp_path):
    dust("compare", folder / "a", folder / "b", "--output", tmp_path / "runs.csv")
    heading = (tmp_path / "runs.csv").read_text().splitlines()[0]
    assert "strength_law" in heading and "p_m" not in heading
    dust("compare", folder / "box", folder / "a", "--output", tmp_path / "all.csv")
    heading, box, cell = (tmp_path / "all.csv").read_text().splitlines()
    assert "strength_law" in heading and "p_m_sigma" in heading
    with pytest.raises(DustError, match="no result"):
        dust("compare", folder / "nothing")


def test_errors_of_fits_are_not_taken_for_scatter(folder, capsys):
    """One sample: the table of the run and that of several say what their ± is."""
    with analysis.open_run(folder / "box") as run:
        rows = dict(row[:2] for row in analysis.table(analysis.summary(run)))
    # both numbers are of the same contacts, and say so
    assert rows["contacts per grain"].endswith("each has two grains)")
    assert rows["± of the numbers above"].startswith("one sample: fit error only")
    dust("compare", folder / "box", folder / "a")
    text = capsys.readouterr().out
    assert "± kPa" in text and "±: one sample each, fit error only" in text
