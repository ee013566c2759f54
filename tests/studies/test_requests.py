"""Requests to a task in studies: rows of a file, processes that are lost or too slow, stopping."""

import json
import os

import pytest
from test_workers import tasks  # noqa: F401, a fixture

from dusttaichi.errors import DustError
from dusttaichi.studies import engine, jobs, workers
from dusttaichi.studies.requests import Request


class Asking:
    """Study of some requests, at once."""

    scene, timed = None, False

    def __init__(self, folder, task, **arguments):
        self.directory, self.file = folder, folder / "study.nc"
        self.rows = folder / "rows.jsonl"
        self.own = [self.request(label, task, **own) for label, own in arguments.items()]

    def request(self, label, task, *, seconds=None, **arguments):
        return Request(label, task, arguments, self.rows, seconds=seconds)

    def points(self, found):
        return self.own


def lines(path):
    return {row.pop("key"): row for row in map(json.loads, path.read_text().splitlines())}


def test_what_failed_is_asked_again_and_what_is_there_is_not(tasks, tmp_path):  # noqa: F811
    ways = {"a": {"do": "count"}, "b": {"do": "refuse", "text": "no"}, "c": {"do": "crash"}}
    ways["c"]["status"] = 7
    study = Asking(tmp_path, tasks, **ways, d={"do": "count"})
    found = engine.run(study, jobs=1)
    # one process makes one after another; where it is lost, the next request goes to another one
    assert found["a"].measured["calls"] == 1 and found["d"].measured["calls"] == 1
    assert (found["b"].code, found["b"].text, found["b"].measured) == (2, "no", None)
    assert found["c"].code == workers.LOST and "last words" in found["c"].text
    assert {key: row.get("code", 0) for key, row in lines(study.rows).items()} == {
        "a": 0,
        "b": 2,
        "c": 1,
        "d": 0,
    }
    with pytest.raises(DustError, match="rows.jsonl exists already.*--resume"):
        engine.run(study)
    with study.rows.open("a") as file:
        file.write('{"key": "b", "cut o')
    again = Asking(tmp_path, tasks, **dict.fromkeys("abcd", {"do": "count"}))
    later = engine.run(again, jobs=1, resume=True)
    assert later["a"].measured == found["a"].measured
    assert [later[label].measured["calls"] for label in "bc"] == [1, 2]
    assert set(lines(study.rows)) == set("abcd") and all(
        "calls" in r for r in lines(study.rows).values()
    )
    assert (
        engine.run(again, jobs=1, force=True)["a"].measured["process"]
        != found["a"].measured["process"]
    )


def test_points_are_found_in_the_order_in_which_they_were_asked_for(tmp_path, monkeypatch):
    """Also where they end in another one, as those of several processes do."""

    def backwards(points, *_, **__):
        return {label: workers.Answer(found={"name": label}) for label in reversed(points)}

    monkeypatch.setattr(engine, "_do", backwards)
    found = engine.run(Asking(tmp_path, "no:task", a={}, b={}, c={}))
    assert list(found) == ["a", "b", "c"] and found["b"].measured == {"name": "b"}


def test_a_process_that_takes_too_long_is_killed(tasks, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.setattr(jobs, "STARTING", 20.0)
    slow = {"do": "run", "path": str(tmp_path / "never"), "seconds": 0.5}
    found = engine.run(
        Asking(tmp_path, tasks, a={"do": "count"}, b=slow, c={"do": "count"}), jobs=1
    )
    assert found["b"].code == workers.LOST and found["b"].text == "no answer in 0.5 s"
    assert found["c"].measured["calls"] == 1 and not (tmp_path / "never").exists()


def test_a_signal_keeps_what_is_done(tasks, tmp_path, monkeypatch):  # noqa: F811
    """The request under way is interrupted, as by Ctrl-C, and those after it do not begin."""
    study = Asking(tmp_path, tasks, a={"do": "count"}, b={"do": "run", "path": str(tmp_path / "c")})
    study.own.append(study.request("c", tasks, do="count"))
    monkeypatch.setattr(jobs, "ROUNDS", 1)

    def heard(progress):
        if progress.running.get("b"):
            os.kill(os.getpid(), 2)

    with pytest.raises(KeyboardInterrupt):
        engine.run(study, jobs=1, report=heard)
    assert set(lines(study.rows)) == {"a"} and (tmp_path / "c").read_text() == "checkpoint"
    study.own[1] = study.request("b", tasks, do="count")
    assert engine.run(study, jobs=1, resume=True)["c"].measured["calls"] == 2
