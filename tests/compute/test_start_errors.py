"""A compiler that cannot start: what helps, and processes that were forked after a run."""

import sys
import threading

import pytest
from program import python

from dusttaichi.compute import backend
from dusttaichi.compute.engine import is_tested
from dusttaichi.compute.taichi_internals.programs import ProcessError
from dusttaichi.errors import DustError, StartError

FORKED = """
import multiprocessing, os
import dusttaichi as dt
TEXT = '''name: forked
material: silicate_s12
sample: {kind: pair, speed: SPEED m/s, gap: 10 nm}
boundary: {kind: open}
stop: {time: 100 ns}
numerics: {threads: 1}
output: {series: {steps: 50}}
'''

def run(speed):
    with dt.simulate(dt.from_yaml(TEXT.replace("SPEED", str(speed)))) as simulation:
        simulation.run()
        return float(abs(simulation.velocities[0] - simulation.velocities[1]).max())

run(0.1)
with multiprocessing.get_context("fork").Pool(2) as pool:
    print([round(v, 4) for v in pool.map_async(run, [0.1, 0.3]).get(120)])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no fork")
@pytest.mark.skipif(not is_tested(), reason="refused without internals of Taichi")
def test_runs_in_forked_processes_after_a_run():
    process = python("-c", FORKED, timeout=300)
    assert process.stdout.splitlines()[-1:] == ["[0.1054, 0.2753]"], process.stderr


@pytest.mark.parametrize(
    ("name", "error", "message", "error_class"),
    [
        (
            "cpu",
            RuntimeError("[a@1] Virtual memory allocation (1 B) failed."),
            "ulimit",
            StartError,
        ),
        ("cpu", MemoryError(), "limit of memory", StartError),
        ("cpu", RuntimeError("broken"), r"\(broken\)\.$", StartError),
        ("cuda", RuntimeError("no device"), "try backend: cpu", StartError),
        ("cpu", ProcessError("forked; spawn"), "forked; spawn", DustError),
    ],
)
def test_advice_of_a_start_that_fails(name, error, message, error_class):
    """The cpu is advised for another backend alone."""
    refusal = backend._refusal(error, name)
    with pytest.raises(error_class, match=message):
        raise refusal
    assert ("try backend: cpu" in str(refusal)) == (name != "cpu")


def test_a_second_thread_meanwhile_is_refused():
    refusals = []

    def start():
        try:
            with backend._alone():
                pass
        except ProcessError as error:
            refusals.append(str(error))

    with backend._alone():
        thread = threading.Thread(target=start)
        thread.start()
        thread.join()
    assert "another thread" in refusals[0] and "spawn" in refusals[0]
    start()
    assert len(refusals) == 1
