"""Compression up to dense packing: the law of Tatsuuma et al. 2023, its numbers and figure."""

import numpy as np
import pytest
import synthetic
from figures import legend, line
from scenes import bundled

from dusttaichi import analysis, plots
from dusttaichi.errors import DustError
from dusttaichi.physics import laws
from dusttaichi.scene.material import NAMED, Material

ICE, SILICATE = (Material(**NAMED[name]) for name in ("ice_t19", "silicate_s12"))


@pytest.fixture(scope="module")
def own():
    with bundled("tatsuuma2023/compressive_strength.py") as module:
        yield module


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Pressed from 0.01 to 0.1, then stretched to 0.03."""
    path = synthetic.cell_run(tmp_path_factory.mktemp("cell") / "result.nc")
    with analysis.open_run(path) as run:
        yield run


def test_law(own):
    ice, silicate = ((m.surface_energy, m.radius, m.critical_rolling) for m in (ICE, SILICATE))
    thin = np.array([1e-5, 1e-4])
    # 1/0.74 beside 1/phi: 3 phi/0.74
    expected = laws.isotropic_pressure(thin, *ice)
    np.testing.assert_allclose(own.compressive_strength(thin, *ice), expected, rtol=5e-4)
    assert np.all(np.isinf(own.compressive_strength([0.74, 0.8], *ice)))
    dense = laws.rolling_energy(*silicate) / SILICATE.radius**3 * (1 / 0.5 - 1 / 0.74) ** -3
    assert own.compressive_strength(0.5, *silicate) == pytest.approx(dense)


def test_ratio(own, cell):
    """The law of 2023 is phi^3 over (1 - phi/0.74)^3; the pressure is 1.3 of phi^3."""
    thin = own.dense_ratio(cell, 0.02, 0.05)
    assert thin.value == pytest.approx(1.3 * (1 - 0.033 / 0.74) ** 3, rel=0.05)
    assert np.isnan(own.dense_ratio(cell).value)  # pressed to 0.1 only
    assert analysis.summary(cell)["dense_ratio"] is None


def test_numbers_of_a_dense_cell(own, tmp_path):
    path = synthetic.cell_run(tmp_path / "result.nc", phi_init=0.3)
    with analysis.open_run(path) as run:
        numbers, ratio = analysis.summary(run), own.dense_ratio(run)
        assert numbers["dense_ratio"] == ratio.value
        assert numbers["dense_ratio_low"] == ratio.low >= own.DENSE
        assert numbers["dense_ratio_scatter"] == ratio.scatter
        rows = {row[0]: row for row in analysis.table(numbers)}
        assert rows["… over (E_roll/r^3)(1/phi - 1/0.74)^-3"][2] == "1 (Tatsuuma et al. 2023)"


def test_figure_has_both_laws(own, cell):
    (axes,) = plots.figures_of(cell)["isotropic"].axes
    labels = legend(axes)
    assert sum("E_" in text for text in labels) == 2
    assert any("Tatsuuma" in text for text in labels)


def test_shares_of_the_channels(own, cell):
    """Of synthetic losses every channel has the same share at all filling factors."""
    result = own.loss_shares(cell)
    np.testing.assert_allclose(sum(result.by_channel.values()), 1.0)
    assert len(result.filling_factor) >= 8 and np.all(np.diff(result.filling_factor) > 0)
    for name, share in result.by_channel.items():
        wanted = synthetic.SHARES[list(cell.series.channel.values).index(name)]
        np.testing.assert_allclose(share, wanted / synthetic.SHARES.sum(), rtol=1e-9)
    (axes,) = plots.figures_of(cell)["loss_shares"].axes
    np.testing.assert_allclose(line(axes, "rolling").get_ydata(), result.by_channel["rolling"])
    with pytest.raises(DustError, match="not compressed enough"):
        own.loss_shares(cell, decades=3.0)
