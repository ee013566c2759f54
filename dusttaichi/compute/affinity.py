"""Processor cores of Taichi's threads.

The workers of a step wait for each other at barriers (compute.loops). Linux often wakes two threads
on the core of the thread that woke them and moves one of them away only after some milliseconds, as
long as the call of a kernel takes; until then they wait in vain. Workers bound to different cores
avoid that.
"""

import os
from contextlib import contextmanager, suppress
from pathlib import Path

TASKS = Path("/proc/self/task")


def thread_ids():
    """Numbers of the threads of this process; none where the system does not list them."""
    with suppress(OSError):
        return {int(entry.name) for entry in TASKS.iterdir()}
    return set()


class ThreadPool:
    """The threads of Taichi's loops; none where the system has no affinity."""

    def __init__(self):
        self.threads, self.apart = [], False

    @contextmanager
    def start(self, count):
        """Taichi is initialised in this context, with that many threads."""
        earlier_ids = thread_ids()
        yield
        # Taichi starts the threads that compile first, then the pool
        pool_ids = (
            sorted(thread_ids() - earlier_ids)[-count:] if hasattr(os, "sched_setaffinity") else []
        )
        self.threads, self.apart = pool_ids if len(pool_ids) == count else [], False

    def serve(self, workers):
        """Give each of several workers that wait for each other a core of its own.

        A single one runs wherever a core is free.
        """
        apart = workers > 1
        if apart == self.apart:
            return
        self.apart, count = apart, len(self.threads)
        cores = sorted(os.sched_getaffinity(0)) if count else []
        for number, thread in enumerate(self.threads):
            # fewer cores than threads: some were withdrawn meanwhile
            thread_cores = cores[number::count] if apart and count <= len(cores) else cores
            with suppress(OSError):
                os.sched_setaffinity(thread, thread_cores)

    def measure_waiting(self):
        """Time that the threads have waited for a core since their start [s], all together.

        Other threads had their cores. 0 where the system does not count it.
        """
        return sum(map(_read_waiting_time, self.threads))


def _read_waiting_time(thread):
    """Time that a thread has waited for a core since its start [s]."""
    try:
        return 1e-9 * int((TASKS / str(thread) / "schedstat").read_bytes().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0


POOL = ThreadPool()
