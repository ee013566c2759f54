"""Worker processes: one protocol for all studies that compute in several processes.

A worker is a Python process that imports Taichi and handles its own memory and signals. `Worker`
starts it and communicates with it; `worker_main.py` is its main module. Both sides write one JSON
object per line: requests go to the standard input of the process, reports and answers come from its
standard output, and the message after a crash is from its standard error.

    parent                              child
    {"request": {...}}             ->   the task begins
                                   <-   {"report": {"share": 0.4}}      any number of times
                                   <-   {"code": 0, "text": "", "values": {...}}
    end of the input               ->   a running task is interrupted as by Ctrl-C and writes its
                                        checkpoint; then the process ends

The input also ends with the parent, even after a kill. Threads (`concurrent.futures`) wait for the
workers; pools of processes, of `concurrent.futures` or of pebble, are not used, because their
processes cannot report progress or write a checkpoint before their end.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from dusttaichi.compute import compiler
from dusttaichi.compute.processes import python_command

PROCESS_LOST = 1  # code of a process that died, or did not answer in time
INTERRUPTED = 130  # code of a task that was stopped
CHECK_INTERVAL = 0.5  # s between two checks of a thread whether to stop
CHECKPOINT_TIMEOUT = 120.0  # s for a stopped process to write its checkpoint, before it is killed
START_ALLOWANCE = 60.0  # s more for the first request of a process: imports and compilation


@dataclass(frozen=True)
class Answer:
    """Result of a request.

    code: 0, the exit code of a DustError (2: refused, 3: stopped by a guard), INTERRUPTED, or LOST.
    text: message of the error, or "". values: everything that the task has reported and returned.
    files: name -> content of those in the folder of a run on a cluster (jobs.Job). startable: False
    where the backend cannot start, which no other request would change.
    """

    code: int = 0
    text: str = ""
    values: dict[str, Any] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    startable: bool = True


class Worker(AbstractContextManager["Worker"]):
    """A process for one kind of task, one request after the other.

    task: "module:function"; the process calls function(parent, **request), which returns a dict or
    None; `parent` is a `worker_main.Parent`. folder: current directory. kernels: folder of the
    compiled kernels, by default the common one. A context manager: at its end the process is
    stopped.

    fresh: True until it has answered for the first time.
    """

    def __init__(
        self, task: str, *, folder: Path | None = None, kernels: Path | None = None
    ) -> None:
        self.task, self.fresh = task, True
        kernel_environment = (
            {} if kernels is None else {compiler.variable(compiler.KERNEL_FOLDER): str(kernels)}
        )
        # objects, and None at the end of the process
        self._messages: SimpleQueue[dict[str, Any] | None] = SimpleQueue()
        self._has_ended = False
        self._errors = tempfile.TemporaryFile("w+", errors="replace")
        self._process = subprocess.Popen(
            python_command("dusttaichi.studies.worker_main", task, also=[task.partition(":")[0]]),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            errors="replace",
            cwd=folder,
            env={**os.environ, **kernel_environment},
            # Ctrl-C in a terminal reaches only the parent, which then stops the workers
            start_new_session=True,
        )
        assert self._process.stdin is not None and self._process.stdout is not None
        self._stdin, self._stdout = self._process.stdin, self._process.stdout
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def call(
        self,
        arguments: dict[str, Any],
        seconds: float | None = None,
        *,
        report: Callable[[float | None], None] = lambda fraction: None,
        receive_answer: Callable[..., None] | None = None,
        stopped: Callable[[], bool] = lambda: False,
    ) -> Answer:
        """The Answer of the task to a request with these arguments.

        A process without an answer in `seconds` is killed. report: called with each completed
        fraction that the task reports; receive_answer: with the keywords of each `answered`.
        stopped: called now and then; where it returns True, the process is stopped.
        """
        reported: dict[str, Any] = {}
        end = inf if seconds is None else time.monotonic() + seconds
        self._write({"request": arguments})
        while not self._has_ended:
            try:
                remaining = max(0.0, end - time.monotonic())
                message = self._messages.get(timeout=min(CHECK_INTERVAL, remaining))
            except Empty:
                if time.monotonic() >= end:
                    self.kill()
                    return Answer(PROCESS_LOST, f"no answer in {seconds:g} s", reported)
            else:
                if message is None:
                    self._has_ended = True
                elif "code" in message:
                    self.fresh = False
                    reported |= message.get("values") or {}
                    code, text = message["code"], message.get("text", "")
                    return Answer(code, text, reported, startable=message.get("startable", True))
                elif "answered" in message["report"]:
                    if receive_answer is not None:
                        receive_answer(**message["report"]["answered"])
                else:
                    reported |= message["report"]
                    report(reported.get("share"))
            if stopped():
                self.stop()
        return Answer(PROCESS_LOST, self._describe_end(), reported)

    @property
    def alive(self) -> bool:
        """True while the process can take a request."""
        return not self._has_ended and self._process.poll() is None

    def _write(self, message: dict[str, Any]) -> None:
        # of a process that has ended; its answer says so
        with suppress(BrokenPipeError, ValueError):
            self._stdin.write(json.dumps(message) + "\n")
            self._stdin.flush()

    def _listen(self) -> None:
        for line in self._stdout:
            with suppress(ValueError):  # other output
                message = json.loads(line)
                if isinstance(message, dict) and {"code", "report"} & set(message):
                    self._messages.put(message)
        self._messages.put(None)

    def _describe_end(self) -> str:
        """Reason of the end of the process, in one line."""
        status = self._wait(CHECKPOINT_TIMEOUT)
        self._errors.seek(0)
        last = self._errors.read().strip().splitlines() or ["no message"]
        return f"the process ended (status {status}): {last[-1]}"

    def stop(self) -> None:
        """End the process: at once if it waits for a request, else as by Ctrl-C."""
        with suppress(BrokenPipeError):
            self._stdin.close()

    def kill(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.wait()

    def close(self, seconds: float = CHECKPOINT_TIMEOUT) -> None:
        """Stop the process, wait for its end, and kill it after `seconds`.

        A process that ends by itself has written its compiled kernels to the cache.
        """
        self.stop()
        self._wait(seconds)
        self._listener.join()
        self._stdout.close()
        self._errors.close()

    def _wait(self, seconds: float) -> int:
        """Exit status of the process, which is killed after `seconds`."""
        try:
            return self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.kill()
            return self._process.returncode

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def idle_workers() -> Iterator[list[Worker]]:
    """Context with the list of idle Workers, which its end stops."""
    idle: list[Worker] = []
    try:
        yield idle
    finally:
        for worker in idle:
            worker.stop()
        for worker in idle:
            worker.close()


@contextmanager
def borrow_worker(
    idle: list[Worker], task: str, stopped: Callable[[], bool], folder: Path | None = None
) -> Iterator[Worker]:
    """Context with a Worker for this task, an idle one if there is one.

    It becomes idle again if its process is well: if it answered, and is not to stop (`stopped()`).
    folder: current directory of a new one.
    """
    suitable = [worker for worker in list(idle) if worker.task == task]
    worker = None
    with suppress(IndexError, ValueError):  # another thread was faster
        idle.remove(suitable[-1])
        worker = suitable[-1]
    worker = worker or Worker(task, folder=folder)
    try:
        yield worker
    finally:
        if worker.alive and not stopped():
            idle.append(worker)
        else:
            worker.close()
