"""Worker processes: one protocol for all studies that compute in several processes.

A worker is a Python process that imports Taichi and handles its own memory and signals. `Worker`
starts it and communicates with it; `child.py` is its main module. Both sides write one JSON object
per line: requests go to the standard input of the process, reports and answers come from its
standard output, and the message after a crash is from its standard error.

    parent                              child
    {"request": {...}}             ->   the task begins
                                   <-   {"report": {"share": 0.4}}      any number of times
                                   <-   {"code": 0, "text": "", "found": {...}}
    end of the input               ->   a running task is interrupted as by Ctrl-C and writes its
                                        checkpoint; then the process ends

The input also ends with the parent, even after a kill. Threads (`concurrent.futures`) wait for the
workers; pools of processes, of `concurrent.futures` or of pebble, are not used, because their
processes cannot report progress or write a checkpoint before their end.
"""

import json
import os
import subprocess
import tempfile
import threading
import time
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from math import inf
from queue import Empty, SimpleQueue

from dusttaichi.compute import compiler
from dusttaichi.compute.processes import python_command

LOST = 1  # code of a process that died, or did not answer in time
INTERRUPTED = 130  # code of a task that was stopped
LOOK = 0.5  # s between two checks of a thread whether to stop
PATIENCE = 120.0  # s for a stopped process to write its checkpoint, before it is killed
STARTING = 60.0  # s more for the first request of a process: imports and compilation


@dataclass(frozen=True)
class Answer:
    """Result of a request.

    code: 0, the exit code of a DustError (2: refused, 3: stopped by a guard), INTERRUPTED, or LOST.
    text: message of the error, or "". found: everything that the task has reported and returned.
    files: name -> content of those in the folder of a run on a cluster (jobs.Job). startable: False
    where the backend cannot start, which no other request would change.
    """

    code: int = 0
    text: str = ""
    found: dict = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    startable: bool = True


class Worker(AbstractContextManager):
    """A process for one kind of task, one request after the other.

    task: "module:function"; the process calls function(parent, **request), where `parent` is a
    `child.Parent`, which returns a dict or None. folder: current directory. kernels: folder of the
    compiled kernels, by default the common one. A context manager: at its end the process is
    stopped.

    fresh: True until it has answered for the first time.
    """

    def __init__(self, task, *, folder=None, kernels=None):
        self.task, self.fresh = task, True
        kernel_environment = (
            {} if kernels is None else {compiler.variable(compiler.KERNEL_FOLDER): str(kernels)}
        )
        self._messages = SimpleQueue()  # objects, and None at the end of the process
        self._ended = False
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
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def ask(
        self,
        request,
        seconds=None,
        *,
        report=lambda share: None,
        answered=None,
        stopped=lambda: False,
    ):
        """The Answer to a request, the arguments of the task.

        A process without an answer in `seconds` is killed. report: called with each share that the
        task reports; answered: with the keywords of each `answered`. stopped: called now and then;
        where it returns True, the process is stopped.
        """
        reported, end = {}, inf if seconds is None else time.monotonic() + seconds
        self._write({"request": request})
        while not self._ended:
            try:
                message = self._messages.get(timeout=max(0.0, min(LOOK, end - time.monotonic())))
            except Empty:
                if time.monotonic() >= end:
                    self.kill()
                    return Answer(LOST, f"no answer in {seconds:g} s", reported)
            else:
                if message is None:
                    self._ended = True
                elif "code" in message:
                    self.fresh = False
                    reported |= message.get("found") or {}
                    startable = message.get("startable", True)
                    return Answer(
                        message["code"], message.get("text", ""), reported, startable=startable
                    )
                elif "answered" in message["report"]:
                    answered(**message["report"]["answered"])
                else:
                    reported |= message["report"]
                    report(reported.get("share"))
            if stopped():
                self.stop()
        return Answer(LOST, self._last_words(), reported)

    @property
    def alive(self):
        """True while the process can take a request."""
        return not self._ended and self._process.poll() is None

    def _write(self, message):
        # of a process that has ended; its answer says so
        with suppress(BrokenPipeError, ValueError):
            self._process.stdin.write(json.dumps(message) + "\n")
            self._process.stdin.flush()

    def _listen(self):
        for line in self._process.stdout:
            with suppress(ValueError):  # other output
                message = json.loads(line)
                if isinstance(message, dict) and {"code", "report"} & set(message):
                    self._messages.put(message)
        self._messages.put(None)

    def _last_words(self):
        """Reason of the end of the process, in one line."""
        status = self._wait(PATIENCE)
        self._errors.seek(0)
        last = self._errors.read().strip().splitlines() or ["no message"]
        return f"the process ended (status {status}): {last[-1]}"

    def stop(self):
        """End the process: at once if it waits for a request, else as by Ctrl-C."""
        with suppress(BrokenPipeError):
            self._process.stdin.close()

    def kill(self):
        """Kill the process."""
        self._process.kill()
        self._process.wait()

    def close(self, seconds=PATIENCE):
        """Stop the process, wait for its end, and kill it after `seconds`.

        A process that ends by itself has written its compiled kernels to the cache.
        """
        self.stop()
        self._wait(seconds)
        self._listener.join()
        self._process.stdout.close()
        self._errors.close()

    def _wait(self, seconds):
        """Exit status of the process, which is killed after `seconds`."""
        try:
            return self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.kill()
            return self._process.returncode

    def __exit__(self, *_):
        self.close()


@contextmanager
def idle_workers():
    """Context with the list of idle Workers, which its end stops."""
    idle = []
    try:
        yield idle
    finally:
        for worker in idle:
            worker.stop()
        for worker in idle:
            worker.close()


@contextmanager
def taken(idle, task, stopped, folder=None):
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
