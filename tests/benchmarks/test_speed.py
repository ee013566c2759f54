"""The benchmarks: their tables have what was asked for, their samples are what they should be.

Nothing is said about how fast anything is: the machine that runs the tests may be busy.
"""

import math

import numpy as np
import pandas as pd
import pytest
from scenes import CONFIGS, KERNELS

from benchmarks import continuum, sample, speed
from benchmarks.table import Table
from dusttaichi import samples
from dusttaichi.compute import compiler, processor
from dusttaichi.errors import DustError
from dusttaichi.studies import machine_speed as bench
from dusttaichi.studies.workers import Answer

GRAINS = 60
RADIUS = 0.6e-6


@pytest.fixture(scope="module")
def measured_rows(tmp_path_factory):
    """(row, notes) of a benchmark of sixty grains, one thread."""
    folder = tmp_path_factory.mktemp("bench")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setenv(compiler.variable(compiler.KERNEL_FOLDER), KERNELS)
        # nothing is compiled
        patch.setattr(speed, "Timed", lambda task, kernels: bench.Timed(task, KERNELS))
        patch.setattr(speed, "PRECISION", "f64")
        sample.make(sample.Recipe(GRAINS, 0.35))  # here, where its kernels are compiled already
        file = folder / "bench.csv"
        result = speed.main([GRAINS], [0.35], [1], steps=200, rounds=2, out=file)
    ((_, written),) = pd.read_csv(file, comment="#").iterrows()
    (row,) = result.rows
    assert written["ns_per_contact [ns]"] == pytest.approx(row["ns_per_contact"], rel=1e-5)
    return row, result.notes


@pytest.mark.long
def test_every_configuration_is_measured(measured_rows):
    row, notes = measured_rows
    assert (row["grains"], row["precision"], row["threads"]) == (GRAINS, "f64", 1)
    # it gives way while it settles
    assert row["filling_factor"] == pytest.approx(0.35, abs=0.03)
    names = ("contacts", "ns_per_contact", "search", "ledger", "spread")
    assert min(row[name] for name in names) > 0
    # per contact and per grain-step are the same time
    assert row["ns_per_grain_step"] == pytest.approx(row["ns_per_contact"] * row["contacts"])
    assert row["speed_up"] == 1
    if any("Without a comparison" in note for note in notes):
        assert "lammps_ratio" not in row
    else:
        assert row["lammps_ns_per_contact"] > 0 and row["lammps_ratio"] > 0
    start, _ = measured_rows
    assert start["cold"] > 0 and start["warm"] > 0
    assert start["peak"] > 50  # Python with NumPy and Taichi is 87 MB before it does anything
    assert start["fields_per_grain"] > 300  # positions, velocities, spins, six pairs, in f64
    assert math.isnan(start["peak_per_grain"])  # nothing smaller to compare with


ROW = {
    "grains": 1000,
    "filling_factor": 0.148,
    "precision": "f64",
    "threads": 2,
    "contacts": 0.75,
    "ns_per_contact": 41.26,
    "ns_per_grain_step": 30.9,
    "search": 1.0,
    "ledger": 2.0,
    "spread": 3.0,
    "speed_up": 1.5,
    "cold": 12.0,
    "warm": 3.0,
    "peak": 200.0,
    "peak_per_grain": math.nan,
    "fields_per_grain": 900.0,
}
BLOCKS = ("Speed", *speed.SPEED), ("Start and memory", *speed.START)
BESIDE = ROW | {"threads": 1, "lammps_ns_per_contact": 280.0, "lammps_ratio": 6.8}


def test_text(capsys):
    Table("a machine", [ROW, BESIDE], BLOCKS, ("a note",)).show()
    text = capsys.readouterr().out
    lines = text.splitlines()
    assert lines[0] == "a machine" and lines[-1] == "a note"
    for words in ("ns per", "contact", "grain-step", "per grain", "cold, s", "MB", "x ours"):
        assert words in text
    # too wide for one table: the last column is in a second one
    assert "1000 0.148 f64 2 0.75 41.3 30.9 1.0 2.0 3 1.50 -".split() in map(str.split, lines)
    assert "1000 0.148 f64 1 6.8".split() in map(str.split, lines)
    # once for both numbers of threads, without a growth, which is not known
    assert [line.split() for line in lines].count("1000 f64 12.0 3.0 200 900".split()) == 1
    Table("a machine", [ROW], BLOCKS).show()
    assert "LAMMPS" not in capsys.readouterr().out


def test_csv(tmp_path):
    Table("a machine", [ROW, BESIDE], BLOCKS, ("a note",)).to_csv(tmp_path / "speed.csv")
    assert (tmp_path / "speed.csv").read_text().startswith("# a machine\n# a note\n")
    rows = pd.read_csv(tmp_path / "speed.csv", comment="#", dtype=str, keep_default_na=False)
    assert list(rows.threads) == ["2", "1"]
    assert rows["ns_per_contact [ns]"][0] == "41.26"
    assert list(rows["lammps_ratio [x ours]"]) == ["", "6.8"]
    assert rows["cold [s]"][0] == "12" and rows["peak_per_grain [B]"][0] == ""


def test_ratios_are_those_of_a_round(monkeypatch):
    """A machine that is three times slower in one round changes no ratio."""
    pace = [1.0, 3.0, 1.1]

    def rounds(seconds):
        whole = {"seconds": seconds, "search": 0.04 * seconds, "ledger": 0.06 * seconds}
        return [{part: t * p for part, t in whole.items()} | {"contacts": 20} for p in pace]

    monkeypatch.setattr(sample, "load", lambda path: None)
    monkeypatch.setattr(samples, "filling_factor", lambda result, radius: 0.14)
    ours = {(0.15, 1): rounds(2e-6), (0.15, 2): rounds(1e-6)}
    theirs = [(7e-6 * p, 20) for p in pace]
    recipe = sample.Recipe(10, 0.15)
    row = speed._make_row(recipe, (0.15, 2), ours, theirs)
    assert row["filling_factor"] == 0.14 and row["contacts"] == 2
    assert row["ns_per_contact"] == pytest.approx(1.1e3 / 20)
    assert row["lammps_ns_per_contact"] == pytest.approx(7.7e3 / 20)
    assert row["speed_up"] == pytest.approx(2) and row["lammps_ratio"] == pytest.approx(7)
    assert row["ledger"] == pytest.approx(6) and row["search"] == pytest.approx(4)
    assert row["spread"] == pytest.approx(100 * 2 / 1.1)
    assert "lammps_ratio" not in speed._make_row(recipe, (0.15, 2), ours, [])


def test_cake_moves_and_is_kept(tmp_path, monkeypatch):
    """Up to 0.15 a sample is the deposit itself; the second time it comes from its file."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    recipe = sample.Recipe(200, 0.15)
    first = sample.make(recipe)
    assert recipe.path.parent == tmp_path / "dusttaichi"
    assert len(first) == 200
    rms = np.sqrt((first.velocities**2).sum(axis=1).mean())
    assert rms == pytest.approx(sample.THERMAL_SPEED, rel=0.15)  # 200 grains: 4 % expected
    np.testing.assert_allclose(first.velocities.mean(axis=0), 0, atol=1e-15)
    monkeypatch.setattr(sample, "_generate_positions", None)
    repeated_sample = sample.make(recipe)
    np.testing.assert_array_equal(repeated_sample.positions, first.positions)
    recipe.path.write_bytes(b"cut off")
    assert sample.load(recipe.path) is None


def test_samples_of_other_numbers_have_other_files(monkeypatch):
    paths = {sample.Recipe(*numbers).path for numbers in ((60, 0.15), (61, 0.15), (60, 0.35))}
    monkeypatch.setattr(sample, "SETTLE_STEPS", 1)
    assert len(paths | {sample.Recipe(60, 0.15).path}) == 4


def test_tiles_only_touch():
    rng = np.random.default_rng(1)
    grid = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), -1).reshape(-1, 3)
    base = grid * 2.2 + rng.uniform(-0.05, 0.05, (27, 3))  # grains of radius 1
    tiled = sample.tile(base, 150, np.ptp(base[:, :2], axis=0) + 2.0)
    assert len(tiled) == 150
    assert len(samples.touching_pairs(tiled, 2.0 * (1 - 1e-12))) == 0
    whole_tile = sample.tile(base, 162, np.ptp(base[:, :2], axis=0) + 2.0)
    assert np.sort(whole_tile[:, 0])[149] == tiled[:, 0].max()  # cut along x


def test_a_file_that_cannot_be_written_is_refused_before_the_measurements(tmp_path):
    with pytest.raises(DustError, match="cannot be written"):
        speed.main([100], out=tmp_path / "none" / "bench.csv")


@pytest.mark.long
def test_a_worker_times_the_scene_of_the_benchmark():
    scene = continuum.scene_of(2, 900, 1).to_yaml()
    built = continuum.answer(None, do="build", scene=scene)
    assert 900 <= built["particles"] < 1400  # with the bead
    # 18 or 24 of a triangular lattice are within 2.6 spacings, fewer at edges
    assert 14 < built["neighbours"] < 25
    assert built["search"] > 0.0
    answer = continuum.answer(None, do="timed", steps=10)
    assert answer["used"] > 0.0 and answer["real"] > 0.0


def test_the_table_tells_a_size_a_line(tmp_path, capsys):
    numbers = (2, 5836, 17.5, 0.65, 37.2, 5.2, 1.8, 3.0)
    names = [column.name for column in (*continuum.FRONT, *continuum.COLUMNS)]
    row = dict(zip(names, numbers, strict=True))
    blocks = [("Speed", continuum.FRONT, continuum.COLUMNS)]
    table = Table("a machine", [row], blocks, ("a note",))
    table.show()
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "5836" in line]
    assert line.split() == "2 5836 17.5 0.65 37.2 5.20 1.80 3".split()
    table.to_csv(tmp_path / "speed.csv")
    lines = (tmp_path / "speed.csv").read_text().splitlines()
    assert lines[:2] == ["# a machine", "# a note"] and lines[3].startswith("2,5836,17.5,0.65")


def test_scenes_of_three_dimensions_have_all_their_faces():
    scene = continuum.scene_of(3, 20_000, 2)
    assert scene.dimension == 3 and set(scene.boundary.layers) == {
        "bottom", "x_min", "x_max", "y_min", "y_max"
    }  # fmt: skip
    assert scene.numerics.threads == 2
    assert scene.numerics.spacing == pytest.approx(126e-6, rel=0.01)


class Here:
    """A Worker that answers in this process, where kernels have been compiled already."""

    def __init__(self, task, *, kernels):
        assert task == "dusttaichi.studies.machine_speed:answer" and kernels is None

    def call(self, request):
        return Answer(0, values=bench.answer(None, **request))

    def close(self):
        bench._state.clear()


def test_a_scene_is_timed(monkeypatch):
    monkeypatch.setattr(bench, "usable_cores", lambda: 1)
    monkeypatch.setattr(bench, "Worker", Here)
    (item,) = bench.main([CONFIGS / "smoke.yaml"], rounds=2, seconds=0.01)
    assert (item.size, item.threads, item.speed_up) == (60, 1, 1.0)
    assert 30 < item.contacts < 180 and item.seconds > 0.0 and item.spread >= 0.0
    assert 0.0 < abs(item.residual) < bench.LEDGER


def _timing(**changes):
    own = {"scene": "a", "size": 100, "contacts": 80, "threads": 1, "seconds": 4e-6}
    return bench.Timing(**{**own, "speed_up": 1.0, "spread": 1.0, "residual": 3e-5, **changes})


def test_text_of_dust_bench(monkeypatch):
    monkeypatch.setattr(bench, "machine", lambda: "a machine; vectors of 256 bits")
    monkeypatch.setattr(bench, "vector_bits", lambda: 512)
    rows = [
        _timing(),
        _timing(threads=2, seconds=2e-6, speed_up=2.0),
        _timing(scene="b", contacts=None),
    ]
    lines = bench.text(rows).splitlines()
    assert lines == [
        "a machine; vectors of 256 bits",
        "",
        "a: 100 particles, 80 contacts",
        "  largest relative error of the energy balance: 0.003 %",
        "  1 thread     250,000 steps/s     50.0 ns per contact and step",
        "  2 threads    500,000 steps/s     25.0 ns per contact and step   2.00 times one thread",
        "",
        "b: 100 particles",
        "  largest relative error of the energy balance: 0.003 %",
        "  1 thread     250,000 steps/s     40.0 ns per particle and step",
    ]
    assert "differ by up to 40 %" in bench.text([*rows, _timing(spread=40.0)])
    assert "energy balance: 2 %: RESULTS OF THIS MACHINE ARE WRONG" in bench.text(
        [*rows, _timing(residual=-0.02)]
    )


def test_a_process_that_fails_is_an_error():
    with bench.Timed("dusttaichi.studies.machine_speed:answer") as process:
        with pytest.raises(DustError, match="process of the benchmark ended.*no_such_command"):
            process.call("no_such_command")


@pytest.mark.parametrize("bits, extension", [(128, 512), (256, 512), (512, 512), (128, None)])
def test_narrow_vectors_are_remarked(bits, extension, monkeypatch):
    monkeypatch.setattr(bench, "machine", lambda: "a machine")
    monkeypatch.setattr(bench, "vector_bits", lambda: bits)
    monkeypatch.setattr(processor, "own_bits", lambda: extension)
    output = "vectors of 128 bits where this processor has 512" in bench.text([_timing()])
    assert output == (bits == 128 and extension is not None)
    assert not output or bench.text([_timing()]).endswith("chooses a newer one.")


def test_the_width_of_vectors_is_read_from_code():
    bits, own_bits = bench.vector_bits(), processor.own_bits()
    assert bits in (128, 256, 512) and (own_bits is None or bits <= own_bits)
    assert f"vectors of {bits} bits" in bench.machine()
