"""The processes of the suite: one that crashes is replaced, no test is lost; what they note."""

from collections import defaultdict
from pathlib import Path
from types import SimpleNamespace

import pytest
from scheduler import Files

from dusttaichi.compute.compiled import STRUCTURES, Structures

TESTS = [f"{file}.py::test_{n}" for file, n in zip("aaabccd", "0120010", strict=True)]


class Worker:
    """A process as xdist knows it: it begins a test once it knows the next, or that none comes."""

    def __init__(self, scheduler):
        self.gateway = SimpleNamespace(id="gw")
        self.scheduler, self.queue, self.shutting_down = scheduler, [], False
        scheduler.add_node(self)

    def send_runtest_some(self, indices):
        self.queue += indices

    def shutdown(self):
        self.shutting_down = True

    def next_test(self):
        ready = len(self.queue) > 1 or (self.queue and self.shutting_down)
        return self.queue.pop(0) if ready else None


def _run(crashing):
    """(test, process) of those that ran to the end, and tests that crashed their process."""
    config = SimpleNamespace(
        getvalue=lambda name: ["popen"] * 2, option=SimpleNamespace(loadscopereorder=False)
    )
    log = SimpleNamespace(loadscopesched=None, loadfilesched=lambda *words: None)
    scheduler = Files(config, log, ("a.py", "c.py"))
    workers, late, ran, crashed = [Worker(scheduler) for _ in range(2)], [], [], []
    for worker in workers:
        scheduler.add_node_collection(worker, TESTS)
    scheduler.schedule()
    for _ in range(3 * len(TESTS)):
        for index, worker in enumerate(workers):
            if (number := worker.next_test()) is None:
                continue
            if TESTS[number] in crashing:
                crashed.append(scheduler.remove_node(worker))
                workers[index] = Worker(scheduler)
                late.append(workers[index])
            else:
                ran.append((TESTS[number], worker))
                scheduler.mark_test_complete(worker, number)
        if late:  # has collected, after news of the other process
            scheduler.add_node_collection(late[0], TESTS)
            scheduler.schedule()
            del late[0]
    assert not scheduler.has_pending
    return ran, crashed


@pytest.mark.parametrize("crashing", [(), TESTS[:1], TESTS[1:3], TESTS[-1:], TESTS[3:4], TESTS[4:]])
def test_a_process_that_crashes_is_replaced_and_every_other_test_runs_once(crashing):
    ran, crashed = _run(crashing)
    assert sorted(crashed) == sorted(crashing)
    assert sorted(test for test, _ in ran) == sorted(set(TESTS) - set(crashing))


def test_files_that_belong_together_go_to_one_process():
    ran, _ = _run(())
    assert len({process for test, process in ran if test[0] in "ac"}) == 1
    assert len({process for _, process in ran}) == 2


def test_structures_are_noted(monkeypatch, request):
    """`pytest --structures` lists what was compiled: it wraps a method of the package."""
    conftest = request.config.pluginmanager.get_plugin(str(Path(__file__).parent / "conftest.py"))
    compiled = SimpleNamespace(layout=None)
    monkeypatch.setattr(Structures, "get", lambda self, key, scene, threads, make: make(key))
    monkeypatch.setattr(conftest, "_compiled", defaultdict(list))
    conftest._note_structures()
    assert STRUCTURES.get("key", None, 1, lambda key: compiled) is compiled
    ((test, names),) = conftest._compiled.items()
    assert "test_structures_are_noted" in test and len(names) == 1
