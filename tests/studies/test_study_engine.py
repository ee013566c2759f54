"""The engine of studies, by a study in a file: docs/examples/best_rebound.py."""

import json

import numpy as np
import pytest
import xarray as xr
from program import dust
from scenes import EXAMPLES

from dusttaichi.errors import DustError, Interrupted
from dusttaichi.studies import engine, workers

TOY = (EXAMPLES / "best_rebound.py", EXAMPLES / "best_rebound.yaml")


def study(folder, *words, toy=TOY[0]):
    dust("study", toy, TOY[1], "-o", folder, "-q", *words)


@pytest.fixture(scope="module")
def rebound(tmp_path_factory):
    """Folder of the toy study, made by one process, and how many were started."""
    folder, started = tmp_path_factory.mktemp("toy") / "study", []

    class Counted(workers.Worker):
        def __init__(self, task, **how):
            started.append(task)
            super().__init__(task, **how)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(workers, "Worker", Counted)
        study(folder, "--jobs", 1, "--threads", 1)
    return folder, len(started)


def test_a_study_asks_again_until_it_wants_no_more(rebound):
    """Golden section: two speeds at first, then one a time, towards the largest restitution."""
    folder, started = rebound
    with xr.open_dataset(folder / "study.nc") as data:
        speeds = data.label.values.astype(float)
        # in the ends of a bracket of 100 times, 0.618 of it (in its logarithm) stays each time
        rounds = np.log(np.log(100.0) / np.log(1.5)) / -np.log((5**0.5 - 1) / 2)
        assert len(speeds) == 1 + np.ceil(rounds)
        best = speeds[int(data.restitution.values.argmax())]
        assert np.all(np.isfinite(data.restitution)) and set(data.status.values) == {"finished"}
        # every other speed is on the way down from it
        order = np.argsort(speeds)
        rises = np.diff(data.restitution.values[order]) > 0.0
        assert np.array_equal(rises, speeds[order][1:] <= best)
    assert started == 1  # one process makes the runs of all rounds
    assert len(list(folder.glob("*/result.nc"))) == len(speeds)


def test_what_is_finished_is_not_computed_again(rebound, capsys, monkeypatch):
    folder, _ = rebound
    with pytest.raises(DustError, match="study.nc exists already.*--resume"):
        study(folder)

    def none(*_, **__):
        raise AssertionError("a run that is finished is computed again")

    monkeypatch.setattr(engine, "_do", none)
    study(folder, "--threads", 1, "--resume", "--json")
    said = json.loads(capsys.readouterr().out)
    with xr.open_dataset(folder / "study.nc") as data:
        xr.testing.assert_equal(xr.Dataset.from_dict(said), data)


def test_an_interruption_says_how_to_go_on(tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(engine, "_do", interrupted)
    monkeypatch.setattr("sys.argv", ["dust", "study", "a.py", "b.yaml", "--force"])
    with pytest.raises(Interrupted, match="Continue with: dust study a.py b.yaml --resume"):
        study(tmp_path / "out", "--force")


def test_a_file_that_is_no_study(tmp_path):
    with pytest.raises(DustError, match="no such file"):
        study(tmp_path / "out", toy=tmp_path / "nowhere.py")
    (tmp_path / "empty.py").write_text("Study = 3\n")
    with pytest.raises(DustError, match="has no class Study"):
        study(tmp_path / "out", toy=tmp_path / "empty.py")
