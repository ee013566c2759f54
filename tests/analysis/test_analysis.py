"""What is made of a result: curves, fits, ledger, summary, on runs whose answer is known."""

import numpy as np
import pytest
import synthetic
import xarray as xr
from program import dust

from dusttaichi import analysis, report
from dusttaichi.analysis.profile import average_inner_filling_factor
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import G09_OMNIDIRECTIONAL, S12_STATIC, CompressionLaw, dynamic_law


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = synthetic.compression_run(tmp_path_factory.mktemp("run") / "result.nc")
    with analysis.open_run(path.parent) as opened:
        yield opened


def curve_of(law, noise, points=400, seed=0, first=0.152, last=0.55):
    """The Curve of a run along `law` with log-normal scatter [dex], without a file."""
    phi = np.linspace(first, last, points)
    scatter = noise * np.random.default_rng(seed).standard_normal(points)
    return curve_through(phi, law.pressure(phi) * 10**scatter)


def curve_through(phi, pressure):
    return analysis.measure_compression_curve(
        synthetic.make_run(filling_factor=phi, pressure=pressure)
    )


@pytest.mark.parametrize("noise", [0.03, 0.1])
@pytest.mark.parametrize("law", [S12_STATIC, dynamic_law(2.0)], ids=lambda law: law.name)
def test_fit_recovers_the_law(law, noise):
    """Over 40 samples: unbiased, and within the stated 1 sigma about as often as it should be."""
    fits = [analysis.fit_compression(curve_of(law, noise, seed=seed)) for seed in range(40)]
    for name in ("p_m", "delta"):
        values = np.array([getattr(fit, name) for fit in fits])
        sigma = np.array([fit.sigma[name] for fit in fits])
        pull = (values - getattr(law, name)) / sigma
        # expected 1 with a scatter of 0.11 for 40 samples; the uncertainty is to be no more than
        # some 40 % too small, nor twice too large
        assert 0.5 < pull.std() < 1.45
        assert abs(np.median(pull)) < 0.6
        assert np.all(np.abs(pull) < 5)


def test_fit_of_all_four_numbers():
    law = CompressionLaw(0.13, 0.6, 9e3, 0.5)
    curve = curve_of(law, 0.01, first=0.132, last=0.58)
    fit = analysis.fit_compression(curve, free=("phi1", "phi2"))
    for name in ("phi1", "phi2", "p_m", "delta"):
        assert abs(getattr(fit.law, name) - getattr(law, name)) < 5 * fit.sigma[name]
    compression = analysis.fit_compression(curve, phi1=0.13, phi2=0.6)
    assert compression.sigma["phi1"] == 0 and compression.p_m_sigma < fit.p_m_sigma
    with pytest.raises(DustError, match="too few"):
        analysis.fit_compression(curve_of(S12_STATIC, 0, points=3))


def test_misfit_widens_the_uncertainty():
    """A curve that is not of the form of the law, without any noise, has no certain p_m."""
    phi = np.linspace(0.16, 0.5, 400)
    bent = curve_through(phi, G09_OMNIDIRECTIONAL.pressure(phi))
    exact = curve_through(phi, S12_STATIC.pressure(phi))
    assert analysis.fit_compression(bent).p_m_sigma > 20 * analysis.fit_compression(exact).p_m_sigma


def test_distance_from_a_law():
    deviation = analysis.measure_deviation(curve_of(S12_STATIC, 0.0), S12_STATIC)
    # linear interpolation between bins 0.01 apart, and the median of a bin for its mean
    assert deviation.rms < 3e-4 and deviation.largest < 1e-3 and deviation.complete
    assert (deviation.p_low, deviation.p_high) == pytest.approx((1e3, 1e5))
    # a law shifted by 0.02 in filling factor is 0.02 away, with its sign
    phi = np.linspace(0.17, 0.55, 800)
    curve = curve_through(phi, S12_STATIC.pressure(phi - 0.02))
    deviation = analysis.measure_deviation(curve, S12_STATIC)
    assert deviation.rms == pytest.approx(0.02, abs=3e-4)
    assert deviation.mean == pytest.approx(0.02, abs=3e-4)
    last = float(S12_STATIC.filling_factor(1e4))
    deviation = analysis.measure_deviation(curve_of(S12_STATIC, 0.0, last=last), S12_STATIC)
    assert not deviation.complete and deviation.rms < 1e-3
    assert deviation.p_high < 1e4 and deviation.covered == pytest.approx(0.5, abs=0.03)
    nothing = analysis.measure_deviation(curve_of(S12_STATIC, 0.0), S12_STATIC, 1e8, 1e9)
    assert nothing.covered == 0 and np.isnan(nothing.rms)


def test_a_sample_that_gives_way_jumps():
    """Pressure falls back while the filling factor grows: the curve stays single-valued."""
    phi = np.linspace(0.16, 0.5, 600)
    pressure = S12_STATIC.pressure(phi)
    gives = (phi > 0.3) & (phi < 0.4)
    pressure[gives] = pressure[gives][0] * np.linspace(1, 0.5, gives.sum())
    decades, monotone = curve_through(phi, pressure).monotone()
    assert np.all(np.diff(decades) > 0) and np.all(np.diff(monotone) > 0)
    below, above = np.interp(
        decades[np.searchsorted(monotone, 0.35)] + np.array([-0.1, 0.1]), decades, monotone
    )
    assert below < 0.31 and above > 0.39


def test_bursts_and_tension_do_not_matter():
    phi = np.linspace(0.152, 0.55, 2000)
    pressure = S12_STATIC.pressure(phi)
    pressure[::20] *= 30
    pressure[:10] = -50.0  # the sample pulls at the wall before it presses
    curve = curve_through(phi, pressure)
    assert np.all(curve.pressure > 0) and len(curve.raw_pressure) == 2000
    assert analysis.measure_deviation(curve, S12_STATIC).rms < 2e-3


def test_ledger(run):
    books = analysis.compute_ledger(run)
    assert books.worst == pytest.approx(np.abs(books.relative).max()) and 1e-9 < books.worst < 1e-6
    assert books.reference[-1] >= books.work[-1]
    lost = sum(books.losses.values())
    # sums of some 1e-9 J in double precision
    np.testing.assert_allclose(books.stored - books.work + lost, books.residual, atol=1e-22)
    assert sum(books.shares.values()) == pytest.approx(1)
    expected = dict(zip(books.losses, synthetic.SHARES, strict=True))
    assert books.shares == pytest.approx(expected)
    broken = run.series.copy(deep=True)
    broken.energy_residual[3] = np.nan
    assert analysis.compute_ledger(analysis.Run("run", broken)).worst == np.inf


def test_summary_and_table(run):
    numbers = analysis.summarise(run)
    assert numbers["grains"] == 1000 and numbers["steps"] == 199_000
    assert numbers["steps_per_second"] == pytest.approx(2000)
    assert abs(numbers["p_m"] - S12_STATIC.p_m) < 4 * numbers["p_m_sigma"]
    assert numbers["rms"] < 0.02 and numbers["rms_covered"] == 1
    assert numbers["contacts_per_grain"] == numbers["contacts"] / 1000
    rows = {row[0]: row for row in analysis.tabulate(numbers)}
    assert rows["p_m"][1].endswith("kPa") and rows["p_m"][2] == "16.67 kPa"
    assert "(1-100 kPa)" in rows["rms distance of the filling factor from S12 eq 31"][1]
    assert numbers["rms"] < numbers["largest"] < 0.02
    assert numbers["largest_p_low"] == pytest.approx(1e2)  # the curve begins below
    assert numbers["largest_p_high"] == pytest.approx(1.5e5)  # and ends above
    assert numbers["inner_filling_factor"] is None  # three bins high


def test_summary_of_a_run_without_compression(tmp_path):
    features = {"snapshots", "contacts"}
    with synthetic.writer(tmp_path / "result.nc", 2, features=features) as writer:
        writer.append("series", synthetic.series_record(0, features))
    with analysis.open_run(tmp_path) as run:
        numbers = analysis.summarise(run)
        assert numbers["p_m"] is None and numbers["rms"] is None and numbers["ledger_worst"] == 0
        assert "p_m" not in {row[0] for row in analysis.tabulate(numbers)}
        with pytest.raises(DustError, match="no filling factor"):
            analysis.measure_compression_curve(run)
        with pytest.raises(DustError, match="no profiles"):
            analysis.read_profiles(run)
    # and one just begun
    synthetic.writer(tmp_path / "begun" / "result.nc").close()
    with analysis.open_run(tmp_path / "begun") as run:
        numbers = analysis.summarise(run)
        assert numbers["steps"] is None and numbers["p_m"] is None
        assert analysis.tabulate(numbers)[0][:2] == ("status", "running")


def test_profiles(run):
    few = analysis.read_profiles(run, max_count=3)
    assert few.sizes["profile"] == 3
    assert float(few.middle.max()) < float(few.height.max())
    assert np.isnan(few.filling_factor[-1, -1]) and np.isnan(few.middle[-1, -1])
    assert analysis.read_profiles(run).sizes["profile"] == 5


def test_filling_factor_of_the_inner_part():
    """Without two bins at either wall, a bin that the top one's edge cuts by its part."""
    phi = [9.0, 9.0, 0.2, 0.3, 0.4, 9.0, 9.0, np.nan]
    lower = np.arange(8.0)
    profiles = xr.Dataset(
        {
            "filling_factor": (("profile", "bin"), [phi, [9.0, 9.0, 0.5, 9.0, *4 * [np.nan]]]),
            "height": ("profile", [6.5, 4.0]),
            "bin_lower": ("bin", lower),
            "bin_upper": ("bin", lower + 1.0),
        }
    )
    inner = average_inner_filling_factor(profiles)
    assert inner[0] == pytest.approx((0.2 + 0.3 + 0.5 * 0.4) / 2.5)  # of rounding errors only
    assert np.isnan(inner[1])  # 2 to 2: nothing in between


def test_curve_of_the_inner_part(tmp_path):
    """That of the profiles, at the times of the series."""
    path = synthetic.compression_run(tmp_path / "result.nc", points=50, grains=10_000)
    with analysis.open_run(path) as run:
        curve = analysis.measure_compression_curve(run, quantity="inner_filling_factor")
        numbers = analysis.summarise(run)
    ends = average_inner_filling_factor(run.profiles)[[0, -1]]
    np.testing.assert_allclose(curve.raw_filling_factor[[0, -1]], ends, rtol=1e-12)
    assert len(curve.raw_pressure) == run.series.sizes["time"]
    assert numbers["inner_filling_factor"] == pytest.approx(ends[-1])
    assert abs(numbers["inner_mean"]) < 0.02  # the noise of the profiles and their denser bottom
    with pytest.raises(DustError, match="it has no inner filling factor"):
        analysis.measure_compression_curve(
            analysis.Run("run", run.series), quantity="inner_filling_factor"
        )


def test_contacts_of_a_snapshot(run):
    last = run.contacts()
    count = run.tree["snapshots"].contact_count.values
    assert last.sizes["contact"] == count[-1] and np.all(last.grain_j == 199)
    assert run.contacts(0).sizes["contact"] == count[0] and np.all(run.contacts(0).grain_j == 0)
    touching = run.contacts(-1, "wall_contacts")
    # the group has a variable `wall` of its own, beside the labels of that name at the root
    assert touching.wall.dims == ("wall_contact",) and touching.wall.values.tolist() == [5, 5]
    assert touching.foot.sel(xyz="z").dims == ("wall_contact",)


def test_contacts_of_grains_that_do_not_exist_are_refused(run):
    with pytest.raises(DustError, match="grain_i of the contacts of snapshot 1 names grain 1000;"):
        analysis.read_frame(run)
    with pytest.raises(DustError, match="allowed: 0 to 999"):
        report.collect_report_data([run])
    assert analysis.read_frame(run, contacts=False).contacts is None


def test_what_is_no_result(tmp_path):
    with pytest.raises(DustError, match="no result"):
        analysis.open_run(tmp_path)
    (tmp_path / "result.nc").write_text("something else")
    with pytest.raises(DustError, match="cannot be read"):
        analysis.open_run(tmp_path)
    xr.Dataset({"a": 1}).to_netcdf(tmp_path / "other.nc")
    with pytest.raises(DustError, match="no time series"):
        analysis.open_run(tmp_path / "other.nc")


# -- the commands ---------------------------------------------------------------------------------


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


def test_compare_on_the_command_line(folder, tmp_path, capsys):
    """Errors of fits are not taken for scatter: of one sample each the tables say what ± is."""
    dust("compare", folder / "a", folder / "b", "--output", tmp_path / "runs.csv")
    heading = (tmp_path / "runs.csv").read_text().splitlines()[0]
    assert "strength_law" in heading and "p_m" not in heading
    capsys.readouterr()
    dust("compare", folder / "box", folder / "a", "--output", tmp_path / "all.csv")
    heading, box, cell = (tmp_path / "all.csv").read_text().splitlines()
    assert "strength_law" in heading and "p_m_sigma" in heading
    text = capsys.readouterr().out
    assert "± kPa" in text and "±: one sample each, fit error only" in text
    with analysis.open_run(folder / "box") as run:
        rows = dict(row[:2] for row in analysis.tabulate(analysis.summarise(run)))
    # both numbers are of the same contacts, and say so
    assert rows["contacts per grain"].endswith("each contact counts twice)")
    assert rows["meaning of ±"].startswith("one sample: fit error only")
    with pytest.raises(DustError, match="no result"):
        dust("compare", folder / "nothing")
