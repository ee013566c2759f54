"""`dust extremes`: its cheap corners, its verdicts, and what becomes of a crash or a hang."""

import csv
import json
from dataclasses import asdict, replace

import numpy as np
import pytest
import xarray as xr
from program import dust
from scenes import ROOT

from dusttaichi.errors import DustError, GuardStop
from dusttaichi.method import Measurement, Start
from dusttaichi.running import ledger
from dusttaichi.studies import extremes_map as study
from dusttaichi.studies import jobs
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies.extremes_cells import BOTTOM, Cell, compose_scene
from dusttaichi.studies.extremes_map import GROUPS
from dusttaichi.studies.extremes_trial import attempt
from dusttaichi.studies.verdicts import VERDICTS, judge, name_infinite


def cells_of(group, *words):
    return [c for c in GROUPS[group](False) if any(w in c.name for w in words)]


def try_cells(cells):
    return {cell.name: attempt(cell) for cell in cells}


@pytest.fixture(scope="module")
def pairs():
    """Cells of two grains in the open that share their kernels."""
    return try_cells(
        [
            *cells_of(
                "special states",
                "touching exactly",
                "at pull-off, two",
                "spin 1e9, pair",
                "two grains",
                "coinciding",
                "one grain, auto",
            ),
            *cells_of("wall speeds", "pair, viscous"),
            *[replace(c, steps=2000) for c in cells_of("time step", "pair, damping none")],
        ]
    )


def test_no_cell_of_two_grains_is_wrong_and_refusals_have_a_reason(pairs):
    assert {o.verdict for o in pairs.values()} == {"stable", "refused", "stopped"}
    for name, outcome in pairs.items():
        assert outcome.verdict == "stable" or outcome.reason, name
    assert "no period" in pairs["one grain, auto"].reason
    assert "apart" in pairs["nearly coinciding"].reason
    corners = try_cells(cells_of("one number", "nu 0, viscoelastic", "pair, E 1e6"))
    assert "nu^2" in corners["nu 0, viscoelastic"].reason
    assert "JKR" in corners["pair, E 1e6 Pa"].reason
    assert {o.verdict for o in corners.values()} == {"refused"}


def test_auto_closes_the_ledger_at_all_speeds_and_spins(pairs):
    """100 m/s and 1e9 rad/s: within the tolerance of the guards, 1 %."""
    selected = {n: o for n, o in pairs.items() if "m/s" in n or "spin" in n or "touching" in n}
    assert len(selected) == 20
    for name, outcome in selected.items():
        assert outcome.verdict == "stable" and outcome.residual < 0.01, (name, outcome)
    # 1/pi = 0.318 of the period is the limit
    for fraction in (0.01, 0.2, 0.3, 0.31):
        assert pairs[f"pair, damping none, {fraction:g}"].verdict == "stable"
    for fraction in (0.36, 0.5, 1.2):
        outcome = pairs[f"pair, damping none, {fraction:g}"]
        assert outcome.verdict == "stopped" and outcome.steps == ledger.FIRST[0]
        assert outcome.residual < 0.01  # of what a look before has seen
    assert pairs["pair, damping none, 0.01"].ratio == pytest.approx(1.0, abs=0.02)


@pytest.fixture(scope="module")
def corners():
    """Every ninth corner of the materials, a cluster on a wall."""
    cells = [c for c in GROUPS["materials"](False) if c.name.startswith("wall")]
    return try_cells([replace(c, steps=200) for c in cells[::9]])


@pytest.mark.long  # test_stability has the limit of a pair, unlike grains, a wall
def test_estimate_predicts_the_limit_at_the_corners_of_materials(corners):
    """Asked: 20 %; the bisection is to 0.5 %, and overlaps at rest differ from those of the
    cluster, whose grains stand at the distance of a pair on a wall."""
    stable = [o for o in corners.values() if o.verdict == "stable"]
    assert len(stable) >= 3
    assert {o.verdict for o in corners.values()} <= {"stable", "refused"}
    for outcome in stable:
        assert outcome.ratio == pytest.approx(1.0, abs=0.03)


def test_grains_that_have_left_a_wall():
    """A grain bounces off for good: no block of wall contacts is left."""
    fast = Cell(
        "wall speeds",
        "gone",
        compose_scene(boundary=BOTTOM),
        {"kind": "given", "positions": [[0, 0, 0]], "velocities": [[1, 0, -10]]},
        3000,
    )
    assert attempt(fast).verdict == "stable"


def test_the_published_map_has_the_cells_of_the_program():
    """docs/redraw.py looks for the row and column of each cell by its name."""
    with open(ROOT / "docs/validation/extremes.csv", newline="", encoding="utf-8") as file:
        published = [(row["group"], row["name"]) for row in csv.DictReader(file)]
    cells = [(c.group, c.name) for make in GROUPS.values() for c in make(False)]
    assert sorted(published) == sorted(cells)
    for make in GROUPS.values():
        for quick in (True, False):
            cells = make(quick)
            assert cells and len({c.name for c in cells}) == len(cells)
            for cell in cells:
                assert Cell(**json.loads(json.dumps(asdict(cell)))) == cell


def test_checks_are_fixed_by_the_scene():
    steps, seen = 0, []
    while steps < 12_000:
        steps = ledger.next_check(steps, 0, 5000)
        seen.append(steps)
    assert seen == [10, 30, 100, 300, 1000, 3000, 6000, 9000, 12000]
    assert ledger.next_check(107, 100, 5000) == 110
    assert ledger.next_check(5000, 0, 2) == 500_000


def test_losses_that_make_energy_are_stopped():
    """However well the ledger closes."""

    def measured(kinetic, losses=(0.0,) * 6):
        losses = np.array(losses)
        return Measurement(kinetic, 0.0, kinetic, losses, losses.sum())

    class Sim:
        time, step = 1.0, 2
        channels = ("forming", "breaking", "damping", "rolling", "sliding", "twisting")
        step_key = "numerics.time_step"

        @staticmethod
        def units(unit):
            return 1e-6

        @staticmethod
        def validate(measurement):
            pass

    start = Start.from_measurement(measured(1.0))
    ledger.check(Sim, measured(1.0), start)
    with pytest.raises(GuardStop, match="damping are negative"):
        ledger.check(Sim, measured(1.5, (0, 0, -0.5, 0, 0, 0)), start)
    with pytest.raises(GuardStop, match="ledger is open by 50"):
        ledger.check(Sim, measured(1.5), start)


TASK = """
import os, pathlib, sys, time

def attempt(parent, *, cell):
    name = cell["name"]
    with open(pathlib.Path(__file__).with_name("tried"), "a") as file:
        file.write(name + chr(10))
    if name == "crash":
        sys.stderr.write("Segmentation fault")
        sys.stderr.flush()
        os._exit(139)
    if name == "hang":
        time.sleep(60)
    verdict = ["stable", "refused", "stopped", "WRONG"][cell["column"]]
    nan = float("nan")
    answer = {"verdict": verdict, "reason": "because", "residual": 1e-3, "dt": nan}
    return answer | {"estimated": 1.1, "measured": 1.0}
"""


@pytest.fixture
def faulty(monkeypatch, tmp_path):
    """A task that names the verdict of a cell by its column, crashes or hangs; and what it did."""
    (tmp_path / "faulty.py").write_text(TASK)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(study, "TASK", "faulty:attempt")
    return lambda: (tmp_path / "tried").read_text().split()


def test_a_crash_and_a_hang_are_verdicts(faulty, monkeypatch, tmp_path):
    monkeypatch.setattr(jobs, "START_ALLOWANCE", 20.0)
    names = ("one", "crash", "two", "hang", "three")
    cells = [Cell("g", name, {}, time_limit=0.5, column=0) for name in names]
    monkeypatch.setattr(study, "GROUPS", {"g": lambda quick: cells})
    full_map = study.ExtremesMap(tmp_path / "map")
    data = full_map.dataset(engine.run(full_map, resume=True))
    assert data.verdict.values.tolist() == ["stable", "WRONG", "stable", "WRONG", "stable"]
    reasons = dict(zip(names, data.reason.values, strict=True))
    assert "ended (status 139): Segmentation fault" in reasons["crash"]
    assert "no answer in 0.5 s" in reasons["hang"]


def test_command_keeps_finished_cells_and_tells_what_is_wrong(
    faulty, tmp_path, monkeypatch, capsys
):
    cells = [Cell("g", f"cell-{n}", {}, row="r", column=n) for n in range(4)]
    command = ["extremes", "-q", "-o", tmp_path / "map", "--jobs", 1]
    # what an interruption leaves
    monkeypatch.setattr(study, "GROUPS", {"g": lambda quick: cells[:2]})
    dust(*command)
    monkeypatch.setattr(study, "GROUPS", {"g": lambda quick: cells})
    with pytest.raises(SystemExit) as end:
        dust(*command)
    assert end.value.code == 1  # the last is WRONG
    assert faulty() == [cell.name for cell in cells]
    output = capsys.readouterr()
    assert "2 of 4 are already finished" in output.err
    assert "WRONG  g: cell-3: because" in output.out
    with xr.open_dataset(tmp_path / "map" / "extremes.nc") as data:
        assert data.verdict.values.tolist() == list(VERDICTS)
        (*_, last) = study.summarise(data.load())
        counts = ["1"] * 4
        assert last == ["all", "4", *counts, "1.0e-03", "4", "1.100 to 1.100"]
    with pytest.raises(SystemExit):
        dust(*command, "--json")
    output = xr.Dataset.from_dict(json.loads(capsys.readouterr().out))
    assert (
        output.verdict.values.tolist() == list(VERDICTS) and output.dt.values.tolist() == [None] * 4
    )
    assert faulty() == [cell.name for cell in cells]  # none again
    assert (tmp_path / "map" / "extremes.csv").read_text().count("because") == 4
    assert (tmp_path / "map" / "extremes.png").stat().st_size > 1e4
    with pytest.raises(DustError, match="unknown group; allowed: g"):
        study.ExtremesMap(tmp_path / "map", only=["h"])


def test_threads_are_those_of_each_cell(tmp_path):
    """Keys of the cells stay those of one thread by default."""
    first, two = (study.ExtremesMap(tmp_path, quick=True, threads=n).points({}) for n in (1, 2))
    assert {point.cores for point in two} == {2} and {point.cores for point in first} == {1}
    assert all(point.arguments["cell"]["scene"]["numerics"]["threads"] == 2 for point in two)
    assert not {point.label for point in first} & {point.label for point in two}
    default = study.ExtremesMap(tmp_path, quick=True).points({})
    assert [point.label for point in default] == [point.label for point in first]


def test_the_judge_of_the_map_and_of_the_tortures():
    def stop():
        raise GuardStop("too fast")

    def refuse():
        raise DustError("no grains")

    def fail():
        return {}["speed"]

    infinite = name_infinite({"x": [0.0, 1.0], "v": [np.nan, 0.0], "w": np.inf})
    assert infinite == "not a number in v, w" and name_infinite({"x": np.zeros(3)}) == ""
    cases = (stop, "stopped"), (refuse, "refused"), (fail, "WRONG"), (lambda: infinite, "WRONG")
    verdicts = [(judge(compute), name) for compute, name in (*cases, (lambda: "", "stable"))]
    assert all(verdict.name == name for verdict, name in verdicts)
    (stopped, _), (refused, _), (failed, _), (wrong, _), _ = verdicts
    assert (stopped.reason, refused.reason, wrong.reason) == ("too fast", "no grains", infinite)
    assert failed.reason.startswith("KeyError: 'speed' (test_extremes.py:")
    assert "Traceback" in failed.details
