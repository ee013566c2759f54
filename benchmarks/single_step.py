"""Instructions of a process, one by one, as a debugger steps through them (Linux: ptrace).

A process that is stepped through runs some 1e5 instructions a second, so that this is for millions
of them. The process that is looked at marks where to begin and to end with `mark`.
"""

import contextlib
import ctypes
import os
import signal
import sys

from dusttaichi.errors import DustError

_CONTINUE, _STEP, _DETACH, _SEIZE, _INTERRUPT = 7, 9, 17, 0x4206, 0x4207  # of ptrace
_ALL_THREADS = 0x40000000  # __WALL of waitpid
MARK = getattr(signal, "SIGUSR1", None)


def mark():
    """In the process that is looked at: an end of a stretch. Nothing where nobody looks."""
    signal.signal(MARK, signal.SIG_IGN)  # who looks sees it nevertheless
    signal.raise_signal(MARK)


def possible() -> bool:
    """Whether this system has what it takes."""
    return sys.platform == "linux" and MARK is not None


class Stepper:
    """Steps through the threads of a child of this process. A context manager.

    Raises DustError where the system does not let it.
    """

    def __init__(self, process: int):
        library = ctypes.CDLL(None, use_errno=True)
        self._ptrace = library.ptrace
        self._ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
        self._threads = [int(name) for name in os.listdir(f"/proc/{process}/task")]
        for thread in self._threads:
            if self._ptrace(_SEIZE, thread, None, None) != 0:
                reason = os.strerror(ctypes.get_errno())
                raise DustError(f"a process cannot be stepped through here: {reason}")

    def __enter__(self):
        # a step and the return from it follow each other soonest on one core
        self._cores = os.sched_getaffinity(0)
        core = {min(self._cores)}
        for thread in (0, *self._threads):
            os.sched_setaffinity(thread, core)
        return self

    def __exit__(self, *_):
        os.sched_setaffinity(0, self._cores)
        for thread in self._threads:
            with contextlib.suppress(OSError, DustError):
                os.sched_setaffinity(thread, self._cores)
                # nobody can wait for the end of a process whose threads are held
                self._stop(thread)
                self._ptrace(_DETACH, thread, None, None)

    def instructions(self) -> int:
        """How many its threads make from its next mark to the one after that; the one that marks is
        let go and not counted: it tells Taichi's threads what to do, in Python."""
        first = self._run_to_mark()
        for thread in self._threads:
            if thread != first:
                self._stop(thread)
                self._ptrace(_STEP, thread, None, None)
        self._ptrace(_CONTINUE, first, None, None)
        count = 0
        while True:
            thread, status = os.waitpid(-1, _ALL_THREADS)
            self._check(status)
            if thread == first and os.WSTOPSIG(status) == MARK:
                break
            count += thread != first
            self._ptrace(_CONTINUE if thread == first else _STEP, thread, None, None)
        for other in self._threads:
            if other != first:
                self._stop(other)
                self._ptrace(_CONTINUE, other, None, None)
        self._ptrace(_CONTINUE, first, None, None)
        return count

    def _run_to_mark(self):
        while True:
            thread, status = os.waitpid(-1, _ALL_THREADS)
            self._check(status)
            if os.WSTOPSIG(status) == MARK:
                return thread
            self._ptrace(_CONTINUE, thread, None, None)

    def _stop(self, thread):
        self._ptrace(_INTERRUPT, thread, None, None)
        self._check(os.waitpid(thread, _ALL_THREADS)[1])

    @staticmethod
    def _check(status):
        if not os.WIFSTOPPED(status):
            raise DustError("the process that was stepped through has ended")
