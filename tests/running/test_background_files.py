"""A run whose files another process writes has the same data, also after its end in between."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest
import toy
import xarray as xr

from dusttaichi.compute.background import Background
from dusttaichi.errors import DustError, Interrupted
from dusttaichi.method import ArraysOnRequest, State
from dusttaichi.results import files
from dusttaichi.running import checkpoint, execute, persistence
from dusttaichi.running.interface import simulate
from dusttaichi.scene import from_yaml


@pytest.fixture
def aside(monkeypatch, toys):
    """Every file of a run is written by the other process, for which these short runs wait."""
    toy.prepare()
    monkeypatch.setattr(Background, "busy", False)
    monkeypatch.setattr(persistence, "LARGE", 0)
    monkeypatch.setattr(persistence, "LEAST", 0.0)
    monkeypatch.setattr(persistence, "FLUSH_SHARE", np.inf)


def variables(directory):
    with xr.open_datatree(directory / files.RESULT) as tree:
        return {
            (name, key): values.values
            for name, node in tree.subtree_with_keys
            for key, values in node.variables.items()
            if key != "wall_clock"
        }


@pytest.mark.parametrize("piece", [True, False])
def test_a_run_has_the_same_data(tmp_path, aside, monkeypatch, piece):
    toy.with_parts(piece)
    started = []
    start = Background.start
    monkeypatch.setattr(Background, "start", lambda *a: started.append(a) or start(*a))
    toy.go("staged", tmp_path / "aside")
    assert len(started) > 3
    monkeypatch.setattr(persistence, "LARGE", 10**12)
    toy.go("staged", tmp_path / "here")
    one, other = (variables(tmp_path / name) for name in ("aside", "here"))
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=str(name))


def test_an_interrupted_run_waits_for_its_file_and_goes_on(tmp_path, aside):
    scene, seen = from_yaml(toy.SCENES["staged"]), []

    def stop(report):
        seen.append(report.step)
        if len(seen) == 5:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Interrupted):
        execute(scene, tmp_path / "run", report=stop)
    assert not (tmp_path / "run" / ".lock").exists()
    execute(scene, tmp_path / "run", resume=True)
    toy.go("staged", tmp_path / "other")
    one, other = (variables(tmp_path / name) for name in ("run", "other"))
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=str(name))


def test_a_full_disk_ends_the_run_with_the_message_of_a_flush(tmp_path, aside):
    scene = from_yaml(toy.SCENES["staged"])

    def block(report):
        Path(tmp_path, "run", ".result.nc.tmp").mkdir(exist_ok=True)

    with pytest.raises(DustError, match="Could not write .*--resume"):
        execute(scene, tmp_path / "run", report=block)
    Path(tmp_path, "run", ".result.nc.tmp").rmdir()
    execute(scene, tmp_path / "run", resume=True)


def test_the_process_ends_where_the_last_save_fails(tmp_path, toys, monkeypatch):
    """Else it would have the lock of the directory after the run has released it."""
    toy.prepare()
    closed = []
    close = Background.close
    monkeypatch.setattr(Background, "close", lambda *a: closed.append(a) or close(*a))
    simulation = simulate(from_yaml(toy.SCENES["staged"]), directory=tmp_path / "run")
    simulation.advance(5)

    def refuse(*_, **__):
        raise DustError("no space left")

    monkeypatch.setattr(persistence.checkpoint, "write", refuse)
    with pytest.raises(DustError, match="no space left"):
        simulation.close()
    assert len(closed) == 1
    with xr.open_datatree(tmp_path / "run" / files.RESULT) as tree:
        assert tree.attrs["status"] == "interrupted", "the result is complete nevertheless"


def test_a_checkpoint_is_of_the_state_before_the_last_records(tmp_path, toys, monkeypatch):
    """Which may change it, as the sums of losses of grains; it is written one array at a time."""
    toy.prepare()
    simulation = simulate(from_yaml(toy.SCENES["staged"]), directory=tmp_path / "run")
    simulation.advance(5)
    run = simulation._run
    sim, x = run.sim, run.sim.x
    view = State(ArraysOnRequest({"x": lambda: np.array([sim.x])}), sim.state().numbers)
    monkeypatch.setattr(sim, "view_state", lambda: view)
    run.files.save(run, lambda: setattr(sim, "x", x + 1.0))
    stored = checkpoint.load(tmp_path / "run" / files.CHECKPOINT).arrays["x"]
    assert stored.tolist() == [x]
    simulation.close()
