"""The scripts of docs/studies/clusters.md, where SLURM and dask-jobqueue are this machine."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr
from program import dust
from scenes import EXAMPLES, extensions_forgotten, write_spring

from dusttaichi.commands.sweep import _part
from dusttaichi.errors import DustError

KEYS = ["--set", "stop.steps=50,60,70"]
TINY = """
name: tiny
method: spring
extensions: [spring.py]
boundary: {kind: open}
stop: {steps: 10}
numerics: {time_step: 10 ns}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with tiny.yaml and its method, `dust` of this Python on the PATH."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    write_spring(tmp_path)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    monkeypatch.setenv("PATH", path)
    monkeypatch.chdir(tmp_path)
    with extensions_forgotten():
        yield tmp_path


def steps(folder):
    """Steps of the runs that have a result, and when their results were written."""
    found = {}
    for path in sorted(folder.glob("runs/tiny-sweep/*/result.nc")):
        with xr.open_dataset(path) as series:
            found[int(series.step[-1])] = path.stat().st_mtime_ns
    return found


@pytest.mark.long  # four starts of the program
def test_a_job_array_does_the_sweep_in_parts(folder):
    array = {**os.environ, "SLURM_ARRAY_TASK_COUNT": "2"}
    script = ["bash", str(EXAMPLES / "sweep_array.sh"), "tiny.yaml", *KEYS]
    for task, expected in (("2", [60]), ("1", [50, 60, 70])):
        env = array | {"SLURM_ARRAY_TASK_ID": task}
        done = subprocess.run(script, env=env, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert sorted(steps(folder)) == expected
    assert "when all are done" in done.stdout
    assert not (folder / "runs/tiny-sweep/sweep.nc").exists()
    before = steps(folder)
    dust("sweep", "tiny.yaml", *KEYS, "--resume", "-q", "--no-figures")
    assert steps(folder) == before  # gathered, and nothing computed again
    with xr.open_dataset(folder / "runs/tiny-sweep/sweep.nc") as data:
        assert set(data.status.values.ravel()) == {f"finished: {n} steps" for n in (50, 60, 70)}
    assert not (folder / "runs/tiny-sweep/sweep.png").exists()


@pytest.mark.long  # tests of ensembles send runs to Dask in every suite
def test_a_sweep_goes_to_the_workers_of_jobqueue(folder, cluster):
    example = runpy.run_path(str(EXAMPLES / "jobqueue.py"))
    code = example["sweep"](cluster, "tiny.yaml", ["stop.steps=50,60"], "-q", "--no-figures")
    assert code == 0 and sorted(steps(folder)) == [50, 60]
    assert (folder / "runs/tiny-sweep/sweep.nc").exists()


@pytest.mark.parametrize("text", ["0/2", "3/2", "1", "a/b", "1/0"])
def test_a_part_that_is_none(text):
    with pytest.raises(DustError, match="allowed: K/N with K from 1 to N"):
        _part(text)
    assert _part(None) == (1, 1) and _part("2/8") == (2, 8)
