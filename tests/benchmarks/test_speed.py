"""The benchmark: its table has what was asked for, its samples are what they should be.

Nothing is said about how fast anything is: the machine that runs the tests may be busy.
"""

import csv
import io
import math
from pathlib import Path

import numpy as np
import pytest
from scenes import KERNELS

from benchmarks import lammps, sample, speed, timing
from benchmarks.table import Row, SpeedTable, Start
from dusttaichi import compiler, samples
from dusttaichi.errors import DustError

GRAINS = 60
RADIUS = 0.6e-6


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """A benchmark of sixty grains, one thread, with a precision that does not exist."""
    folder = tmp_path_factory.mktemp("bench")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setenv(compiler.variable(compiler.KERNEL_FOLDER), KERNELS)
        patch.setattr(timing.Plan, "kernels_of", lambda *_: Path(KERNELS))  # nothing is compiled
        sample.make(sample.Recipe(GRAINS, 0.35))  # here, where its kernels are compiled already
        result = speed.main(
            [GRAINS],
            [0.35],
            [1],
            steps=200,
            precisions=["f64", "f16"],
            rounds=2,
            out=folder / "bench.csv",
        )
        kept = samples.filling_factor(sample.load(sample.Recipe(GRAINS, 0.35).path), RADIUS)
    assert (folder / "bench.csv").read_text() == result.csv()
    assert kept == result.speed[0].filling_factor
    return result


@pytest.mark.long
def test_every_configuration_is_measured(table):
    (row,) = table.speed
    assert (row.grains, row.precision, row.threads) == (GRAINS, "f64", 1)
    assert row.filling_factor == pytest.approx(0.35, abs=0.03)  # it gives way while it settles
    assert min(row.contacts, row.ns_per_contact, row.search, row.ledger, row.spread) > 0
    # per contact and per grain-step are the same time
    assert row.ns_per_grain_step == pytest.approx(row.ns_per_contact * row.contacts)
    assert row.speed_up == 1
    if lammps.lammps_installed():
        assert row.lammps_ns_per_contact > 0 and row.lammps_ratio > 0
    else:
        assert any("LAMMPS is missing" in note for note in table.notes)


@pytest.mark.long
def test_start_and_memory(table):
    (start,) = table.start
    assert start.cold > 0 and start.warm > 0
    assert start.peak > 50  # Python with NumPy and Taichi is 87 MB before it does anything
    assert start.fields_per_grain > 300  # positions, velocities, spins, six pairs, in f64
    assert math.isnan(start.peak_per_grain)  # nothing smaller to compare with


@pytest.mark.long
def test_refused_precision_is_one_line(table):
    (note,) = [note for note in table.notes if note.startswith("f16: refused")]
    assert "precision" in note and "\n" not in note


def _row(**changes):
    row = dict(
        grains=1000,
        filling_factor=0.148,
        precision="f64",
        threads=2,
        contacts=0.75,
        ns_per_contact=41.26,
        ns_per_grain_step=30.9,
        search=1.0,
        ledger=2.0,
        spread=3.0,
        speed_up=1.5,
    )
    return Row(**{**row, **changes})


EXAMPLE = SpeedTable(
    speed=(_row(), _row(threads=1, lammps_ns_per_contact=280.0, lammps_ratio=6.8)),
    start=(Start(1000, "f64", 12.0, 3.0, 200.0, math.nan, 900.0),),
    machine="a machine",
    notes=("a note",),
)


def test_text():
    lines = EXAMPLE.text().splitlines()
    assert lines[0] == "a machine" and lines[-1] == "a note"
    for words in ("ns per", "contact", "grain-step", "per grain", "cold, s", "MB", "x ours"):
        assert words in EXAMPLE.text()
    (one,) = [line.split() for line in lines if " 41.3 " in line and "6.8" in line]
    assert one == "1000 0.148 f64 1 0.75 41.3 30.9 1.0 2.0 3 1.50 280 6.8".split()
    (other,) = [line.split() for line in lines if " 41.3 " in line and "6.8" not in line]
    assert other[-2:] == ["-", "-"]


def test_columns_of_lammps_only_with_lammps():
    without = SpeedTable("a machine", speed=(_row(),))
    assert "LAMMPS" not in without.text()
    assert "Start" not in without.text()


def test_csv():
    lines = EXAMPLE.csv().splitlines()
    assert lines[:2] == ["# a machine", "# a note"]
    rows = list(csv.DictReader(io.StringIO("\n".join(lines[2:]))))
    assert [row["threads"] for row in rows] == ["2", "1"]
    assert rows[0]["ns_per_contact [ns]"] == "41.26"
    assert rows[0]["lammps_ratio [x ours]"] == "" and rows[1]["lammps_ratio [x ours]"] == "6.8"
    assert rows[0]["cold [s]"] == "12.0" and rows[0]["peak_per_grain [B]"] == ""


def test_ratios_are_those_of_a_round():
    """A machine that is three times slower in one round changes no ratio."""
    one, two = (speed.Configuration(10, 0.15, "f64", threads) for threads in (1, 2))
    pace = [1.0, 3.0, 1.1]

    def rounds(seconds):
        parts = {"step": 0.9, "search": 0.04, "ledger": 0.06}
        return [
            {part: share * seconds * p for part, share in parts.items()} | {"contacts": 20}
            for p in pace
        ]

    ours = {one: rounds(2e-6), two: rounds(1e-6)}
    theirs = [lammps.LammpsTiming(350.0, 700.0, 20, 7e-6 * p, "") for p in pace]
    row = speed._row(two, {"filling_factor": 0.14}, ours, theirs)
    assert row.filling_factor == 0.14 and row.contacts == 2
    assert row.ns_per_contact == pytest.approx(1.1e3 / 20)
    assert row.speed_up == pytest.approx(2) and row.lammps_ratio == pytest.approx(7)
    assert row.ledger == pytest.approx(6) and row.search == pytest.approx(4)
    assert row.spread == pytest.approx(100 * 2 / 1.1)
    assert math.isnan(speed._row(two, {"filling_factor": 0.14}, ours, [None]).lammps_ratio)


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


def test_numbers_that_cannot_be(tmp_path):
    with pytest.raises(DustError, match="at least 8"):
        speed.main([4])
    with pytest.raises(DustError, match="filling factors"):
        speed.main([100], [0.9])
    with pytest.raises(DustError, match="at least 1"):
        speed.main([100], threads=[0])
    with pytest.raises(DustError, match="cannot be written"):
        speed.main([100], out=tmp_path / "none" / "bench.csv")
