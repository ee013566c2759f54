"""Periodic cells, stages and plates: pressure, losses, structure, on known results."""

import numpy as np
import pytest
import synthetic
import xarray as xr
from figures import legend, line
from scenes import import_bundled
from test_tensile import ICE, T19, stretch

from dusttaichi import analysis, plots
from dusttaichi.analysis.isotropic import find_law_numbers
from dusttaichi.errors import DustError
from dusttaichi.physics import laws
from dusttaichi.scene.material import NAMED, Material


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Pressed from 0.01 to 0.1, then stretched to 0.03."""
    with analysis.open_run(
        synthetic.cell_run(tmp_path_factory.mktemp("cell") / "result.nc")
    ) as run:
        yield run


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    with analysis.open_run(
        synthetic.plates_run(tmp_path_factory.mktemp("plates") / "result.nc")
    ) as run:
        yield run


# Stages.


def test_stages_and_their_snapshots(cell):
    assert cell.stages == ("press", "stretch")
    press, pull = cell.stage("press"), cell.stage(1)
    assert press.series.sizes["time"] + pull.series.sizes["time"] == cell.series.sizes["time"]
    # what was reached at the end of a stage is where the next one starts
    assert float(pull.start.filling_factor) == float(press.series.filling_factor[-1]) == 0.1
    assert float(press.start.time) == 0 and pull.whole is cell and pull.name == cell.name
    assert [p.stages for p in cell.parts] == [cell.stages] * 2 and press.parts == [press]
    assert pull.stage("press").series.identical(press.series)
    assert cell.shrinks and cell.stretches and not cell.compresses
    assert press.shrinks and not press.stretches and pull.stretches and not pull.shrinks
    # those at its start and its end are among them
    pull = cell.stage("stretch")
    steps = pull.snapshots.step.values
    assert cell.snapshots.sizes["snapshot"] == 5 and len(steps) == 4
    assert steps[0] == int(pull.start.step) and steps[-1] == int(pull.series.step[-1])
    np.testing.assert_allclose(
        pull.period(0), pull.start.box_length, rtol=1e-12
    )  # the difference of two coordinates
    assert pull.period()[0] > 3 * pull.period()[1]


def test_stages_that_there_are_not(cell, plates, tmp_path):
    with pytest.raises(DustError, match="its stages are press, stretch"):
        cell.stage("pull")
    with pytest.raises(DustError, match="no stage 2"):
        cell.stage(2)
    with pytest.raises(DustError, match="it has no stages"):
        plates.stage(0)
    assert plates.stages == () and plates.parts == [plates]
    early = cell.series.isel(time=slice(0, 100))
    early_run = analysis.Run("run", early)
    assert len(early_run.parts) == 1 and not early_run.stretches
    with pytest.raises(DustError, match="stretch has not begun"):
        early_run.stage("stretch")


def test_contacts_of_a_stage(tmp_path):
    features = (synthetic.BOX | {"stages"}) - {"profiles"}
    with synthetic.writer(tmp_path / "result.nc", 9, 1, features, attrs={"stages": "a b"}) as out:
        for step in range(6):
            record = synthetic.series_record(step, features) | {"stage": step // 3}
            out.append("series", record)
            for group, rows in synthetic.snapshot_records(step, 9, step + 1).items():
                out.append(group, rows)
    with analysis.open_run(tmp_path) as run:
        second = run.stage("b")
        assert second.snapshots.step.values.tolist() == [2, 3, 4, 5]
        for number, step in enumerate((2, 3, 4, 5)):
            contacts = second.contacts(number)
            assert contacts.sizes["contact"] == step + 1 and np.all(contacts.grain_j == step)


def test_strength_of_a_stage(cell):
    t = analysis.measure_tensile_strength(cell)
    assert t.axis == "x" and t.phi_init == 0.1 and t.passed
    assert t.law == pytest.approx(T19)
    assert abs(t.strength - T19) < 4 * t.strength_sigma + 0.004 * T19
    assert analysis.measure_tensile_strength(cell.stage(1)).strength == t.strength
    # across the direction of stretching there is noise alone
    assert analysis.measure_tensile_strength(cell, axis="z").strength < 0.1 * T19
    with pytest.raises(DustError, match="no tensile strength"):
        analysis.measure_tensile_strength(cell.stage("press"))


# Pressed from all sides.


def test_isotropic(cell):
    t = analysis.measure_isotropic_compression(cell)
    assert len(t.raw_pressure) == 400 and 18 <= len(t.pressure) <= 21  # a decade, 20 bins in it
    # half a step of 1/400 decade between record and mean; 20 records of 0.05 dex in a bin, and
    # the median scatters 1.25 times as much as the mean: 0.014 dex
    np.testing.assert_allclose(np.log10(t.ratio), np.log10(1.3), atol=4 * 0.014 + 0.004)
    ratio = t.ratio_between()
    assert ratio.value == pytest.approx(1.3, rel=0.03) and ratio.scatter < 0.03
    assert ratio.low < 0.011 and 0.09 < ratio.high <= 0.1
    ratio_between = t.ratio_between(0.02, 0.05)
    assert ratio_between.low >= 0.02 and ratio_between.high <= 0.05
    assert np.isnan(t.ratio_between(0.5, 0.6).value)
    np.testing.assert_allclose(
        t.law,
        laws.isotropic_pressure(
            t.filling_factor, ICE.surface_energy, ICE.radius, ICE.critical_rolling
        ),
    )
    with pytest.raises(DustError, match="no mean pressure"):
        analysis.measure_isotropic_compression(analysis.Run("run", cell.series.drop_vars("stress")))


def test_the_law_of_pressure_has_the_stiffness_of_rolling():
    """E_roll is the work of the rolling springs of the run, and none where grains roll freely."""
    scene = "material: ice_t19\ninteraction: {{rolling: {}}}\n"
    runs = [
        synthetic.make_run(scene=scene.format(word), filling_factor=np.ones(2))
        for word in ("{modifier: 8.0}", "off")
    ]
    assert find_law_numbers(runs[0]) == (
        ICE.surface_energy, ICE.radius, 8.0 * ICE.critical_rolling
    )  # fmt: skip
    assert find_law_numbers(runs[1]) is None


def test_one_way_compression_is_not_from_all_sides(cell):
    press = cell.stage("press").series
    box = press.box_length.values.copy()
    box[:, 1:] = box[0, 1:]
    series = press.drop_vars("stage").assign(box_length=(("time", "xyz"), box))
    assert not analysis.Run("run", series).shrinks


# Between plates.


def test_unidirectional_law(plates):
    assert analysis.choose_compression_law(plates) is laws.UNIDIRECTIONAL
    numbers = analysis.summarise(plates)
    assert numbers["law_p_m"] == laws.UNIDIRECTIONAL.p_m and numbers["rms"] < 0.01
    assert abs(numbers["p_m"] - 5.6e3) < 4 * numbers["p_m_sigma"]
    assert abs(numbers["delta"] - 0.33) < 4 * numbers["delta_sigma"]
    rows = {row[0]: row for row in analysis.tabulate(numbers)}
    assert rows["p_m"][2] == "5.6 kPa" and "onset of compression" in rows
    assert any(title.endswith("from G09") for title in rows)
    inner = analysis.measure_compression_curve(plates, quantity="inner_filling_factor")
    outer = analysis.measure_compression_curve(plates)
    np.testing.assert_allclose(inner.raw_filling_factor, 1.05 * outer.raw_filling_factor)


def test_onset():
    """Where the law has risen by a tenth; bins 0.002 wide, interpolated in lg P."""
    phi = np.linspace(0.16, 0.32, 4000)
    run = synthetic.make_run(filling_factor=phi, pressure=laws.UNIDIRECTIONAL.pressure(phi))
    curve = analysis.measure_compression_curve(run, bin_width=0.002)
    expected = float(laws.UNIDIRECTIONAL.pressure(1.1 * 0.16))
    assert analysis.find_onset(curve) == pytest.approx(expected, rel=2e-3)
    assert analysis.find_onset(curve, rise=0.2) > analysis.find_onset(curve)
    assert np.isnan(analysis.find_onset(curve, rise=2.0))


# Losses and structure.


def test_losses_and_the_ledger_that_counts_the_faces(cell):
    t = analysis.measure_losses(cell)
    whole_ledger = analysis.compute_ledger(cell)
    end = sum(whole_ledger.losses.values())
    np.testing.assert_allclose(t.total[-1], end[-1] - end[399], rtol=1e-12)
    np.testing.assert_allclose(t.by_channel["rolling"], synthetic.SHARES[3] * t.total, rtol=1e-9)
    assert t.filling_factor[-1] == pytest.approx(0.03) and np.all(np.diff(t.total) >= 0)
    pressed = analysis.measure_losses(cell.stage("press"))
    assert pressed.total[0] == 0 and pressed.total[-1] == pytest.approx(end[399])
    with pytest.raises(DustError, match="no filling factor"):
        analysis.measure_losses(analysis.Run("run", cell.series.drop_vars("filling_factor")))
    books = analysis.compute_ledger(cell)
    np.testing.assert_allclose(books.work, cell.series.face_work)
    assert analysis.compute_ledger(cell.stage("stretch")).worst == books.worst


def test_fractal(cell, plates):
    """Grains at random: N = (4/3) pi r^3 n, also beyond half the cell, and the slope is 3."""
    edge = cell.stage("stretch").period(0)[0]
    radii = np.array([0.4, 0.5, 0.6, 0.8, 1.1]) * edge
    t = analysis.measure_fractal(cell, snapshots=[0], radii=radii)
    expected = 4 / 3 * np.pi * (radii / edge) ** 3 * 300
    # from 80 grains on; the positions are uncorrelated, so pairs scatter as sqrt(300 N / 2)
    np.testing.assert_allclose(t.number[0], expected, rtol=0.05)
    np.testing.assert_allclose(t.slope[0], 3.0, atol=0.15)
    assert t.filling_factor[0] == pytest.approx(0.1) and t.grain_radius == ICE.radius
    assert np.isnan(t.dimension[0])  # more than twenty grains everywhere
    default = analysis.measure_fractal(cell)
    assert default.number.shape == (4, 30) and np.all(np.diff(default.filling_factor) < 0)
    with pytest.raises(DustError, match="no snapshots"):
        analysis.measure_fractal(stretch())


def test_fractal_dimension_of_a_rod_and_a_plane():
    """A row of grains has D = 1, a sheet D = 2, counted where N <= 20."""
    line = np.arange(-40, 41) * 2.0
    sheet = np.stack(np.meshgrid(line, line, [0.0]), axis=-1).reshape(-1, 3)
    rod = np.stack([line, 0 * line, 0 * line], axis=1)
    for positions, dimension in ((rod, 1.0), (sheet, 2.0)):
        frames = xr.Dataset(
            {
                "position": (("snapshot", "grain", "xyz"), positions[None]),
                "radius": ("grain", np.ones(len(positions))),
                "snapshot_time": ("snapshot", [0.0]),
                "step": ("snapshot", [0]),
            }
        )
        series = xr.Dataset({"step": ("time", [0])}, {"time": [0.0]})
        tree = xr.DataTree.from_dict({"snapshots": frames})
        run = analysis.Run("run", series)
        run._tree = tree
        t = analysis.measure_fractal(run, radii=np.geomspace(2.1, 60, 60))
        # N steps up as a circle grows over a lattice, and edges of the sheet are near
        assert t.dimension[0] == pytest.approx(dimension, abs=0.25)
        assert np.isnan(t.filling_factor[0])


# Summary and comparison.


def test_summary_of_a_cell(cell):
    numbers = analysis.summarise(cell)
    assert numbers["p_m"] is None and numbers["pressure"] is None and numbers["onset"] is None
    assert numbers["strength_law"] == pytest.approx(T19) and numbers["strength_passed"]
    assert numbers["ratio"] == pytest.approx(1.3, rel=0.03)
    rows = {row[0]: row for row in analysis.tabulate(numbers)}
    assert "kPa" in rows["tensile strength"][1] and "T19 eq 33" in rows["tensile strength"][2]
    assert rows["… at filling factor"][2] == "0.05 (T19: half)"
    assert rows["pressure over (E_roll/r^3) phi^3"][2] == "1 (T19 eq 9)"
    pressed = analysis.summarise(cell.stage("press"))
    assert pressed["strength"] is None and pressed["ratio"] == numbers["ratio"]
    lower = analysis.tabulate(numbers | {"strength_passed": False})
    assert "at least" in dict(row[:2] for row in lower)["tensile strength"]


def test_compare(cell, plates, tmp_path):
    first, two = analysis.compare([cell, plates])
    assert list(first) == list(two)
    assert first["strength_law"] == pytest.approx(T19) and two["strength"] is None
    assert first["p_m"] is None and two["rms"] < 0.01 and first["pressure_kpa_at_0.2"] is None
    assert first["drive"] == (
        "press: compression_rate 3e-7; stretch: face_speed 10 cm/s, 0 m/s, 0 m/s"
    )
    assert two["drive"] == "wall_speed 5 cm/s"
    (alone,) = analysis.compare([cell])
    assert "p_m" not in alone and alone["phi_init"] == 0.1 and alone["ratio_scatter"] < 0.03
    assert "strength" not in analysis.compare([plates])[0]
    analysis.to_csv([first, two], tmp_path / "runs.csv")
    text = (tmp_path / "runs.csv").read_text().splitlines()
    assert len(text) == 3 and text[0].startswith("name,damping,m_r")


# Dense packing: the law of Tatsuuma et al. 2023, its numbers and figure.


@pytest.fixture(scope="module")
def extension():
    with import_bundled("tatsuuma2023/compressive_strength.py") as module:
        yield module


def test_law(extension):
    silicate = Material(**NAMED["silicate_s12"])
    ice, silicate = ((m.surface_energy, m.radius, m.critical_rolling) for m in (ICE, silicate))
    thin = np.array([1e-5, 1e-4])
    # 1/0.74 beside 1/phi: 3 phi/0.74
    expected = laws.isotropic_pressure(thin, *ice)
    np.testing.assert_allclose(extension.compressive_strength(thin, *ice), expected, rtol=5e-4)
    assert np.all(np.isinf(extension.compressive_strength([0.74, 0.8], *ice)))
    dense = laws.rolling_energy(*silicate) / silicate[1] ** 3 * (1 / 0.5 - 1 / 0.74) ** -3
    assert extension.compressive_strength(0.5, *silicate) == pytest.approx(dense)


def test_ratio_and_figure_with_both_laws(extension, cell):
    """The law of 2023 is phi^3 over (1 - phi/0.74)^3; the pressure is 1.3 of phi^3."""
    thin = extension.dense_ratio(cell, 0.02, 0.05)
    assert thin.value == pytest.approx(1.3 * (1 - 0.033 / 0.74) ** 3, rel=0.05)
    assert np.isnan(extension.dense_ratio(cell).value)  # pressed to 0.1 only
    assert analysis.summarise(cell)["dense_ratio"] is None
    (axes,) = plots.draw_figures(cell)["isotropic"].axes
    labels = legend(axes)
    assert sum("E_" in text for text in labels) == 2
    assert any("Tatsuuma" in text for text in labels)


def test_numbers_of_a_dense_cell(extension, tmp_path):
    path = synthetic.cell_run(tmp_path / "result.nc", phi_init=0.3)
    with analysis.open_run(path) as run:
        numbers, ratio = analysis.summarise(run), extension.dense_ratio(run)
        assert numbers["dense_ratio"] == ratio.value
        assert numbers["dense_ratio_low"] == ratio.low >= extension.DENSE
        assert numbers["dense_ratio_scatter"] == ratio.scatter
        rows = {row[0]: row for row in analysis.tabulate(numbers)}
        assert rows["… over (E_roll/r^3)(1/phi - 1/0.74)^-3"][2] == "1 (Tatsuuma et al. 2023)"


def test_shares_of_the_channels(extension, cell):
    """Of synthetic losses every channel has the same share at all filling factors."""
    result = extension.loss_shares(cell)
    np.testing.assert_allclose(sum(result.by_channel.values()), 1.0)
    assert len(result.filling_factor) >= 8 and np.all(np.diff(result.filling_factor) > 0)
    for name, fraction in result.by_channel.items():
        expected = synthetic.SHARES[list(cell.series.channel.values).index(name)]
        np.testing.assert_allclose(fraction, expected / synthetic.SHARES.sum(), rtol=1e-9)
    (axes,) = plots.draw_figures(cell)["loss_shares"].axes
    np.testing.assert_allclose(line(axes, "rolling").get_ydata(), result.by_channel["rolling"])
    with pytest.raises(DustError, match="not compressed enough"):
        extension.loss_shares(cell, decades=3.0)
