"""The strength of what is stretched: its maximum, how certain it is, and fits, on known curves."""

import numpy as np
import pytest
import synthetic
import xarray as xr

from dusttaichi import analysis
from dusttaichi.analysis.tensile import WIDEST
from dusttaichi.errors import DustError
from dusttaichi.physics import laws

ICE = synthetic.ICE
T19 = float(laws.tensile_strength(0.1, ICE.surface_energy, ICE.radius))


def stretch(noise=0.0, points=400, seed=0, strength=1e3, last=0.03, edges=True, phi_init=0.1):
    """A Run stretched along y without a file; nothing is known of its grains."""
    rng = np.random.default_rng(seed)
    length = np.linspace(1.0, phi_init / last, points)
    phi = phi_init / length
    halfway = 0.5 * (phi + np.concatenate([phi[:1], phi[:-1]]))
    stress = np.zeros((points, 3, 3))
    stress[:, 1, 1] = synthetic.stretched_stress(halfway, phi_init, strength)
    stress[:, 1, 1] += noise * strength * rng.standard_normal(points)
    box = np.stack([np.ones(points), length, np.ones(points)], axis=1)
    data = {
        "step": ("time", np.arange(points)),
        "filling_factor": ("time", phi),
        "stress": (("time", "xyz", "axis"), stress),
    }
    data |= {"box_length": (("time", "xyz"), box)} if edges else {}
    labels = {"time": 1e-6 * np.arange(points), "xyz": list("xyz"), "axis": list("xyz")}
    return analysis.Run("run", xr.Dataset(data, labels))


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.3])
def test_strength(noise):
    """Maximum 1 kPa at half the initial filling factor, over 20 samples of the noise."""
    results = [analysis.tensile(stretch(noise, seed=seed)) for seed in range(20)]
    assert all(t.axis == "y" and t.phi_init == pytest.approx(0.1) and t.passed for t in results)
    assert all(t.window <= WIDEST + 1e-12 for t in results)
    assert all(np.isnan(t.law) for t in results)  # of what grains the file does not tell
    error = np.array([t.strength - 1e3 for t in results])
    sigma = np.array([t.strength_sigma for t in results])
    # a window 10 % wide averages the parabola around the maximum: 0.3 % lower at most; the
    # largest of some ten noisy averages is too large by one or two of their uncertainty
    assert np.all(error > -4 - 3 * sigma) and np.all(error < 4 * sigma + 1e-6)
    if noise == 0.3:  # the widest windows, whose scatter of 20 to 40 records is known to 15 %
        records = np.array([t.count[np.argmax(t.stress)] for t in results])
        assert np.median(sigma / (0.3e3 / np.sqrt(records))) == pytest.approx(1, abs=0.25)
    # the maximum is flat: half a per cent below it lies 7 % to either side
    assert np.all(np.abs([t.strength_phi / 0.05 - 1 for t in results]) < 0.07 + 1.2 * noise)
    for t in results:
        assert t.strength_strain == pytest.approx(0.1 / t.strength_phi - 1, rel=0.01)


def test_windows():
    fine = analysis.tensile(stretch(0.0))
    rough = analysis.tensile(stretch(0.5))
    assert len(fine.stress) > 5 * len(rough.stress)
    assert rough.window == pytest.approx(WIDEST, rel=0.1)
    chosen = analysis.tensile(stretch(0.5), windows=4)
    assert len(chosen.stress) == 4 and chosen.count.sum() == 399
    # even relative changes of the filling factor, whose ends are those of the raw records
    raw = chosen.raw_filling_factor
    assert chosen.window == pytest.approx(1 - (raw.min() / raw.max()) ** 0.25)
    assert np.all(np.diff(chosen.filling_factor) < 0)


def test_records_count_by_their_duration():
    """Three records, the last of them three times as long: its stress counts three times."""
    run = stretch(points=4, last=0.095)
    stress = run.series.stress.copy()
    stress[:, 1, 1] = [np.nan, 1.0, 1.0, 5.0]
    series = run.series.assign_coords(time=[0.0, 1.0, 2.0, 5.0]).assign(
        stress=(("time", "xyz", "axis"), stress.values)
    )
    t = analysis.tensile(analysis.Run("run", series), windows=1)
    assert t.strength == pytest.approx(17 / 5) and t.count.tolist() == [3]


def test_correlated_noise_is_less_certain():
    rng = np.random.default_rng(4)
    run = stretch()
    kicks = rng.standard_normal(400)
    slow = np.convolve(kicks, np.ones(8), "same") / np.sqrt(8)
    sigma = []
    for noise in (kicks, slow):
        series = run.series.copy(deep=True)
        series.stress[:, 1, 1] += 50.0 * noise
        sigma.append(analysis.tensile(analysis.Run("run", series), windows=12).strength_sigma)
    # eight records that go together: sqrt(8) in the limit of long windows
    assert 1.5 < sigma[1] / sigma[0] < 5


def test_a_maximum_not_yet_passed():
    t = analysis.tensile(stretch(last=0.07))
    assert not t.passed and t.strength < 1e3


def test_plates_pulled_apart(tmp_path):
    path = synthetic.plates_run(tmp_path / "result.nc", pull=2e3)
    with analysis.open_run(path) as run:
        assert run.stretches and not run.compresses
        t = analysis.tensile(run)
        assert t.axis == "z" and t.phi_init == pytest.approx(0.2)
        assert t.strength == pytest.approx(2e3, abs=4 * t.strength_sigma + 8)
        assert t.strength_strain == pytest.approx(1.0, abs=0.15)  # twice as high at the maximum
        assert t.law == pytest.approx(float(laws.tensile_strength(0.2, 0.025, 0.6e-6)))
        with pytest.raises(DustError, match="no stress along x"):
            analysis.tensile(run, axis="x")


def test_strain_without_the_edges():
    t = analysis.tensile(stretch(edges=False), axis="y")
    assert t.strength_strain == pytest.approx(0.1 / t.strength_phi - 1)


def test_fit_of_several_strengths():
    runs = [
        stretch(phi_init=phi, last=0.3 * phi, strength=3e5 * phi**1.7) for phi in (0.03, 0.1, 0.3)
    ]
    results = [analysis.tensile(run) for run in runs]
    fit = analysis.fit_strength(results)
    # without noise the three are cut alike, so the law comes back but for the window's 0.3 %
    assert fit.exponent == pytest.approx(1.7, abs=1e-6) and fit.exponent_sigma < 1e-6
    assert fit.factor == pytest.approx(3e5, rel=3e-3)
    assert fit.strength(0.1) == pytest.approx(results[1].strength, rel=1e-6)
    assert np.isnan(analysis.fit_strength(results[:2]).exponent_sigma)
    assert analysis.fit_strength(results[:1]) is None
    assert analysis.fit_strength([results[0]] * 3) is None
