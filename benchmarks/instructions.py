"""Instructions of a process: counted by Linux (perf_event), or in single steps as by a debugger.

Single steps (ptrace) take a second per 1e5 instructions, for counts of millions. The observed
process marks begin and end with `mark`.
"""

import contextlib
import ctypes
import os
import platform
import signal
import struct
import sys

from dusttaichi.errors import DustError

_SYSCALLS = {"x86_64": 298, "aarch64": 241}  # of perf_event_open
_INSTRUCTIONS, _DISABLED_KERNEL_INHERIT = 1, 1 << 5 | 1 << 6 | 1 << 1
_CONTINUE, _STEP, _DETACH, _SEIZE, _INTERRUPT = 7, 9, 17, 0x4206, 0x4207  # of ptrace
_ALL_THREADS = 0x40000000  # __WALL of waitpid
MARK = getattr(signal, "SIGUSR1", None)


class Counter:
    """Counter of the instructions of this process and its later threads."""

    def __init__(self):
        self._file, number = -1, _SYSCALLS.get(platform.machine())
        if number is not None and sys.platform == "linux":
            event_attributes = (0, 112, _INSTRUCTIONS, 0, 0, 0, _DISABLED_KERNEL_INHERIT)
            block = ctypes.create_string_buffer(struct.pack("IIQQQQQ", *event_attributes), 112)
            library = ctypes.CDLL(None, use_errno=True)
            self._file = library.syscall(number, block, 0, -1, -1, 0)

    def read(self) -> int | None:
        """Instructions so far; None where the system does not count them."""
        return None if self._file < 0 else struct.unpack("Q", os.read(self._file, 8))[0]


def mark():
    """Mark the begin or the end of a count, in the observed process."""
    signal.signal(MARK, signal.SIG_IGN)  # a tracer sees it nevertheless
    signal.raise_signal(MARK)


class Stepper:
    """Steps through the threads of a child of this process. A context manager.

    Raises DustError where the system refuses it.
    """

    def __init__(self, process: int):
        if sys.platform != "linux":
            raise DustError("instructions cannot be counted here: Linux alone has what they need")
        library = ctypes.CDLL(None, use_errno=True)
        self._ptrace = library.ptrace
        self._ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
        self._threads = [int(name) for name in os.listdir(f"/proc/{process}/task")]
        for thread in self._threads:
            if self._ptrace(_SEIZE, thread, None, None) != 0:
                reason = os.strerror(ctypes.get_errno())
                raise DustError(f"instructions cannot be counted here: no single steps: {reason}")

    def __enter__(self):
        # fastest on one core
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
                # a process with stopped threads never ends
                self._stop(thread)
                self._ptrace(_DETACH, thread, None, None)

    def instructions(self) -> int:
        """Number of instructions of its threads between two marks, without the thread that marks,
        which runs Python and starts the threads of Taichi."""
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
        for stopped_thread in self._threads:
            if stopped_thread != first:
                self._stop(stopped_thread)
                self._ptrace(_CONTINUE, stopped_thread, None, None)
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
            raise DustError("the observed process has ended")
