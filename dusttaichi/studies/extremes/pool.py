"""Cells tried in processes of their own, so that a crash or a hang is a verdict like any other."""

import json
import os
import select
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from queue import Empty, Queue

import dusttaichi
from dusttaichi.studies.extremes.cell import Outcome

STARTING = 60.0  # s that a process may take more for its first cell: it imports and compiles


class Child:
    """One such process; a new one takes its place where it ends."""

    def __init__(self):
        self.process = None

    def ask(self, cell):
        """The Outcome of a cell."""
        fresh = self.process is None
        if fresh:
            self._start()
        try:
            self.process.stdin.write(json.dumps(cell.to_dict()) + "\n")
            self.process.stdin.flush()
            allowed = cell.time_limit + STARTING * fresh
            ready = select.select([self.process.stdout], [], [], allowed)[0]
            line = self.process.stdout.readline() if ready else None
        except BrokenPipeError:
            line = ""
        if line is None:
            self.stop()
            return Outcome("WRONG", f"no answer in {allowed:.0f} s: it hangs", seconds=allowed)
        if not line:
            status = self.process.wait()
            self.errors.seek(0)
            said = self.errors.read().strip().splitlines() or ["it said nothing"]
            self.process = None
            return Outcome("WRONG", f"the process crashed (status {status}): {said[-1]}")
        return Outcome(**json.loads(line))

    def _start(self):
        package = str(Path(dusttaichi.__file__).parent.parent)
        paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
        self.errors = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "dusttaichi.studies.extremes.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            start_new_session=True,  # Ctrl-C is for the command, which ends its processes itself
        )

    def stop(self):
        """End the process, whatever it is doing."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None

    def finish(self):
        """Let the process end by itself, which writes its compiled kernels to the cache."""
        if self.process is not None:
            self.process.stdin.close()
            try:
                self.process.wait(timeout=30)
            except subprocess.TimeoutExpired:
                self.stop()
            self.process = None


def attempts(runs, children):
    """(cell, Outcome) as they end. runs: lists of cells that one process takes in their order, as
    cells alike are compiled once; children: processes side by side."""
    waiting, done, stop = Queue(), Queue(), threading.Event()
    for run in runs:
        waiting.put(run)
    pool = [Child() for _ in range(min(children, len(runs)))]

    def work(child):
        while not stop.is_set():
            try:
                run = waiting.get_nowait()
            except Empty:
                break
            for cell in run:
                if stop.is_set():
                    break
                done.put((cell, child.ask(cell)))
        if not stop.is_set():
            child.finish()
        done.put(None)

    threads = [threading.Thread(target=work, args=(child,), daemon=True) for child in pool]
    for thread in threads:
        thread.start()
    try:
        working = len(pool)
        while working:
            found = done.get()
            if found is None:
                working -= 1
            else:
                yield found
    finally:
        stop.set()
        for child in pool:
            process = child.process
            if process is not None:
                process.kill()
