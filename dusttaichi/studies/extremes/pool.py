"""Trials of cells in worker processes, so that a crash or a hang is a verdict, too."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from queue import Empty, SimpleQueue

from dusttaichi.studies.extremes.results import CellResult
from dusttaichi.studies.workers import POLL, Worker

TASK = "dusttaichi.studies.extremes.trial:attempt_cell"
STARTING = 60.0  # additional s for the first cell of a process: imports and compilation


class Place:
    """A worker that tries cells, replaced after a crash or a hang."""

    def __init__(self):
        self.worker = None

    def ask(self, cell):
        """CellResult of a cell."""
        fresh = self.worker is None
        if fresh:
            self.worker = Worker(TASK)
        allowed = cell.time_limit + STARTING * fresh
        answer = self.worker.ask(allowed, cell=asdict(cell))
        if answer.code == 0:
            return CellResult(**answer.found)
        self.kill()
        self.close()
        return CellResult("WRONG", answer.text)

    def kill(self):
        """Kill the worker."""
        worker = self.worker
        if worker is not None:
            worker.kill()

    def close(self):
        """Stop the worker, which writes its compiled kernels to the cache."""
        worker, self.worker = self.worker, None
        if worker is not None:
            worker.close()


def attempts(runs, count):
    """Yield (cell, CellResult) as they end.

    runs: lists of cells with the same kernels, each for one process. count: simultaneous processes.
    """
    count = max(1, min(count, len(runs)))
    places = [Place() for _ in range(count)]
    free, ended, stop = SimpleQueue(), SimpleQueue(), threading.Event()
    for place in places:
        free.put(place)

    def work(run):
        place = free.get()
        for cell in run:
            if stop.is_set():
                break
            ended.put((cell, place.ask(cell)))
        free.put(place)

    with ThreadPoolExecutor(count) as pool:
        try:
            futures = [pool.submit(work, run) for run in runs]
            while not (all(future.done() for future in futures) and ended.empty()):
                try:
                    found = ended.get(timeout=POLL)
                except Empty:
                    continue
                yield found
            for future in futures:
                future.result()  # raises what a thread has met
        finally:
            finished = all(future.done() for future in futures)
            stop.set()
            for place in places:
                place.close() if finished else place.kill()
