"""Ensembles that run: each run a process, by a pool of threads and by Dask. One tiny scene."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from bits import assert_same_bits
from program import dust

from dusttaichi.errors import DustError, GuardStop
from dusttaichi.run import execute
from dusttaichi.scene import from_yaml
from dusttaichi.studies import engine, pool, workers
from dusttaichi.studies.sweep import replicas as replicas_of
from dusttaichi.studies.sweep import sweep

TINY = """
name: tiny
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscous}
sample: {kind: rbd, grains: 60, seed: 3}
boundary: {kind: box, wall_speed: 1 m/s}
stop: {steps: 300}
numerics: {time_step: 0.3 ns, threads: 1}
output: {series: {steps: 50}, profiles: off, snapshots: off, checkpoint: 1000 s}
"""


@pytest.fixture(scope="module")
def replicas(tmp_path_factory):
    """Two replicas done by `dust run`."""
    folder = tmp_path_factory.mktemp("replicas")
    (folder / "tiny.yaml").write_text(TINY + "replicas: 2\n")
    dust("run", folder / "tiny.yaml", "-q", "-o", folder / "runs")
    return folder


def test_replicas_are_the_single_runs_with_these_seeds(replicas, tmp_path):
    single = from_yaml(TINY).with_value("sample.seed", 4)
    execute(single, tmp_path)
    assert_same_bits(tmp_path / "result.nc", replicas / "runs/replica_1/result.nc")
    names = {path.name for path in (replicas / "runs/replica_1").iterdir()}
    assert {"result.nc", "scene.yaml", "checkpoint.bin"} <= names
    assert "ledger.png" not in names  # six runs of a second would take a minute


def test_ensemble_holds_all_and_their_mean(replicas):
    with xr.open_dataset(replicas / "runs/ensemble.nc") as data:
        assert data.seed.values.tolist() == [3, 4]
        assert set(data.status.values) == {"finished: 300 steps"}
        assert data.attrs["coordinate"] == "filling_factor"
        assert "replicas: 2" in data.attrs["scene_resolved"]
        for number in range(2):
            with xr.open_dataset(replicas / f"runs/replica_{number}/result.nc") as one:
                assert float(data.final_height[number]) == float(one.height[-1])
                # the height is as smooth as it can be: interpolation errs in the second order,
                # by (spacing / filling factor)^2 of it
                there = data.height[number].dropna("filling_factor")
                expected = np.interp(there.filling_factor, one.filling_factor, one.height)
                np.testing.assert_allclose(there, expected, rtol=1e-12)
        np.testing.assert_allclose(data.mean_final_height, data.final_height.mean(), rtol=1e-12)
        np.testing.assert_allclose(data.std_final_height, data.final_height.std(ddof=1), rtol=1e-12)
    assert (replicas / "runs/ensemble.png").stat().st_size > 10_000


def test_resume_keeps_what_is_finished(replicas):
    files = [replicas / f"runs/replica_{n}/result.nc" for n in range(2)]
    before = files[0].stat().st_mtime_ns
    whole = files[1].rename(replicas / "whole.nc")
    (replicas / "runs/replica_1/checkpoint.bin").unlink()
    (replicas / "runs/ensemble.nc").unlink()
    dust("run", replicas / "tiny.yaml", "-q", "-o", replicas / "runs", "--resume")
    assert (replicas / "runs/ensemble.nc").exists()
    assert files[0].stat().st_mtime_ns == before
    assert_same_bits(whole, files[1])


def test_a_run_that_fails_does_not_end_the_others(tmp_path, capsys):
    """A lid at 20 m/s drives the grains into each other until a guard stops the run."""
    text = TINY.replace("{steps: 300}", "{filling_factor: 0.74, time: 0.3 us}")
    (tmp_path / "tiny.yaml").write_text(text)
    setting = ["--set", "boundary.wall_speed=1m/s,20m/s"]
    with pytest.raises(GuardStop, match=r"1 of 2 runs failed:\n.*wall_speed=20m_s: At .* µs"):
        dust("sweep", tmp_path / "tiny.yaml", *setting, "-q", "-o", tmp_path / "s")
    assert "wall_speed" in capsys.readouterr().out
    with xr.open_dataset(tmp_path / "s/sweep.nc") as data:
        np.testing.assert_array_equal(data.boundary_wall_speed, [1.0, 20.0])
        assert data.boundary_wall_speed.attrs["units"] == "m/s"
        assert data.height.dims[:2] == ("boundary_wall_speed", "replica")
        assert data.height[0].notnull().all() and data.height[1].isnull().all()
        assert data.status.values[0, 0].startswith("finished")
        assert data.status.values[1, 0].startswith("At ")
    with pytest.raises(
        DustError, match=r"no time series\. The runs of a study are beside it, such"
    ):
        dust("compare", tmp_path / "s/sweep.nc")
    assert (tmp_path / "s/boundary.wall_speed=20m_s/result.nc").exists()


def test_a_process_makes_one_run_after_the_other(tmp_path, monkeypatch):
    started = []

    class Counted(workers.Worker):
        def __init__(self, task, **how):
            started.append(task)
            super().__init__(task, **how)

    monkeypatch.setattr(workers, "Worker", Counted)
    monkeypatch.setattr(engine, "usable_cores", lambda: 1)
    plan = replicas_of(from_yaml(TINY + "replicas: 3\n"), tmp_path)
    assert [one.code for one in engine.run(plan).values()] == [0, 0, 0]
    assert len(started) == 1


def test_an_interruption_reaches_the_runs(tmp_path):
    # a slow wall, so that nothing else ends the run before
    text = TINY.replace("300", "60000000").replace("wall_speed: 1 m/s", "wall_speed: 1 mm/s")
    (tmp_path / "long.yaml").write_text(text + "replicas: 1\n")
    code = "from dusttaichi.commands.app import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "run", "long.yaml", "-q", "--threads", "1"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    first = tmp_path / "runs/tiny/replica_0/result.nc"
    for _ in range(3000):
        if first.exists() or process.poll() is not None:
            break
        time.sleep(0.1)
    time.sleep(0.5)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 130, said
    assert "dust run long.yaml -q --threads 1 --resume" in said and "Traceback" not in said
    with xr.open_dataset(first) as series:
        assert series.attrs["status"] == "interrupted"
        assert int(series.step[-1]) < 60_000_000
    assert (first.parent / "checkpoint.bin").exists()
    assert not (tmp_path / "runs/tiny/ensemble.nc").exists()


def test_dask_cluster_without_a_shared_disk(tmp_path, monkeypatch, cluster):
    """Files of the sample go there, results come back; the same bits as here."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    execute(from_yaml(TINY.replace("snapshots: off, ", "")), tmp_path / "frames")
    last_frame = os.path.relpath(tmp_path / "frames")
    from_file = from_yaml(
        TINY.replace("{kind: rbd, grains: 60, seed: 3}", f"{{kind: explicit, file: {last_frame}}}")
    )
    execute(from_file.with_value("stop.steps", 50), tmp_path / "alone")
    heard = []
    address = cluster.scheduler_address
    assert address.startswith("tcp://")
    plan = sweep(from_file, ["stop.steps=50"], tmp_path / "sweep")
    outcomes = engine.run(plan, scheduler=address, report=lambda p: heard.append(p.done))
    assert [o.code for o in outcomes.values()] == [0] and heard[-1] == 1
    run = plan.members[0].directory
    assert_same_bits(tmp_path / "alone/result.nc", run / "result.nc")
    assert plan.dataset(outcomes).sizes["replica"] == 1
    assert (run / "checkpoint.bin").exists()
    with xr.open_dataset(run / "result.nc") as series:
        assert int(series.step[-1]) == 50 and series.attrs["grains"] == 60


def test_a_scheduler_that_is_not_there(tmp_path, monkeypatch):
    monkeypatch.setattr(pool, "CONNECT", "0.5 s")
    plan = replicas_of(from_yaml(TINY + "replicas: 2\n"), tmp_path / "runs")
    with pytest.raises(DustError, match="no scheduler answers"):
        engine.run(plan, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(DustError, match="no scheduler answers.*unknown address scheme"):
        engine.run(plan, scheduler="nowhere://1")


def test_scheduler_needs_the_extra_and_many_runs(tmp_path, monkeypatch):
    monkeypatch.setattr(pool.importlib.util, "find_spec", lambda name: None)
    plan = replicas_of(from_yaml(TINY + "replicas: 2\n"), tmp_path / "runs")
    with pytest.raises(DustError, match=r"dusttaichi\[cluster\]"):
        engine.run(plan, scheduler="tcp://127.0.0.1:1")
    (tmp_path / "tiny.yaml").write_text(TINY)
    with pytest.raises(DustError, match="replicas, or dust sweep"):
        dust("run", tmp_path / "tiny.yaml", "--scheduler", "tcp://127.0.0.1:1")
