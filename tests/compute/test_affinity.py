"""Cores of the threads that make the steps."""

import os
import sys
from contextlib import suppress

import pytest

from dusttaichi.compute.affinity import POOL, TASKS, thread_ids
from dusttaichi.compute.processor import usable_cores
from dusttaichi.running.interface import simulate
from tests.scenes import make_scene

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or usable_cores() < 2, reason="needs Linux and two cores"
)


def _cpu_time(thread):
    """CPU time of a thread [ns]."""
    return int((TASKS / str(thread) / "schedstat").read_text().split()[0])


def _of_living(read, threads):
    """What `read` finds for each thread; threads of other libraries may end at any moment."""
    living = {}
    for thread in threads:
        with suppress(OSError):
            living[thread] = read(thread)
    return living


@pytest.mark.long
def test_workers_have_cores_of_their_own():
    """Two workers that are woken on one core wait for each other in turns of the scheduler."""
    free = os.sched_getaffinity(0)
    scene = make_scene(sample={"kind": "rbd", "grains": 60, "seed": 1}, threads=2)
    with simulate(scene, log=lambda text: None) as run:
        run.advance(400)  # all kernels are compiled after that
        core_sets = _of_living(os.sched_getaffinity, thread_ids())
        bound = [thread for thread, cores in core_sets.items() if cores != free]
        times_before = _of_living(_cpu_time, core_sets)
        run.advance(400)
        times_after = _of_living(_cpu_time, times_before)
    used = {thread: times_after[thread] - times_before[thread] for thread in times_after}
    assert os.sched_getaffinity(0) == free  # threads of other libraries are not bound
    assert len(bound) == 2
    first, second = (core_sets[thread] for thread in bound)
    assert not first & second
    assert first | second == free
    # the threads that were bound are those that compute
    other_threads = set(used) - {*bound, os.getpid()}
    assert min(used[thread] for thread in bound) > max(
        (used[thread] for thread in other_threads), default=0
    )


def test_a_thread_may_end_between_two_looks():
    dead_thread = 2**22 + 1  # above the largest number that Linux gives a thread
    for read in (os.sched_getaffinity, _cpu_time):
        assert list(_of_living(read, [os.getpid(), dead_thread])) == [os.getpid()]


def test_a_single_worker_runs_where_a_core_is_free():
    free = os.sched_getaffinity(0)
    scene = make_scene(sample={"kind": "rbd", "grains": 60, "seed": 1}, threads=2)
    with simulate(scene, log=lambda text: None) as run:
        run.advance(1)
        assert any(os.sched_getaffinity(thread) != free for thread in POOL.threads)
        POOL.serve(1)
        assert all(os.sched_getaffinity(thread) == free for thread in POOL.threads)
        run.advance(1)
        assert any(os.sched_getaffinity(thread) != free for thread in POOL.threads)
