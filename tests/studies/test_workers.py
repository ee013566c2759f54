"""The engine of studies: worker processes and all ways to die, requests, a study in a file."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from program import dust
from scenes import EXAMPLES

from dusttaichi.errors import DustError, Interrupted, StartError
from dusttaichi.studies import jobs, workers
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies.requests import Request
from dusttaichi.studies.workers import INTERRUPTED, PROCESS_LOST, Worker

TASKS = '''
import os, sys, time
from pathlib import Path

from dusttaichi.errors import DustError, GuardStop, StartError

calls = 0

def task(parent, *, do, **request):
    global calls
    calls += 1
    return globals()[do](parent, **request)

def count(parent):
    return {"calls": calls, "process": os.getpid(), "folder": os.getcwd()}

def refuse(parent, text):
    raise DustError(text)

def unstartable(parent):
    raise StartError("no card")

def guard(parent):
    parent.report(cost=1.5)
    raise GuardStop("too fast")

def crash(parent, status):
    sys.stderr.write("first line\\nlast words")
    sys.stderr.flush()
    os._exit(status)

def fail(parent):
    raise KeyError("a mistake of ours")

def garbage(parent):
    print("this is no answer")
    os.write(1, b"{not JSON\\n[1]\\n")
    parent._write(["neither"])
    return {"fine": True}

def run(parent, path, seconds=60.0):
    """Write a checkpoint when interrupted, as a run does."""
    end = time.monotonic() + seconds
    try:
        while time.monotonic() < end:
            parent.progress(share=0.25)
            time.sleep(0.01)
    except KeyboardInterrupt:
        Path(path).write_text("checkpoint")
        raise

def deaf(parent, begun=None):
    if begun is not None:
        Path(begun).touch()
    while True:
        try:
            time.sleep(60)
        except KeyboardInterrupt:
            pass
'''


@pytest.fixture
def tasks(tmp_path, monkeypatch):
    """The name of a task that can do all of the above."""
    (tmp_path / "made_tasks.py").write_text(TASKS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return "made_tasks:task"


def wait_for(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def alive(process):
    """A process that runs; one that nobody has waited for yet counts as dead."""
    try:
        with open(f"/proc/{process}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_one_process_answers_request_after_request(tasks, tmp_path):
    with Worker(tasks, folder=tmp_path) as worker:
        first, second = worker.call({"do": "count"}), worker.call({"do": "count"})
        assert (first.code, first.text) == (0, "")
        assert [a.values["calls"] for a in (first, second)] == [1, 2]
        assert first.values["process"] == second.values["process"] != os.getpid()
        assert first.values["folder"] == str(tmp_path)
        refused = worker.call({"do": "refuse", "text": "bad: ü [x]"})
        assert (refused.code, refused.text) == (2, "bad: ü [x]")
        stopped = worker.call({"do": "guard"})  # what was reported before is known however it ends
        assert (stopped.code, stopped.values) == (3, {"cost": 1.5})
        # what is printed does not stand between answers
        assert worker.call({"do": "garbage"}).values == {"fine": True}
        assert worker.call({"do": "count"}).values["calls"] == 6 and worker.alive
    assert not alive(first.values["process"])


def test_a_crash_tells_the_last_words(tasks):
    with Worker(tasks) as worker:
        answer = worker.call({"do": "crash", "status": 7})
        assert (
            answer.code == PROCESS_LOST
            and answer.text == "the process ended (status 7): last words"
        )
        assert not worker.alive
        assert worker.call({"do": "count"}).code == PROCESS_LOST  # not the former answer
    with Worker(tasks) as worker:
        assert worker.call({"do": "fail"}).text.endswith("KeyError: 'a mistake of ours'")
    with Worker("no_such_module:task") as worker:
        assert "No module named 'no_such_module'" in worker.call({}).text


def test_a_process_that_is_killed_or_hangs(tasks, tmp_path):
    with Worker(tasks) as worker:
        process = worker.call({"do": "count"}).values["process"]
        request = {"do": "run", "path": str(tmp_path / "c")}
        answer = worker.call(request, report=lambda fraction: os.kill(process, signal.SIGKILL))
    assert answer.code == PROCESS_LOST and "status -9" in answer.text
    assert answer.values == {"share": 0.25}
    with Worker(tasks) as worker:
        process = worker.call({"do": "count"}).values["process"]
        answer = worker.call({"do": "run", "path": str(tmp_path / "never")}, 0.5)
        assert answer.code == PROCESS_LOST and answer.text == "no answer in 0.5 s"
        assert not (tmp_path / "never").exists()  # which it would write when interrupted
        assert not alive(process) and not worker.alive


def test_a_process_that_does_not_stop_is_killed(tasks, tmp_path):
    worker, marker = Worker(tasks), tmp_path / "begun"
    process = worker.call({"do": "count"}).values["process"]
    worker._write({"request": {"do": "deaf", "begun": str(marker)}})
    wait_for(marker.exists)
    began = time.monotonic()
    worker.close(0.5)
    assert not alive(process) and time.monotonic() - began < 10.0


def test_stopping_lets_a_run_write_its_checkpoint(tasks, tmp_path):
    heard = []
    with Worker(tasks) as worker:
        # asked to stop at every report, of which a second one does no harm
        request = {"do": "run", "path": str(tmp_path / "checkpoint")}
        answer = worker.call(request, report=heard.append, stopped=lambda: bool(heard))
        worker.stop()
    assert heard[0] == 0.25
    assert (answer.code, answer.text) == (INTERRUPTED, "interrupted")
    assert (tmp_path / "checkpoint").read_text() == "checkpoint"


PARENT = """
import sys
from dusttaichi.studies.workers import Worker

worker = Worker("made_tasks:task")
process = worker.call({"do": "count"}).values["process"]
worker.call({"do": "run", "path": sys.argv[1]}, report=lambda share: print(process, flush=True))
"""


def test_a_process_dies_with_its_parent_and_writes_its_checkpoint(tasks, tmp_path):
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), root])}
    with subprocess.Popen(
        [sys.executable, "-c", PARENT, str(tmp_path / "checkpoint")],
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    ) as parent:
        process = int(parent.stdout.readline())
        assert alive(process)
        parent.kill()
    wait_for(lambda: not alive(process))
    assert (tmp_path / "checkpoint").read_text() == "checkpoint"


# -- requests of a study --------------------------------------------------------------------------


class Asking:
    """Study of some requests, at once."""

    scene, timed = None, False

    def __init__(self, folder, task, **arguments):
        self.directory, self.file = folder, folder / "study.nc"
        self.rows = folder / "rows.jsonl"
        self.own = [self.request(label, task, **keys) for label, keys in arguments.items()]

    def request(self, label, task, *, seconds=None, **arguments):
        return Request(label, task, arguments, self.rows, seconds=seconds)

    def points(self, answers):
        return self.own


def lines(path):
    return {row.pop("key"): row for row in map(json.loads, path.read_text().splitlines())}


def test_what_failed_is_asked_again_and_what_is_there_is_not(tasks, tmp_path):
    ways = {"a": {"do": "count"}, "b": {"do": "refuse", "text": "no"}, "c": {"do": "crash"}}
    ways["c"]["status"] = 7
    study = Asking(tmp_path, tasks, **ways, d={"do": "count"})
    answers = engine.run(study, jobs=1)
    # one process makes one after another; where it is lost, the next request goes to another one
    assert answers["a"].measured["calls"] == 1 and answers["d"].measured["calls"] == 1
    assert (answers["b"].code, answers["b"].text, answers["b"].measured) == (2, "no", None)
    assert answers["c"].code == workers.PROCESS_LOST and "last words" in answers["c"].text
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
    second_study = Asking(tmp_path, tasks, **dict.fromkeys("abcd", {"do": "count"}))
    later = engine.run(second_study, jobs=1, resume=True)
    assert later["a"].measured == answers["a"].measured
    assert [later[label].measured["calls"] for label in "bc"] == [1, 2]
    assert set(lines(study.rows)) == set("abcd") and all(
        "calls" in r for r in lines(study.rows).values()
    )
    assert (
        engine.run(second_study, jobs=1, force=True)["a"].measured["process"]
        != answers["a"].measured["process"]
    )


def test_points_are_found_in_the_order_in_which_they_were_asked_for(tmp_path, monkeypatch):
    """Also where they end in another one, as those of several processes do."""

    def backwards(runner, points):
        return {label: workers.Answer(values={"name": label}) for label in reversed(points)}

    monkeypatch.setattr(engine.PointRunner, "_run_points", backwards)
    answers = engine.run(Asking(tmp_path, "no:task", a={}, b={}, c={}))
    assert list(answers) == ["a", "b", "c"] and answers["b"].measured == {"name": "b"}


def test_a_signal_keeps_what_is_done(tasks, tmp_path, monkeypatch):
    """The request under way is interrupted, as by Ctrl-C, and those after it do not begin."""
    study = Asking(tmp_path, tasks, a={"do": "count"}, b={"do": "run", "path": str(tmp_path / "c")})
    study.own.append(study.request("c", tasks, do="count"))
    monkeypatch.setattr(jobs, "JOBS_PER_PROCESS", 1)

    def heard(progress):
        if progress.running.get("b"):
            os.kill(os.getpid(), 2)

    with pytest.raises(KeyboardInterrupt):
        engine.run(study, jobs=1, report=heard)
    assert set(lines(study.rows)) == {"a"} and (tmp_path / "c").read_text() == "checkpoint"
    study.own[1] = study.request("b", tasks, do="count")
    assert engine.run(study, jobs=1, resume=True)["c"].measured["calls"] == 2


def test_a_backend_that_cannot_start_ends_a_study(tasks, tmp_path):
    """What runs meanwhile writes its checkpoint, and nothing else begins."""
    later = {"do": "run", "path": str(tmp_path / "checkpoint")}
    ways = {"a": {"do": "count"}, "b": {"do": "unstartable"}, "c": {"do": "count"}, "d": later}
    study = Asking(tmp_path, tasks, **ways, e=later, f=later)
    with pytest.raises(StartError, match="^no card. The study ends at the first run"):
        engine.run(study, jobs=1)
    assert set(lines(study.rows)) == {"a"}


TOY = (EXAMPLES / "best_rebound.py", EXAMPLES / "best_rebound.yaml")


def study(folder, *words, toy=TOY[0]):
    dust("study", toy, TOY[1], "-o", folder, "-q", *words)


@pytest.fixture(scope="module")
def rebound(tmp_path_factory):
    """Folder of the toy study, made by one process, and how many were started."""
    folder, started = tmp_path_factory.mktemp("toy") / "study", []

    class Counted(workers.Worker):
        def __init__(self, task, **options):
            started.append(task)
            super().__init__(task, **options)

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

    monkeypatch.setattr(engine.PointRunner, "_run_points", none)
    study(folder, "--threads", 1, "--resume", "--json")
    output = json.loads(capsys.readouterr().out)
    with xr.open_dataset(folder / "study.nc") as data:
        xr.testing.assert_equal(xr.Dataset.from_dict(output), data)


def test_an_interruption_says_how_to_go_on(tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(engine.PointRunner, "_run_points", interrupted)
    monkeypatch.setattr("sys.argv", ["dust", "study", "a.py", "b.yaml", "--force"])
    with pytest.raises(Interrupted, match="Continue with: dust study a.py b.yaml --resume"):
        study(tmp_path / "out", "--force")


def test_a_file_that_is_no_study(tmp_path):
    with pytest.raises(DustError, match="no such file"):
        study(tmp_path / "out", toy=tmp_path / "nowhere.py")
    (tmp_path / "empty.py").write_text("Study = 3\n")
    with pytest.raises(DustError, match="has no class Study"):
        study(tmp_path / "out", toy=tmp_path / "empty.py")
