"""The benchmark: its table has what was asked for, its samples are what they should be.

Nothing is said about how fast anything is: the machine that runs the tests may be busy.
"""

import math

import numpy as np
import pandas as pd
import pytest
from scenes import KERNELS

from benchmarks import sample, speed
from benchmarks.table import Table
from dusttaichi import samples
from dusttaichi.compute import compiler
from dusttaichi.errors import DustError
from dusttaichi.studies import bench

GRAINS = 60
RADIUS = 0.6e-6


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
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
def test_every_configuration_is_measured(measured):
    row, notes = measured
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


@pytest.mark.long
def test_start_and_memory(measured):
    start, _ = measured
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


def test_columns_of_lammps_only_with_lammps(capsys):
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
    monkeypatch.setattr(samples, "filling_factor", lambda found, radius: 0.14)
    ours = {(0.15, 1): rounds(2e-6), (0.15, 2): rounds(1e-6)}
    theirs = [(7e-6 * p, 20) for p in pace]
    recipe = sample.Recipe(10, 0.15)
    row = speed._row(recipe, (0.15, 2), ours, theirs)
    assert row["filling_factor"] == 0.14 and row["contacts"] == 2
    assert row["ns_per_contact"] == pytest.approx(1.1e3 / 20)
    assert row["lammps_ns_per_contact"] == pytest.approx(7.7e3 / 20)
    assert row["speed_up"] == pytest.approx(2) and row["lammps_ratio"] == pytest.approx(7)
    assert row["ledger"] == pytest.approx(6) and row["search"] == pytest.approx(4)
    assert row["spread"] == pytest.approx(100 * 2 / 1.1)
    assert "lammps_ratio" not in speed._row(recipe, (0.15, 2), ours, [])


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
    monkeypatch.setattr(sample, "_positions", None)
    again = sample.make(recipe)
    np.testing.assert_array_equal(again.positions, first.positions)
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
    whole = sample.tile(base, 162, np.ptp(base[:, :2], axis=0) + 2.0)
    assert np.sort(whole[:, 0])[149] == tiled[:, 0].max()  # cut along x


def test_a_file_that_cannot_be_written_is_refused_before_the_measurements(tmp_path):
    with pytest.raises(DustError, match="cannot be written"):
        speed.main([100], out=tmp_path / "none" / "bench.csv")
