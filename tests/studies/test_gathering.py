"""Ensembles gathered: mean and scatter over a common coordinate, tables, files, figures."""

import math

import numpy as np
import pytest
import synthetic
import xarray as xr
from figures import legend

from dusttaichi import analysis, plots
from dusttaichi.analysis import ensemble_tables as tables
from dusttaichi.analysis.dependence import against
from dusttaichi.analysis.ensemble import common_coordinate, interpolate
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import S12_STATIC

# -- gathering -----------------------------------------------------------------------------------


def run_of(length, **series):
    """A finished run of ten grains whose series has these variables, and a ledger that closes."""
    zero = np.zeros(length)
    closed = {"loss": np.zeros((length, 6)), "potential": np.zeros((length, 4))}
    closed |= dict.fromkeys(("kinetic_translation", "kinetic_rotation"), zero)
    closed |= dict.fromkeys(("energy_residual", "energy_residual_relative"), zero)
    time = series.pop("time", np.arange(length) * 1.0)
    return synthetic.make_run(time, attrs={"status": "finished", "grains": 10}, **closed | series)


def make_dataset_run(first, last, slope=1.0, points=21):
    """Filling factor from first to last, height = slope * filling factor."""
    phi = np.linspace(first, last, points)
    return run_of(points, filling_factor=phi, height=slope * phi)


def test_mean_and_scatter_over_ragged_ranges():
    data = analysis.gather(
        [
            make_dataset_run(0.1, 0.3),
            make_dataset_run(0.2, 0.4, 2.0),
            None,
            make_dataset_run(0.2, 0.3, 6.0),
        ]
    )
    assert data.attrs["coordinate"] == "filling_factor"
    assert data.height.dims == ("replica", "filling_factor") and data.sizes["replica"] == 4
    phi = data.filling_factor.values
    assert phi[0] == pytest.approx(0.1) and phi[-1] == pytest.approx(0.4)
    low, high = phi < 0.2 - 1e-9, phi > 0.3 + 1e-9
    both = ~low & ~high
    # height is linear in phi, so that linear interpolation is exact up to rounding
    np.testing.assert_allclose(data.mean_height[low], phi[low], rtol=1e-12)
    np.testing.assert_allclose(data.mean_height[both], 3 * phi[both], rtol=1e-12)
    np.testing.assert_allclose(data.mean_height[high], 2 * phi[high], rtol=1e-12)
    std = np.std([1.0, 2.0, 6.0], ddof=1)
    np.testing.assert_allclose(data.std_height[both], std * phi[both], rtol=1e-12)
    assert data.std_height[low | high].isnull().all()
    assert data.height[2].isnull().all() and data.height[0][high].isnull().all()
    assert set(data.replica_count.values[both]) == {3} and set(data.replica_count.values[low]) == {
        1
    }
    # numbers of the summary, next to the series of the same name
    np.testing.assert_allclose(data.final_height, [0.3, 0.8, np.nan, 1.8])
    assert float(data.mean_final_height) == pytest.approx((0.3 + 0.8 + 1.8) / 3)
    assert data.final_height.attrs["units"] == "m"
    assert {"final_height", "grains", "ledger_worst"} <= set(data.attrs["summary_numbers"].split())


def test_a_falling_filling_factor_is_a_coordinate_too():
    data = analysis.gather([make_dataset_run(0.3, 0.1), make_dataset_run(0.2, 0.1, 3.0)])
    phi = data.filling_factor.values
    # the grid has multiples of its step inside the range only
    assert phi[0] == pytest.approx(0.1, abs=0.01) and phi[-1] == pytest.approx(0.3, abs=0.01)
    both = phi < 0.2 + 1e-9
    np.testing.assert_allclose(data.mean_height[both], 2 * phi[both], rtol=1e-12)  # linear
    with pytest.raises(DustError, match="nothing to gather"):
        analysis.gather([None, None])


def test_time_is_the_coordinate_where_the_filling_factor_goes_both_ways():
    falling = [
        run_of(
            n,
            time=np.arange(n) * 0.1,
            filling_factor=0.3 - 0.01 * np.arange(n) * (-1.0) ** np.arange(n),
            stage=np.zeros(n, int),
        )
        for n in (5, 8)
    ]
    data = analysis.gather(falling)
    assert data.attrs["coordinate"] == "time" and "stage" not in data
    # the shorter one is the beginning of the longer one: no interpolation, the same bits
    np.testing.assert_array_equal(data.time, falling[1].series.time)
    np.testing.assert_array_equal(data.filling_factor[0, :5], falling[0].series.filling_factor)
    assert data.filling_factor[0, 5:].isnull().all()


def test_the_last_stage_is_the_one_that_counts():
    phi = np.concatenate([np.linspace(0.4, 0.2, 11), np.linspace(0.21, 0.3, 10)])
    stage = np.repeat([0, 1], [11, 10])
    run = run_of(21, filling_factor=phi, stage=stage, height=phi)
    data = analysis.gather([run])
    assert data.attrs["coordinate"] == "filling_factor"
    np.testing.assert_array_equal(data.filling_factor, phi[11:])
    assert data.std_height.isnull().all() and data.mean_height.notnull().all()


CYCLE = """
boundary: {kind: box}
stages:
  - {name: press, drive: {wall_speed: 1 cm/s}}
  - {name: unload, drive: {wall_speed: -1 cm/s}}
  - {name: reload, drive: {wall_speed: 1 cm/s}}
"""


def cycle(number, back):
    """A run that is pressed, unloaded and loaded again; other replicas are slower.

    back: its filling factor falls in the last stage for a moment.
    """
    phi = np.concatenate([np.linspace(0.2, 0.3, 40), np.linspace(0.3, 0.28, 9)[1:]])
    phi = np.concatenate([phi, np.linspace(0.28, 0.36, 53)[1:]])
    phi[60] -= 0.004 * back
    first = phi >= np.maximum.accumulate(phi) - 1e-12
    pressure = np.where(
        first, 1e6 * phi**4, 1e6 * phi**4 - 3e5 * (np.maximum.accumulate(phi) - phi)
    )
    series = {"filling_factor": phi, "stage": np.repeat([0, 1, 2], [40, 8, 52])}
    time = (1.0 + 0.137 * number) * 1e-6 * np.arange(100)
    attrs = {"stages": "press unload reload", "status": "finished", "grains": 10}
    run = run_of(100, time=time, pressure=pressure * (1.0 + 0.1 * number), **series)
    run.attrs.update(attrs | {"scene_resolved": CYCLE})
    return run


@pytest.mark.parametrize("x, back", [("filling_factor", False), ("time", True)])
def test_runs_with_stages_keep_their_ends_their_extremes_and_their_loading(x, back):
    """The last record and the largest pressure of each run are in the dataset, whose time is common
    although runs reach the same stage at different times; the figure is the compression curve."""
    runs = [cycle(number, back) for number in range(3)]
    data = analysis.gather([*runs, None])
    assert data.attrs["coordinate"] == x
    for number, run in enumerate(runs):
        series = run.series.pressure.sel(wall="top").values
        last = data.pressure.sel(wall="top")[number].dropna(x)
        assert float(last[-1]) == pytest.approx(series[-1], rel=1e-6)
        assert float(last[x][-1]) == pytest.approx(float(run.series[x][-1]), rel=1e-9)
        largest = data.largest_pressure.sel(wall="top", replica=number)
        assert float(largest) == series.max() == series[-1]
        assert float(data.smallest_filling_factor[number]) == run.series.filling_factor.min()
        ends = data.stage_end_pressure.sel(wall="top", replica=number)
        np.testing.assert_array_equal(ends, series[[39, 47, 99]])
        np.testing.assert_array_equal(data.stage_end_time[number], run.series.time[[39, 47, 99]])
        curve = analysis.measure_compression_curve(run)
        row = data.loading_pressure[number].dropna("loading_filling_factor")
        np.testing.assert_array_equal(row, curve.pressure)
        np.testing.assert_allclose(row.loading_filling_factor, curve.filling_factor, atol=0.005)
    assert data.stage.values.tolist() == ["press", "unload", "reload"]
    assert data.stage_end_time[3].isnull().all() and data.largest_pressure[3].isnull().all()
    figure = plots.ensemble(data)
    axes = figure.axes[0]
    assert axes.get_xscale() == "log" and "pressure" in axes.get_xlabel()
    line = max(axes.lines, key=lambda first: first.get_label().startswith("mean"))
    np.testing.assert_allclose(line.get_xdata(), data.mean_loading_pressure.values / 1e3)


def test_grid_of_a_sweep_has_its_dimensions():
    axes = {
        "boundary.wall_speed": xr.Variable("boundary.wall_speed", [0.01, 0.05], {"units": "m/s"}),
        "interaction.damping": xr.Variable("interaction.damping", ["a", "b", "c"]),
    }
    runs = [make_dataset_run(0.1, 0.2, 1.0 + n) for n in range(12)]
    data = analysis.gather(
        runs, axes, {"seed": list(range(12)), "status": ["ok"] * 12}, {"title": "t"}
    )
    assert data.height.dims == (*axes, "replica", "filling_factor")
    sel = data.sel({"boundary.wall_speed": 0.05, "interaction.damping": "b"})
    assert sel.seed.values.tolist() == [8, 9]
    np.testing.assert_allclose(sel.height.isel(filling_factor=-1), [0.2 * 9, 0.2 * 10])
    assert data.mean_height.sizes == {
        "boundary.wall_speed": 2,
        "interaction.damping": 3,
        "filling_factor": 21,
    }
    assert tables.point_labels(data)[4] == "wall speed = 5 cm/s, damping = b"
    assert (
        "final_height" not in tables.table_numbers(data)
        and len(tables.number_texts(data, "final_height")) == 6
    )


def test_a_mean_says_how_many_runs_it_is_of_and_why_others_have_none():
    axes = {"boundary_wall_speed": xr.Variable("boundary_wall_speed", [0.01, 0.05])}
    axes["boundary_wall_speed"].attrs |= {"units": "m/s", "key": "boundary.wall_speed"}
    runs = [
        make_dataset_run(0.1, 0.2, 1.0),
        make_dataset_run(0.1, 0.2, 3.0),
        None,
        *(make_dataset_run(0.1, 0.2, 2.0),) * 3,
    ]
    why = ["", "too rough", "", "", "too short", "too short"]
    data = analysis.gather(runs, axes, {"fit_problem": why}, {"title": "t"})
    texts = tables.number_texts(data, "final_height")
    assert texts[0].endswith("(2 of 3)") and "of" not in texts[1]
    assert tables.point_labels(data) == ["wall speed = 1 cm/s", "wall speed = 5 cm/s"]
    assert tables.list_missing_numbers(data) == [
        ("fit", "wall speed = 1 cm/s", "1 of 3 runs", "too rough"),
        ("fit", "wall speed = 5 cm/s", "2 of 3 runs", "too short"),
    ]
    why = [f"{n} points of 1e-3 m in x_1 are too few" for n in (2, 0, 10, 3, 4, 5)]
    data = analysis.gather(runs, axes, {"fit_problem": why}, {"title": "t"})
    reason = "0 to 10 points of 1e-3 m in x_1 are too few"
    assert tables.list_missing_numbers(data) == [("fit", "", "6 of 6 runs", reason)]
    assert data.sel(boundary_wall_speed=0.05).mean_height.notnull().all()


def test_common_coordinate_meets_the_points_of_series_written_every_so_often():
    # written at multiples of 0.002, each late by less than a step, from its own start on
    rng = np.random.default_rng(1)
    multiples = [np.arange(60, 150) * 0.002, np.arange(71, 140) * 0.002]
    late = [np.concatenate([[m[0] - 0.0011], m + 1e-6 * rng.random(len(m))]) for m in multiples]
    grid = common_coordinate(late)
    ends = [end for run in late for end in (run[0], run[-1])]  # the range of every run
    inner = grid[~np.isin(grid, ends)]
    np.testing.assert_allclose(inner, np.arange(60, 150) * 0.002, rtol=1e-12)
    assert np.isin(ends, grid).all()
    assert common_coordinate([np.array([0.5]), np.array([0.7])]).tolist() == [0.5, 0.7]
    assert common_coordinate([np.array([0.5])]).tolist() == [0.5]
    x, grid = np.array([0.0, 1.0, 3.0]), np.linspace(-1, 4, 51)
    y = np.arange(12.0).reshape(3, 2, 2) ** 2
    interpolated = interpolate(x, y, grid)
    inside = (grid >= 0) & (grid <= 3)
    assert np.isnan(interpolated[~inside]).all()
    for i, j in np.ndindex(2, 2):
        np.testing.assert_allclose(
            interpolated[inside, i, j], np.interp(grid[inside], x, y[:, i, j])
        )


def test_file_keeps_everything_and_is_whole(tmp_path):
    long = "x: 1\n" * 20_000  # attributes of more than 64 kB
    data = analysis.gather(
        [make_dataset_run(0.1, 0.3), make_dataset_run(0.2, 0.4)],
        None,
        {"seed": [1, 2]},
        {"scene_resolved": [long]},
    )
    analysis.save_ensemble(data, tmp_path / "deep/ensemble.nc")
    with xr.open_dataset(tmp_path / "deep/ensemble.nc") as back:
        xr.testing.assert_identical(back.drop_attrs(), data.drop_attrs())
        assert back.attrs["scene_resolved"] == long
        assert back.mean_height.attrs["cell_methods"] == "replica: mean"
        assert "mean_NAME" in back.attrs["convention"]
    (tmp_path / "file").write_text("")
    with pytest.raises(DustError, match="cannot be written"):
        analysis.save_ensemble(data, tmp_path / "file/ensemble.nc")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((21934.0, "Pa", 870.0), "21.93 ± 0.87 kPa"),
        ((0.05, "m/s"), "5 cm/s"),
        ((0.0, "m/s"), "0 m/s"),
        ((5e-6, "m", 0.0), "5 um"),
        ((2000.0, "1", math.nan), "2000"),
        ((8.962e3, "Pa", 3.5e-2), "8.962 kPa"),
        ((7.003e-5, "1"), "7e-05"),
        ((1.5e-7, "1", 2e-8), "1.5e-07 ± 2e-08"),
        ((0.5623, None, 0.0231), "0.562 ± 0.023"),
        ((1234.0, "1", 150.0), "1230 ± 150"),
    ],
)
def test_numbers_are_told_as_far_as_their_scatter(arguments, text):
    assert tables.format_quantity(*arguments) == text


def test_columns_have_a_unit_where_one_fits_all_points_and_tell_which_are_the_same():
    axes = {"boundary.wall_speed": [0.01, 0.05]}
    data = analysis.gather(
        [make_dataset_run(0.1, 0.2, slope) for slope in (1.0, 3.0)], axes, attrs={}
    )
    columns = {column.name: column for column in tables.columns(data)}
    same = columns["final filling factor"]
    assert same.same and same.texts == ["0.2", "0.2"] and same.head == "final filling factor"
    for strengths, unit, texts in (
        ([21.9e3, 700.0], "kPa", ["21.9", "0.7"]),
        ([21.9e6, 700.0], "", ["21.9 MPa", "700 Pa"]),
    ):
        several = data.assign_attrs(summary_numbers="strength")
        for name in ("strength", "mean_strength", "std_strength"):
            values = np.full(2, np.nan) if name.startswith("std") else np.array(strengths)
            dims = ("boundary.wall_speed", "replica")[: 2 if name == "strength" else 1]
            shaped = values.reshape(2, *(1,) * (len(dims) - 1))
            several[name] = xr.Variable(dims, shaped, {"units": "Pa"})
        (column,) = tables.columns(several)
        assert (column.unit, column.texts, column.same) == (unit, texts, False)


def test_what_is_the_same_at_every_point_is_told_once():
    axes = {"sample.seed": [1, 4], "boundary.wall_speed": [0.01]}
    data = analysis.gather([make_dataset_run(0.1, end, 1.0) for end in (0.2, 0.3)], axes, attrs={})
    keys, shown, remark = tables.head_and_columns(data)
    assert keys == [("seed", ("1", "4"))]
    assert shown == [("final filling factor", ["0.2", "0.3"])]
    assert remark.startswith("the same everywhere: wall speed 0.01")
    assert "replicas" not in remark  # seeds are samples
    speeds = data.rename({"sample.seed": "sample.speed"})
    assert tables.head_and_columns(speeds)[2].endswith("samples is unknown (replicas: 3)")
    # of two seeds none is the larger: they are names, also where they are drawn
    seeds = against(data, "final_filling_factor")
    assert seeds.ticks == ["1", "4"] and seeds.varies


def test_lines_of_a_sweep_join_nothing_that_is_not_there():
    """A gap where a run is missing; points alone where the values are names."""
    speeds = xr.Variable("speed", [0.01, 0.02, 0.05, 0.1], {"units": "m/s"})
    runs = [
        make_dataset_run(0.1, 0.2, 1.0),
        None,
        make_dataset_run(0.1, 0.3, 1.0),
        make_dataset_run(0.1, 0.4, 1.0),
    ]
    data = analysis.gather(runs, {"speed": speeds}, attrs={"title": "t"})
    (panel,) = plots.numbers(data).axes
    line = panel.containers[0].lines[0]
    assert np.isnan(line.get_ydata()).tolist() == [False, True, False, False]
    assert line.get_linestyle() == "-"
    names = xr.Variable("damping", ["a", "b", "c", "d"])
    named = plots.numbers(analysis.gather(runs, {"damping": names}, attrs={"title": "t"}))
    assert named.axes[0].containers[0].lines[0].get_linestyle() == "None"


def test_a_band_has_a_gap_where_no_replica_has_a_number():
    data = analysis.gather([make_dataset_run(0.1, 0.2, 1.0)], attrs={"title": "t"})
    data.height[:, 8:13] = np.nan
    (band,) = analysis.bands(data, "height", width=0.0)
    assert np.isnan(band.mean).sum() == 5 and np.isfinite(band.mean[[0, -1]]).all()


# -- figures -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def compressions(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    curves = []
    for seed in range(4):
        path = synthetic.compression_run(
            folder / str(seed) / "result.nc", seed=seed, last=0.5 + 0.01 * seed
        )
        with analysis.open_run(path) as run:
            curves.append(run)
    return curves


def test_band_of_compression_runs(compressions):
    """The mean of runs that scatter about one law lies on it."""
    data = analysis.gather(compressions)
    (band,) = analysis.bands(data, "pressure", wall="top")
    assert band.replicas == 4 and band.label == ""
    inside = (band.x > 0.17) & (band.x < 0.5)
    ratio = band.mean[inside] / S12_STATIC.pressure(band.x[inside])
    # 0.1 dex of noise, medians of some five points, four runs: 3 % of scatter and 4 % of bias
    assert np.all(np.abs(ratio - 1) < 0.3) and abs(np.median(ratio) - 1) < 0.05
    figure = plots.ensemble(data)
    (axes,) = figure.axes
    assert "mean ± standard deviation of 4 runs" in legend(axes)
    assert axes.get_xscale() == "log" and "kPa" in axes.get_xlabel()
    assert {"p_m", "delta", "final_pressure"} <= set(tables.table_numbers(data))


def test_figure_over_time_shows_stress_or_coordination():
    time = np.arange(20) * 1e-7
    stress = np.zeros((20, 3, 3))
    stress[:, 2, 2], stress[:, 0, 0] = 5e3, -1e3
    base = {"time": time, "coordination_number": np.full(20, 3.0), "contact_count": np.full(20, 15)}
    runs = [run_of(20, **base, stress=factor * stress) for factor in (1.0, 2.0)]
    (axes,) = plots.ensemble(analysis.gather(runs)).axes
    assert axes.get_ylabel() == "stress along z, positive in tension (kPa)"
    assert axes.get_xlabel() == "time (µs)"
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 7.5)
    (axes,) = plots.ensemble(analysis.gather([run_of(20, **base)])).axes
    assert axes.get_ylabel() == "coordination number"
    axes = {"sample.grains": xr.Variable("sample.grains", np.arange(30))}
    runs = [run_of(5, coordination_number=np.full(5, float(n))) for n in range(30)]
    (drawn,) = plots.ensemble(analysis.gather(runs, axes)).axes
    assert len(drawn.lines) == 12
    assert (
        drawn.get_legend() or drawn.figure.legends[0]
    ).get_title().get_text() == "12 of 30 points"
