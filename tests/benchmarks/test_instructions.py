"""Counting the instructions of a process by stepping through it, and of a step of grains."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.instructions import Stepper
from dusttaichi.errors import DustError

CHILD = """
import sys, threading
from benchmarks.instructions import mark
rounds, go, done = [50, 100], threading.Semaphore(0), threading.Semaphore(0)
def work():
    for n in rounds:
        go.acquire()
        for _ in range(n):
            pass
        done.release()
threading.Thread(target=work).start()
print("ready", flush=True)
sys.stdin.readline()
for _ in rounds:
    mark()
    go.release()
    done.acquire()
    mark()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="not Linux")
def test_twice_the_work_takes_more_instructions():
    with subprocess.Popen(
        [sys.executable, "-c", CHILD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    ) as child:
        child.stdout.readline()
        try:
            with Stepper(child.pid) as stepper:
                child.stdin.write("go\n")
                child.stdin.flush()
                once, twice = stepper.instructions(), stepper.instructions()
        except DustError as error:
            child.kill()
            pytest.skip(str(error))
    # an iteration of nothing takes Python ten instructions at least
    assert once > 50 * 10
    assert twice > once + 50 * 10
