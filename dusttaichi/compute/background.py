"""Functions that a process of their own calls while this one continues.

A thread alone would wait: Taichi holds Python's lock during a kernel. A request is the pickle of a
function and its arguments, whose arrays follow it as bytes; the answer is that of its error, or of
None.
"""

from __future__ import annotations

import os
import pickle
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from dusttaichi.compute.processes import python_command
from dusttaichi.errors import DustError


class Background:
    """One process that calls functions, one request at a time; started with the first.

    descriptors: open files that it inherits, such as those of a lock, which it then holds until it
    is idle, even if this process is killed. done: calls of the last `start` that have returned;
    seconds: that it took.
    """

    def __init__(self, descriptors: Iterable[int] = ()) -> None:
        self._descriptors = list(descriptors)
        self._process: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None
        self._error: BaseException | None = None
        self.seconds, self.done = 0.0, 0

    @property
    def has_begun(self) -> bool:
        """True where its process has been started, and has not ended."""
        return self._process is not None

    @property
    def busy(self) -> bool:
        """True while it works."""
        return self._thread is not None and self._thread.is_alive()

    def start(self, *calls: tuple[Any, ...]) -> None:
        """Begin to call functions one after another, up to the first error.

        calls: tuples (function, arguments, ...), which must not change until `wait`.
        """
        self.wait()
        self._error, self.done = None, 0
        self._thread = threading.Thread(target=self._call, args=(calls,))
        self._thread.start()

    def wait(self) -> BaseException | None:
        """Wait until it is idle; returns the error of the last `start`, once, or None."""
        if self._thread is None:
            return None
        self._thread.join()
        self._thread = None
        return self._error

    def close(self) -> BaseException | None:
        """Wait, and end the process."""
        error = self.wait()
        if self._process is not None:
            with suppress(OSError):
                _send(self._process.stdin, None)
            self._end()
        return error

    def _call(self, calls) -> None:
        began = time.perf_counter()
        for function, *arguments in calls:
            self._error = self._exchange(function, arguments)
            if self._error is not None:
                break
            self.done += 1
        self.seconds = time.perf_counter() - began

    def _exchange(self, function, arguments):
        """Error of one call, or None."""
        try:
            if self._process is None:
                self._process = self._open()
            _send(self._process.stdin, (function, arguments))
            return _receive(self._process.stdout)
        except (OSError, EOFError) as error:  # the next request starts another process
            if self._process is not None:
                self._process.kill()
                self._end()
            return RuntimeError(f"the process that writes files has ended ({error})")

    def _end(self) -> None:
        """Wait for the end of the process, which is about to end or was killed."""
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                pipe.close()
        self._process.wait()
        self._process = None

    def _open(self):
        return subprocess.Popen(
            python_command("dusttaichi.compute.background"),
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            pass_fds=self._descriptors,
            start_new_session=True,  # Ctrl-C is for the run, which waits for it
        )


def _send(pipe, value) -> None:
    """Write a value into a pipe. Raises OSError where the other end is gone."""
    buffers = []
    head = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    views = [buffer.raw() for buffer in buffers]
    lengths = [len(head), *(view.nbytes for view in views)]
    pipe.write(struct.pack(f"<q{len(lengths)}q", len(lengths), *lengths))
    for view in (memoryview(head), *views):
        while view.nbytes:
            view = view[pipe.write(view) :]


def _receive(pipe):
    """Read the next value of a pipe. Raises EOFError where there is none any more."""
    (count,) = struct.unpack("<q", _read(pipe, 8))
    lengths = struct.unpack(f"<{count}q", _read(pipe, 8 * count))
    head, *buffers = (_read(pipe, length) for length in lengths)
    return pickle.loads(head, buffers=buffers)


def _read(pipe, length):
    data = bytearray(length)
    view = memoryview(data)
    while view.nbytes:
        if not (count := pipe.readinto(view)):
            raise EOFError("no answer")
        view = view[count:]
    return data


def _call(function, arguments):
    """The error of a function, in a form that can be sent, or None."""
    try:
        function(*arguments)
    except Exception as error:
        return error if isinstance(error, (OSError, DustError)) else RuntimeError(str(error))
    return None


def main() -> None:
    """Entry point of the process: answers requests until its input ends."""
    # output of libraries must not come between the answers
    source, answers = open(0, "rb", buffering=0), open(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    sys.stdin = None
    while True:
        try:
            request = _receive(source)
        except EOFError:  # the run was killed
            return
        if request is None:
            return
        function, arguments = request
        answer = _call(function, arguments)
        del request, arguments  # while it waits
        with suppress(BrokenPipeError):
            _send(answers, answer)


if __name__ == "__main__":
    main()
