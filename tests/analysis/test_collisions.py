"""What many collisions mean together: means over seeds, spectra, thresholds, figures."""

import numpy as np
import pytest
from figures import legend
from scenes import import_bundled
from snapshots import collision_row as row

from dusttaichi import analysis, plots
from dusttaichi.analysis.collisions import (
    build_collisions_dataset,
    fit_fragment_slope,
    format_collision_table,
    select_fragments,
    tabulate_collisions,
)
from dusttaichi.analysis.outcome import DEFINITIONS
from dusttaichi.analysis.threshold_tables import (
    build_threshold_variables,
    explain_missing_thresholds,
    format_threshold_columns,
    format_threshold_csv,
)
from dusttaichi.analysis.thresholds import find_thresholds
from dusttaichi.errors import DustError
from dusttaichi.report import collect_collisions_data


def dataset(rows, by_area=1):
    axes = {"body": ("a",), "mass_ratio": (1.0,), "speed": (1.0,), "impact_parameter": (0.1, 0.5)}
    return build_collisions_dataset(
        rows, axes | {"seed": (0, 1)}, {"by_area": by_area, "title": "t"}
    )


def test_means_and_errors_over_seeds():
    rows = [
        row(),
        row(growth_efficiency=0.4),
        {"outcome": "miss", "grains": 10},
        row("sticking", (10,)),
    ]
    header, lines = tabulate_collisions(dataset(rows))
    found = [dict(zip(header, line, strict=True)) for line in lines]
    assert [(one["over"], one["collisions"], one["hit"]) for one in found] == [
        ("point", 2, 1.0),
        ("point", 2, 0.5),
        ("area", 4, 0.75),
    ]
    # 0.2 and 0.4: mean 0.3, sqrt(0.02/2) by hand
    assert found[0]["growth_efficiency"] == pytest.approx(0.3)
    assert found[0]["growth_efficiency_error"] == pytest.approx(0.1)
    assert np.isnan(found[1]["growth_efficiency_error"])
    assert found[2]["share_fragmentation"] == pytest.approx(2 / 3)
    assert found[0]["loss_rolling"] == 0.5 and found[1]["second"] == 0.0
    assert np.isnan(found[0]["compression_loss"])
    # [J], of 2 J that are available
    phases = {"compression_loss": 1.5, "stretching_loss": 0.4, "collision_loss": 1.95}
    phases["kinetic"] = 0.05
    header, lines = tabulate_collisions(dataset([row(**phases)] * 4))
    one = dict(zip(header, lines[0], strict=True))
    assert (one["compression_loss"], one["stretching_loss"]) == pytest.approx((0.75, 0.8))
    text = format_collision_table(dataset(rows, by_area=0)).splitlines()
    assert len(text) == 3 and ",nan," not in "".join(text)


def growing(speeds, limits, bounces=False):
    """A dataset in which pair n grows by ln(limits[n] / speed): its threshold is limits[n]."""
    rows = [
        row("bouncing" if bounces and v > 3 else "growth", growth_efficiency=np.log(limit / v))
        for v in speeds for _ in range(2) for limit in limits
    ]  # fmt: skip
    axes = {"body": ("a",), "mass_ratio": (1.0,), "speed": tuple(speeds)}
    axes |= {"impact_parameter": (0.1, 0.5), "seed": tuple(range(len(limits)))}
    return build_collisions_dataset(rows, axes)


def test_thresholds_with_their_confidence():
    """Thresholds of eight pairs with a scatter of 0.3 in ln v about 20 m/s: the mean growth is
    linear in ln v, so that its threshold is the geometric mean of theirs, exactly."""
    limits = 20.0 * np.exp(0.3 * np.random.default_rng(2).standard_normal(8))
    data = growing(np.geomspace(5, 80, 7), limits, bounces=True)
    stick, fragment = find_thresholds(data)
    with import_bundled("oshiro2025/bouncing.py"):
        same, also, bounce = thresholds = find_thresholds(data)
    assert (same, also) == (stick, fragment)
    mean, error = np.exp(np.log(limits).mean()), np.log(limits).std(ddof=1) / np.sqrt(8)
    assert fragment.speed == pytest.approx(mean, rel=1e-9)
    # of 1000 draws from eight; theirs is the standard deviation with 8, not 7 below it
    for end, sign in ((fragment.low, -1), (fragment.high, 1)):
        assert np.log(end / mean) == pytest.approx(sign * error, rel=0.15)
    # none sticks or stops to bounce from the first speed on
    assert (stick.speed, bounce.speed) == (0.0, 0.0) and bounce.high == 0.0
    assert find_thresholds(growing([5.0, 8.0], [90.0, 95.0]))[1].speed == np.inf
    assert np.isnan(find_thresholds(growing([5.0, 80.0], [20.0]))[1].low)
    (axes,) = plots.threshold_speeds(data, thresholds).axes
    assert legend(axes) == [r"$v_{\rm fragment}$"]
    header, line = format_threshold_csv(thresholds).splitlines()
    cells = dict(zip(header.split(","), line.split(","), strict=True))
    assert float(cells["v_fragment_m_per_s"]) == pytest.approx(mean, rel=1e-3)
    beyond = find_thresholds(growing([5.0, 8.0], [90.0, 95.0]))
    texts = dict(format_threshold_columns(beyond)[1])
    assert texts["v_fragment m/s"] == ["> 8"] == texts["v_stick m/s"]


def test_a_study_has_a_report():
    """Its figures and the means at each speed; the thresholds with their intervals."""
    data = collect_collisions_data(at_speeds([STICKS] * 2, [FAILS] * 2, [BREAKS] * 2))
    assert "v_stick of a, 1:1: 30 (10 to 90; censored at 30) m/s" in data["remark"]
    assert "docs/studies/outcomes.md" in data["remark"]
    assert data["table"][0][0] == "speed m/s" and [row[0] for row in data["table"][1:]] == [
        "10", "30", "90",
    ]  # fmt: skip
    names = [figure["name"] for figure in data["figures"]]
    assert names == ["outcomes", "growth", "spectrum"] and "image" in data["figures"][0]
    assert "v_stick" not in collect_collisions_data(at_speeds([FAILS, MISSES]))["remark"]


def test_a_folder_without_a_result_says_what_is_in_it(tmp_path):
    """A study, how to open it, and its runs."""

    def explain():
        with pytest.raises(DustError) as error:
            analysis.open_run(tmp_path)
        return str(error.value)

    assert explain() == f"There is no result at {tmp_path / 'result.nc'}."
    for name in ("replica_0", "point_1/replica_0"):  # of an interrupted sweep
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "result.nc").touch()
    runs = f" Runs in it (2): {tmp_path / 'replica_0'}, {tmp_path / 'point_1/replica_0'}."
    assert explain().endswith(f"result.nc.{runs}")
    openings = {
        "study.nc": f'xarray.open_dataset("{tmp_path / "study.nc"}")',
        "trade.nc": f'analysis.open_trade("{tmp_path}")',
        "sweep.nc": f"`dust report {tmp_path}` shows it",
    }
    for name, opening in openings.items():
        (tmp_path / name).touch()
        assert explain().startswith(f"{tmp_path} is the folder of a {name[:-3]}, not of a run: ")
        assert opening in explain() and explain().endswith(runs)
    with pytest.raises(DustError, match="There is no result at .*nowhere.$"):
        analysis.open_run(tmp_path / "nowhere")
    with pytest.raises(DustError, match="'sweep': there is none; allowed: trade, ensemble,"):
        analysis.open_study(tmp_path, "sweep")


# -- failed collisions ---------------------------------------------------------------------------

FAILS, MISSES = {"error": "it failed"}, {"outcome": "miss"}
STICKS, BREAKS = row("sticking", (10,), growth_efficiency=1.0), row(growth_efficiency=-0.8)


def at_speeds(*rows):
    """A dataset of head-on collisions at 10, 30, 90 ... m/s; rows: of the seeds, for each speed."""
    axes = {"body": ("a",), "mass_ratio": (1.0,), "impact_parameter": (0.0,)}
    axes |= {"speed": tuple(10.0 * 3.0**n for n in range(len(rows)))}
    axes |= {"seed": tuple(range(len(rows[0])))}
    return build_collisions_dataset([collision for seeds in rows for collision in seeds], axes)


def texts_of(data):
    return {name: texts[0] for name, texts in format_threshold_columns(find_thresholds(data))[1]}


def test_no_threshold_from_no_data():
    """Neither a collision that missed nor one that failed says on which side of it a speed is."""
    data = at_speeds([FAILS, MISSES])
    thresholds = find_thresholds(data)
    assert np.isnan(
        [(threshold.speed, threshold.low, threshold.high) for threshold in thresholds]
    ).all()
    assert set(texts_of(data).values()) == {"-"}
    assert format_threshold_csv(thresholds).splitlines()[1] == "a,1.0," + "," * 12
    assert explain_missing_thresholds(data) == [
        "no threshold of a, 1:1: of 2 collisions 1 missed and 1 failed"
    ]
    variables = data.assign(build_threshold_variables(thresholds, data))
    assert np.isnan(variables.v_stick) and np.isnan(variables.v_fragment_high)
    assert not explain_missing_thresholds(at_speeds([STICKS, FAILS]))


def test_a_speed_at_which_collisions_failed_is_censored():
    stick, fragment = find_thresholds(at_speeds([STICKS] * 2, [FAILS] * 2))
    for threshold in (stick, fragment):  # all that is known: 10 m/s is below the threshold
        assert (threshold.speed, threshold.low, threshold.high) == (np.inf, 10.0, np.inf)
        assert (threshold.speeds, threshold.censored) == ((10.0,), (30.0,))
    assert texts_of(at_speeds([STICKS], [FAILS]))["v_stick m/s"] == "> 10 (censored at 30)"
    # between two speeds that decide: the interval is between these
    data = at_speeds([STICKS] * 2, [FAILS] * 2, [BREAKS] * 2)
    assert texts_of(data)["v_stick m/s"] == "30 (10 to 90; censored at 30)"
    # below all that decide
    assert (
        texts_of(at_speeds([FAILS], [BREAKS]))["v_stick m/s"] == "< 30 (< 30 to 30; censored at 10)"
    )
    # beyond the threshold they change nothing
    data = at_speeds([STICKS] * 2, [BREAKS] * 2, [FAILS] * 2)
    assert texts_of(data)["v_stick m/s"] == "17.3"
    header, line = format_threshold_csv(find_thresholds(at_speeds([STICKS], [FAILS]))).splitlines()
    cells = dict(zip(header.split(","), line.split(","), strict=True))
    assert cells["v_stick_m_per_s"] == "inf" and cells["v_stick_speeds_to_m_per_s"] == "10"
    assert cells["v_stick_censored_m_per_s"] == "30"


def test_a_speed_decides_if_its_failed_collisions_cannot_change_the_side():
    """Two of five pairs stick: the last two decide whether half do. Four of six: they cannot."""
    thresholds = find_thresholds(at_speeds([STICKS] * 5, [STICKS, BREAKS, BREAKS, FAILS, FAILS]))
    assert thresholds[0].censored == (30.0,) and thresholds[0].speed == np.inf
    thresholds = find_thresholds(at_speeds([STICKS] * 6, [STICKS, *[BREAKS] * 4, FAILS]))
    assert not thresholds[0].censored
    # the mean of those with an outcome is 0.2: between 1 at 10 and 0.2 at 30 m/s
    assert thresholds[0].speed == pytest.approx(10.0 * 3.0 ** (0.5 / 0.8))
    # growth efficiencies of equal bodies are from -1 to 1: two of 1 lift three of -0.8 to -0.08
    thresholds = find_thresholds(at_speeds([STICKS] * 5, [*[BREAKS] * 3, FAILS, FAILS]))
    assert not thresholds[1].censored
    thresholds = find_thresholds(at_speeds([STICKS] * 5, [*[BREAKS] * 2, *[FAILS] * 3]))
    assert thresholds[1].censored == (30.0,)


def test_a_condition_that_may_end_again_is_open_from_the_first_censored_speed_on():
    bounces = row("bouncing", (5, 5), growth_efficiency=0.0)
    with import_bundled("oshiro2025/bouncing.py"):
        speeds = ([STICKS] * 2, [FAILS] * 2, [STICKS] * 2, [bounces] * 2)
        *_, bounce = find_thresholds(at_speeds(*speeds))
    assert bounce.speed == pytest.approx(90.0 * 3.0**0.5)
    assert bounce.low == 10.0 and bounce.high == bounce.speed and bounce.censored == (30.0,)


def test_the_dataset_has_thresholds_and_definitions():
    data = at_speeds([STICKS] * 2, [FAILS] * 2, [BREAKS] * 2)
    data = data.assign(build_threshold_variables(find_thresholds(data), data))
    assert data.v_stick.dims == ("body", "mass_ratio") and data.v_stick.attrs["units"] == "m/s"
    assert data.v_stick.item() == pytest.approx(30.0) and data.v_stick_low.item() == 10.0
    assert data.v_stick_censored.values.ravel().tolist() == [0, 1, 0]
    assert "half of the pairs" in data.v_stick.attrs["long_name"]
    assert all(f"{name}: " in data.outcome.attrs["definitions"] for name in DEFINITIONS)


def test_remnants_are_no_fragments_of_the_spectrum():
    data = dataset(
        [row(), {"outcome": "miss"}, row(fragments=(5, 2, 2, 1)), row("sticking", (10,))]
    )
    grains, collisions = select_fragments(data, np.ones(data.outcome.shape, bool))
    assert sorted(grains) == [1, 1, 2] and collisions == 3
    # 10 000 fragments drawn from n(N) ~ N^-2.5 up to 500 grains: within three standard errors
    sizes = np.arange(1, 501)
    weights = sizes**-2.5
    rng = np.random.default_rng(1)
    tau, error = fit_fragment_slope(rng.choice(sizes, 10_000, p=weights / weights.sum()), 500)
    assert 0.005 < error < 0.05 and abs(tau - 2.5) < 3 * error
    assert np.isnan(fit_fragment_slope([1, 2, 3], 10)[0]) and np.isnan(
        fit_fragment_slope([1] * 20, 10)[0]
    )


def test_figures_of_few_and_of_failed_collisions():
    rows = [row(), {"error": "it failed"}, {"outcome": "miss"}, row("bouncing", (5, 5))]
    data = dataset(rows)
    axes = plots.outcome_map(data).axes[0]
    widths = sorted(round(patch.get_width(), 2) for patch in axes.patches)
    assert widths == [0.47] * 4  # two halves in each of two cells
    assert len(plots.growth(data).axes[0].lines) >= 2
    assert plots.phases(data) is None
    losses = {"compression_loss": 1.6, "stretching_loss": 0.3}  # [J], of 2 J
    losses |= {"collision_loss": 2.0, "kinetic": 0.0}
    (axes,) = plots.phases(dataset([row(**losses)] * 4)).axes
    drawn = [line.get_ydata()[0] for line in axes.lines if len(line.get_ydata()) == 1]
    assert drawn[0] == pytest.approx(0.8) and 0.75 == pytest.approx(drawn[-1], abs=0.06)
    assert (
        "no fragments"
        in plots.fragment_spectrum(dataset([rows[3]] * 4)).axes[0].texts[0].get_text()
    )
