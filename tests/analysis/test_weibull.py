"""Weibull statistics of strengths, on samples drawn from known distributions."""

import hashlib

import numpy as np
import pytest
import scipy
import synthetic
import xarray as xr
from figures import legend
from program import dust
from scenes import CONFIGS, EXAMPLES, extensions_forgotten, import_bundled

from dusttaichi import analysis, plots
from dusttaichi.analysis import numbers
from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.analysis.plain import convert_ensemble
from dusttaichi.commands import ensembles
from dusttaichi.report import collect_ensemble_data

OWN = "kimura2020/weibull.py"
with import_bundled(OWN) as own:
    CONFIDENCE, Strengths, fit_size_effect = own.CONFIDENCE, own.Strengths, own.fit_size_effect
    tabulate_strengths, list_strengths = own.tabulate_strengths, own.list_strengths
    fit_weibull = own.fit_weibull


M, S0 = 6.0, 8e3  # modulus; scale [Pa]


def draw_strengths(count, sets=1, m=M, s0=S0, seed=0):
    return s0 * np.random.default_rng(seed).weibull(m, (sets, count))


@pytest.mark.parametrize("count", [5, 10, 200])
def test_largest_likelihood_is_that_of_scipy(count):
    """Within the tolerance of SciPy's simplex, 1e-4."""
    samples = draw_strengths(count)
    (modulus,), (log_scale,) = own._fit_logs(np.log(samples))
    m, _, s0 = scipy.stats.weibull_min.fit(samples[0], floc=0)
    assert (modulus, np.exp(log_scale)) == pytest.approx((m, s0), rel=1e-3)


@pytest.mark.parametrize("count", [5, 10])
def test_intervals_contain_the_truth_as_often_as_they_say(count):
    """Of 600 sets; the share is certain to sqrt(0.68 * 0.32 / 600) = 0.019, and so is half."""
    fits = [fit_weibull(sample) for sample in draw_strengths(count, 600)]
    for name, truth in (("modulus", M), ("scale", S0)):
        low, middle, high = (
            np.array([getattr(sample, name + end) for sample in fits])
            for end in ("_low", "", "_high")
        )
        assert np.mean((low < truth) & (truth < high)) == pytest.approx(CONFIDENCE, abs=3 * 0.019)
        assert np.mean(middle < truth) == pytest.approx(0.5, abs=3 * 0.02)
    sample = fits[0]
    assert (
        sample.failed_fraction(sample.scale) == pytest.approx(1 - np.exp(-1))
        and sample.count == count
    )


def test_too_few_have_no_modulus_no_effect_of_their_size_and_no_table():
    assert fit_weibull([1.0, 2.0, 3.0, 4.0]) is None  # too few
    assert fit_weibull([1.0, 2.0, 3.0, 4.0, -1.0]) is None
    assert fit_weibull([2.0] * 8) is None
    assert fit_size_effect(groups(0.0, sizes=(256,))) is None
    assert fit_size_effect(groups(0.0, count=1)) is None
    data = sweep(np.array([[1e3, 2e3, 3e3]]), (256,))
    assert tabulate_strengths(list_strengths(data)) == ([], []) and own.WEIBULL.draw(data) is None
    assert list_strengths(data.drop_vars("strength")) == []


def groups(exponent, sizes=(256, 1024, 4096), count=10):
    """Strengths of samples whose scale goes with the number of grains as N^exponent."""
    return [
        Strengths(str(n), n, draw_strengths(count, s0=S0 * (n / 256) ** exponent, seed=n)[0], None)
        for n in sizes
    ]


@pytest.mark.parametrize("exponent", [0.0, -1.0 / M])
def test_a_weakest_link_and_no_effect_of_the_size(exponent):
    """300 samples of each size: the scatter of a Weibull's logarithm, pi/(sqrt(6) m), is known to
    3 %, of which three are allowed."""
    effect = fit_size_effect(groups(exponent, count=300))
    assert abs(effect.exponent - exponent) < 3 * effect.exponent_sigma < 0.03
    assert effect.weakest_link == pytest.approx(-1.0 / M, rel=0.1)
    # its uncertainty, by hand: the scatter over the distance of the logarithms of the sizes
    spread = np.sqrt(600) * np.log(4.0)
    by_hand = np.pi / np.sqrt(6.0) / M / spread
    assert effect.exponent_sigma == pytest.approx(by_hand, rel=0.1)


def sweep(values, sizes):
    """The dataset of a sweep over the number of grains, with its strengths [Pa] alone."""
    dims = ("sample_grains", "replica")
    grains = np.broadcast_to(np.array(sizes)[:, None], np.shape(values)).astype(float)
    data = {"strength": (dims, np.array(values)), "grains": (dims, grains)}
    coords = {"sample_grains": list(sizes)}
    return xr.Dataset(data, coords, {"summary_numbers": "strength grains"})


def test_tables_and_figure_of_a_sweep():
    values = np.array([group.values for group in groups(0.0, sizes=(256, 1024))])
    values[1, 3] = np.nan  # a run without strength
    data = sweep(values, (256, 1024))
    assert [len(group.values) for group in list_strengths(data)] == [10, 9]
    columns, lines = tabulate_strengths(list_strengths(data))
    cells = {head: texts for head, texts in columns}
    assert cells["grains"] == ["256", "1,024"] and cells["samples"] == ["10", "9"]
    fit = fit_weibull(values[0])
    assert cells["modulus m"][0].startswith(f"{fit.modulus:.3g} ({fit.modulus_low:.3g} to ")
    assert len(lines) == 2 and "weakest link" in lines[1]
    left_axes, right = own.WEIBULL.draw(data).axes
    np.testing.assert_allclose(left_axes.lines[0].get_xdata(), np.sort(values[0]) / 1e3)
    texts = legend(right)
    assert len(texts) == 2 and "fit" in texts[0] and "weakest link" in texts[1]


# -- of an ensemble and its file -----------------------------------------------------------------


@pytest.fixture
def ensemble(tmp_path):
    """Ten replicas of a cell that is pulled, with strengths drawn, in a file that names OWN."""
    with analysis.open_run(synthetic.cell_run(tmp_path / "result.nc")) as run:
        data = analysis.gather([run] * 10, attrs={"title": "pulled"})
    (tmp_path / "result.nc").unlink()
    data["strength"].values[:] = draw_strengths(10)[0]
    digest = hashlib.sha256((CONFIGS / OWN).read_bytes()).hexdigest()
    data.attrs["extensions"] = f"weibull.py sha256:{digest}"
    save_ensemble(data, tmp_path / "ensemble.nc")
    return data, tmp_path


def test_a_file_of_replicas_brings_its_statistics(ensemble, capsys):
    data, folder = ensemble
    with extensions_forgotten():
        assert "weibull" not in plots.draw_figures(data)
        dust("plot", folder)
        assert (folder / "weibull.png").exists()
        titles = [figure["title"] for figure in collect_ensemble_data(data, folder)["figures"]]
        assert "Weibull statistics of the tensile strength" in titles
        ensembles._say_statistics(data)
    output = capsys.readouterr().out
    assert "Weibull statistics of the tensile strength" in output and "modulus m" in output


def test_statistics_that_fail_do_not_affect_the_others(ensemble, capsys):
    data, folder = ensemble

    def fails(data):
        raise KeyError("strength_of_another_name")

    with import_bundled(OWN):
        numbers.register(numbers.Statistics(name="wrong", title="own", table=fails, draw=fails))
        ensembles._say_statistics(data)
        failed = []
        assert "weibull" in plots.draw_figures(data, failed)
        assert failed == [("own", "KeyError: 'strength_of_another_name'")]
        remark = collect_ensemble_data(data, folder)["remark"]
        assert "own: KeyError" in remark
        others, wrong = convert_ensemble(data)["statistics"]
        assert "KeyError" in wrong["why"] and others["name"] == "weibull"
        assert others["columns"] and all(line in remark for line in others["lines"])
        with pytest.raises(ValueError, match="another name"):
            numbers.register(numbers.Statistics(name="wrong", title="another"))
    output = capsys.readouterr()
    assert "modulus m" in output.out and "no own: KeyError" in output.err


def test_the_example_of_statistics_is_printed(capsys):
    with import_bundled(EXAMPLES / "scatter.py"):
        dims = ("replica",)
        data = xr.Dataset(
            {"p_m": (dims, [1.0, 3.0]), "mean_p_m": 2.0, "std_p_m": np.sqrt(2.0)},
            attrs={"summary_numbers": "p_m"},
        )
        ensembles._say_statistics(data)
    output = capsys.readouterr().out
    assert "scatter between replicas" in output and "largest: 70.7%" in output
