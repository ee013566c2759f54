"""Studies from Python: the same runs, files and bits as those of the commands."""

import os
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from bits import assert_same_bits, tree
from program import dust, wait_for
from scenes import CONFIGS, ROOT, extensions_forgotten, write_spring
from scenes import SPRING_TEXT as TINY

import dusttaichi as dt
from dusttaichi.errors import Interrupted, with_keywords
from dusttaichi.scene import as_scene
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies.sweep_study import sweep
from dusttaichi.studies.user_study import UserStudy

# A method that compiles nothing, in a file of the user.


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with tiny.yaml and its method."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    write_spring(tmp_path)
    monkeypatch.chdir(tmp_path)
    with extensions_forgotten():
        yield tmp_path


def files_in(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_run_is_that_of_the_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dust("run", "smoke", "--set", "stop.steps=40", "-q", "-o", "command")
    run = dt.run("smoke", "python", **{"stop.steps": np.int64(40)})
    assert run.status == "finished: 40 steps" and run.path.parent.name == "python"
    assert_same_bits(tmp_path / "command/result.nc", tmp_path / "python/result.nc")
    assert files_in(tmp_path / "python") == files_in(tmp_path / "command")


def test_an_existing_result_is_kept_continued_or_overwritten(folder):
    run = dt.run("tiny.yaml", figures=False)
    assert run.path == Path("runs/tiny/result.nc")
    with pytest.raises(dt.DustError, match="exists already. Use force=True .*, resume=True to"):
        dt.run("tiny.yaml")
    tree_before = tree(run.path)
    assert dt.run("tiny.yaml", resume=True, figures=False).status == "finished: 10 steps"
    assert_same_bits(tree_before, run.path)
    longer = dt.run("tiny.yaml", resume=True, figures=False, stop={"steps": 20})
    assert longer.status == "finished: 20 steps"
    repeated = dt.run("tiny.yaml", force=True, figures=False)
    assert repeated.status == "finished: 10 steps" and repeated.snapshots.sizes["snapshot"] > 0
    with pytest.raises(dt.DustError, match="give only one of them"):
        dt.run("tiny.yaml", force=True, resume=True)


def test_a_sweep_is_that_of_the_command(folder):
    seeds = ["--set", "start=0.5,1.0,1.5", "--jobs", "2"]
    dust("sweep", "tiny.yaml", *seeds, "-q", "-o", "command")
    data = dt.sweep("tiny.yaml", {"start": np.array([0.5, 1.0, 1.5])}, "python", jobs=2)
    assert data.start.values.tolist() == [0.5, 1.0, 1.5]
    assert files_in(folder / "python") == files_in(folder / "command")
    for name in sorted(files_in(folder / "python")):
        if name.endswith("result.nc"):
            assert_same_bits(folder / "python" / name, folder / "command" / name)
    with xr.open_dataset(folder / "command/sweep.nc") as stored:
        assert set(stored.variables) == set(data.variables)
        np.testing.assert_array_equal(stored.place, data.place)


@pytest.mark.long  # kernels in two processes
def test_seeds_of_grains_give_the_runs_of_the_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--set", "sample.seed=1,2,3", "--set", "stop.steps=40", "--jobs", "2"]
    dust("sweep", "smoke", *options, "-q", "-o", "command", "--no-figures")
    keys = {"sample.seed": [1, 2, 3], "stop.steps": 40}
    data = dt.sweep("smoke", keys, "python", jobs=2, figures=False)
    assert data.sizes["sample_seed"] == 3
    assert files_in(tmp_path / "python") == files_in(tmp_path / "command")
    for run in (tmp_path / "python").glob("*/result.nc"):
        assert_same_bits(run, tmp_path / "command" / run.parent.name / "result.nc")


def test_replicas_are_a_sweep_without_values(folder, monkeypatch):
    studies = []

    def stop(study, **options):
        studies.append(study)
        raise dt.DustError("stopped")

    monkeypatch.setattr(engine, "run", stop)
    with pytest.raises(dt.DustError, match="stopped"):
        dt.sweep("smoke", replicas=2)
    assert [member.seeds["seed"] for member in studies[0].members] == [1, 2]
    assert studies[0].file == Path("runs/smoke/ensemble.nc")
    with pytest.raises(dt.DustError, match=r"replicas = 2: for many runs there is dt\.sweep"):
        dt.run("tiny.yaml", replicas=2)
    with pytest.raises(dt.DustError, match="nothing to vary: give values"):
        dt.sweep("tiny.yaml")


def test_values_of_a_script_are_those_of_the_command_line(folder):
    scene = dt.load("tiny.yaml")
    values = {"start": [0.5, 1.0], "stop": [{"steps": 5}], "stop.steps": 7}
    texts = ["start=0.5,1.0", "stop={steps: 5}", "stop.steps=7"]
    ours, theirs = (sweep(scene, settings, folder / "s") for settings in (values, texts))
    assert [m.label for m in ours.members] == [m.label for m in theirs.members]
    assert [m.scene for m in ours.members] == [m.scene for m in theirs.members]
    with pytest.raises(dt.DustError, match=r"^start=1\.0,1\.0: a value is given twice"):
        dt.sweep("tiny.yaml", {"start": [1.0, 1.0]})
    with pytest.raises(dt.DustError, match="start: at least one value"):
        dt.sweep("tiny.yaml", {"start": []})


def test_a_scene_may_be_given_in_any_form(folder):
    def numbers(form):
        return {k: v for k, v in as_scene(form).plain.items() if k != "extensions"}

    scene = dt.load("tiny.yaml")
    forms = ("tiny.yaml", folder / "tiny.yaml", TINY, scene.input_data, " " + str(scene.input_data))
    assert all(numbers(form) == numbers(scene) for form in forms)
    assert as_scene(scene) is scene and as_scene("smoke") == dt.load(CONFIGS / "smoke.yaml")
    for wrong, message in ((3, r"^3 \(int\) is no scene"), ("tny", "tny: there is no such file")):
        with pytest.raises(dt.DustError, match=message):
            dt.run(wrong)


def test_failed_runs_are_nan_with_a_warning(folder):
    with pytest.warns(
        RuntimeWarning, match="1 of 2 runs failed:\n.*start=11: .* snapped"
    ) as warned:
        data = dt.sweep("tiny.yaml", {"start": [1, 11]}, figures=False)
    assert warned[0].filename == __file__
    assert data.place.isel(start=1).isnull().all() and data.place.isel(start=0).notnull().any()
    with pytest.raises(dt.errors.GuardStop, match="1 of 1 runs failed"):
        dt.sweep("tiny.yaml", {"start": [11]}, "all")


class Halving(UserStudy):
    def points(self, result):
        return [self.point(f"{start}", {"start": start}) for start in (1.0, 0.5)]

    def measure(self, run):
        return {"place": float(run.series.place[-1])}


def test_a_study_is_a_file_or_a_class(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        data = dt.study(Halving, "tiny.yaml", jobs=1)
    assert (folder / "runs/tiny-halving/study.nc").exists()
    np.testing.assert_allclose(data.place.values[1] / data.place.values[0], 0.5, rtol=1e-12)
    with pytest.raises(dt.DustError, match="there is no such file; a study is a Python file"):
        dt.study("missing.py", "tiny.yaml")
    with pytest.raises(dt.DustError, match=r"no class Study"):
        dt.study("spring.py", "tiny.yaml")


def test_collisions_are_those_of_the_command(monkeypatch, tmp_path):
    """Their arguments arrive; test_collide.py has the numbers."""
    calls = []

    def stop(study, **options):
        calls.append((study.directory, study.axes["speed"], options["jobs"], options["resume"]))
        raise KeyboardInterrupt

    monkeypatch.setattr(engine, "run", stop)
    monkeypatch.chdir(tmp_path)
    path, speeds = CONFIGS / "collide.yaml", {"collisions.speed": ["1 m/s", "2 m/s"]}
    with pytest.raises(Interrupted, match="finished collisions are in .*: resume=True"):
        dt.collide(path, "out", jobs=1, resume=True, **speeds)
    options = ["--set", "collisions.speed=[1 m/s, 2 m/s]", "-o", "out", "--jobs", "1", "--resume"]
    with pytest.raises(Interrupted, match="finished collisions are in out"):
        dust("collide", path, *options, "-q")
    assert calls[0] == calls[1]


SCRIPT = """
import dusttaichi as dt
try:
    dt.sweep("tiny.yaml", {"start": [0.5, 1.0, 1.5]}, jobs=2, figures=False)
except dt.DustError as error:
    print(type(error).__name__, error)
"""


def test_an_interrupted_sweep_resumes(folder):
    write_spring(folder, seconds=0.005)
    (folder / "tiny.yaml").write_text(TINY.replace("steps: 10", "steps: 200"))
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    first = folder / "runs/tiny-sweep/start=0.5/result.nc"
    wait_for(first, process)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=300)
    assert output.startswith("Interrupted interrupted; finished runs are in"), output + errors
    assert "Continue with: resume=True" in output
    with xr.open_dataset(first) as series:
        assert series.attrs["status"] == "interrupted"
    data = dt.sweep("tiny.yaml", {"start": [0.5, 1.0, 1.5]}, jobs=2, resume=True, figures=False)
    assert set(data.status.values.ravel()) == {"finished: 200 steps"}
    changes = {"start": 0.5, "output.snapshots": "off"}  # as those of many runs
    uninterrupted = dt.run("tiny.yaml", "whole", figures=False, **changes)
    assert_same_bits(first, uninterrupted.path)


@pytest.mark.parametrize(
    "text, expected",
    [
        ("Use --force or --resume to", "Use force=True or resume=True to"),
        ("--set a.b=1,1: twice", "a.b=1,1: twice"),
        ("Choose another --output.", "Choose another directory."),
        ("--scheduler tcp://a: no", "scheduler tcp://a: no"),
        ("a--b, 1 -- 2", "a--b, 1 -- 2"),
    ],
)
def test_errors_name_keywords(text, expected):
    assert with_keywords(text) == expected
