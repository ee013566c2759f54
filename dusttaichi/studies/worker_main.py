"""Main module of a worker process; its argument is MODULE:FUNCTION of the task.

The protocol is described in workers.py. The function is imported at the first request, so that the
parent receives an answer also after an interruption of the import.
"""

import importlib
import json
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TextIO

from dusttaichi.compute.collector import collect_seldom
from dusttaichi.errors import DustError, StartError

REPORT_INTERVAL = 0.5  # s between two reports of progress
CHECKPOINT_TIME = 100.0  # s for an interrupted task to write its checkpoint
INTERRUPT_INTERVAL = 10.0  # s until the next interruption: one inside Taichi may get lost


class Parent:
    """The parent process, for a task."""

    def __init__(self, write: Callable[[dict[str, Any]], None]) -> None:
        self._write = write
        self._reported = -REPORT_INTERVAL

    def report(self, **values: Any) -> None:
        """Report values of JSON."""
        self._write({"report": values})

    def progress(self, **values: Any) -> None:
        """Report, at most once in REPORT_INTERVAL."""
        time_now = time.monotonic()
        if time_now - self._reported >= REPORT_INTERVAL:
            self._reported = time_now
            self.report(**values)


class Child:
    """Answers requests from the standard input until that ends."""

    def __init__(self, task: str, answers: TextIO) -> None:
        self._name, self._answers, self._lock = task, answers, threading.Lock()
        self._lines: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self._busy = self._input_ended = False
        self._parent = Parent(self._write)
        threading.Thread(target=self._read, daemon=True).start()

    def serve(self) -> None:
        """Answer all requests."""
        while not self._input_ended:
            message = self._lines.get()
            with self._lock:
                if message is None or self._input_ended:
                    return
                self._busy = True
            self._write(self._answer(message["request"]))

    def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            module, _, function = self._name.partition(":")
            task = getattr(importlib.import_module(module), function)
            answer = {"code": 0, "text": "", "values": task(self._parent, **request)}
        except DustError as error:
            answer = {"code": error.exit_code, "text": str(error)}
            answer["startable"] = not isinstance(error, StartError)
        except KeyboardInterrupt:
            answer = {"code": 130, "text": "interrupted"}
        with self._lock:  # now the end of the input no longer interrupts
            self._busy = False
        return answer

    def _write(self, message: dict[str, Any]) -> None:
        # a task without a parent still writes its checkpoint
        with suppress(BrokenPipeError):
            print(json.dumps(message), file=self._answers, flush=True)

    def _read(self) -> None:
        """Read the lines of the input; interrupt the task at its end."""
        unfinished_line = b""
        # not sys.stdin, which would be locked when the interpreter ends
        while chunk := os.read(0, 1 << 16):
            *lines, unfinished_line = (unfinished_line + chunk).split(b"\n")
            for line in lines:
                self._lines.put(json.loads(line))
        end = time.monotonic() + CHECKPOINT_TIME
        while time.monotonic() < end:
            with self._lock:
                self._input_ended = True
                if not self._busy:
                    self._lines.put(None)
                    return
                os.kill(os.getpid(), signal.SIGINT)
            time.sleep(INTERRUPT_INTERVAL)
        os._exit(130)


def main() -> None:
    """Entry point of the process."""
    collect_seldom()
    # output of libraries must not come between the answers
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # the parent may ignore it
    with suppress(KeyboardInterrupt):  # one after the answer
        Child(sys.argv[1], answers).serve()


if __name__ == "__main__":
    main()
