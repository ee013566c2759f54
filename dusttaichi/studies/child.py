"""The inside of a worker process; the argument of this module is MODULE:FUNCTION of its task.

The protocol is described in workers.py. The function is imported with the first request, so that
an interruption during the import is an answer like any other.
"""

import importlib
import json
import os
import queue
import signal
import sys
import threading
import time
from contextlib import suppress

from dusttaichi.compute.collector import collect_seldom
from dusttaichi.errors import DustError

REPORT_EVERY = 0.5  # s between two reports of progress
GRACE = 100.0  # s that an interrupted task may take to write its checkpoint
AGAIN = 10.0  # s after which it is interrupted again: an interruption inside Taichi may get lost


class Parent:
    """The process that asked, as a task sees it."""

    def __init__(self, write, receive):
        self._write, self._receive = write, receive
        self._reported = -REPORT_EVERY

    def report(self, **found):
        """Tell what is known so far; values as JSON has them."""
        self._write({"report": found})

    def progress(self, **found):
        """Report, but no more often than every half a second."""
        now = time.monotonic()
        if now - self._reported >= REPORT_EVERY:
            self._reported = now
            self.report(**found)

    def wait_for_go(self):
        """Report `ready` and wait until the parent lets this and other workers begin at once."""
        self.report(ready=True)
        self._receive()


class Child:
    """Takes requests from the standard input until it ends, and answers them."""

    def __init__(self, task, answers):
        self._name, self._answers = task, answers
        self._lines, self._lock = queue.Queue(), threading.Lock()
        self._busy = self._ended = False
        self._parent = Parent(self._write, self._lines.get)
        threading.Thread(target=self._read, daemon=True).start()

    def serve(self):
        """Answer all requests."""
        while not self._ended:
            message = self._lines.get()
            if message is not None and "request" not in message:
                continue  # the go of a task that has ended before it waited
            with self._lock:
                if message is None or self._ended:
                    return
                self._busy = True
            self._write(self._do(message["request"]))

    def _do(self, request):
        try:
            module, _, function = self._name.partition(":")
            task = getattr(importlib.import_module(module), function)
            answer = {"code": 0, "text": "", "found": task(self._parent, **request)}
        except DustError as error:
            answer = {"code": error.exit_code, "text": str(error)}
        except KeyboardInterrupt:
            answer = {"code": 130, "text": "interrupted"}
        with self._lock:  # from here on the end of the input does not interrupt any more
            self._busy = False
        return answer

    def _write(self, message):
        # without a parent there is nobody to tell, but a checkpoint to write
        with suppress(BrokenPipeError):
            print(json.dumps(message), file=self._answers, flush=True)

    def _read(self):
        """Pass the lines of the input on; interrupt the task when the input ends."""
        rest = b""
        # not sys.stdin, whose lock would be held when the interpreter ends
        while chunk := os.read(0, 1 << 16):
            *lines, rest = (rest + chunk).split(b"\n")
            for line in lines:
                self._lines.put(json.loads(line))
        end = time.monotonic() + GRACE
        while time.monotonic() < end:
            with self._lock:
                self._ended = True
                if not self._busy:
                    self._lines.put(None)
                    return
                os.kill(os.getpid(), signal.SIGINT)
            time.sleep(AGAIN)
        os._exit(130)


def main():
    """Entry point of the process."""
    collect_seldom()
    # what a library prints must not stand between the answers
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be inherited as ignored
    with suppress(KeyboardInterrupt):  # that came when the answer was given already
        Child(sys.argv[1], answers).serve()


if __name__ == "__main__":
    main()
