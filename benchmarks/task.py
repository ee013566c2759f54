"""Task of a worker process for the benchmark: builds one configuration and times it.

Taichi starts once per process, with a fixed number of threads, and shares its memory.
"""

import math
import os
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import instructions
from benchmarks.sample import Recipe, load, make
from dusttaichi import samples, units
from dusttaichi.scene import from_yaml

LEDGER_EVERY = 1000  # steps between measurements of a run


class Stopwatch:
    """Wall time spent within it [s], including that of a GPU. A context manager."""

    def __init__(self):
        self.seconds, self._began = 0.0, 0.0

    def __enter__(self):
        self._began = time.perf_counter()

    def __exit__(self, *_):
        from dusttaichi.compute.engine import ti

        ti.sync()
        self.seconds += time.perf_counter() - self._began


def _wall_speed(sim):
    """Speed of the fastest wall [um/us], 0 without walls."""
    return 0.0 if sim.domain.box is None else float(np.max(np.abs(sim.domain.box.speed)))


class Benchmark:
    """Answers requests, by a method each, for one simulation."""

    def prepare(self, grains, filling_factor):
        """Make and store a sample."""
        make(Recipe(grains, filling_factor))
        return {}

    def build(self, scene, path=None, polydisperse=False, ledger=True):
        """Build a scene (YAML) and compute its first step; sample: that of `path`, or its own.

        polydisperse: with individual radii of the grains, although equal; ledger: whether to
        compute it. Answers the lengths of the sides [m].
        """
        from dusttaichi.grains.build import build

        scene = from_yaml(scene)
        sample = samples.make(scene) if path is None else load(Path(path))
        if polydisperse:
            sample = replace(sample, radii=np.full(len(sample), scene.material.radius))
        self.sim = build(scene, sample, ledger=ledger)
        self.sim.stepper.advance(1)
        self.searching = self.sim.search.stopwatch = Stopwatch()
        return {"box": (self.sim.environment.lengths() * units.LENGTH).tolist()}

    def time(self, steps):
        """Seconds per step, and those of search and ledger at their rates in a run.

        One search is forced, so that its cost is known for any number of steps; its rate is that at
        which the fastest grain or wall moves half the skin.
        """
        sim = self.sim
        sim.search.ask()
        searches, self.searching.seconds = sim.search.count, 0.0
        begin = time.perf_counter()
        sim.advance(steps)
        middle = time.perf_counter()
        measured = sim.ledger.measure_energies()
        ledger = time.perf_counter() - middle
        fastest = max(measured["largest_speed"], _wall_speed(sim))
        search_every = 0.5 * sim.search.skin / (fastest * sim.dt) if fastest > 0.0 else math.inf
        search = self.searching.seconds / (sim.search.count - searches) / max(1.0, search_every)
        ledger /= LEDGER_EVERY
        steps_alone = (middle - begin - self.searching.seconds) / steps
        measured = {"contacts": measured["contacts"], "search": search, "ledger": ledger}
        return measured | {"seconds": steps_alone + search + ledger}

    def memory(self):
        """Largest resident memory of this process, and memory of the fields of the scene [B]."""
        tables = [
            *self.sim.fields.values(),
            *self.sim.scratch.values(),
            *self.sim.kernel_sums.tables.values(),
        ]
        return {
            "peak": peak_memory(),
            "fields": sum(array.nbytes for array in (table.to_numpy() for table in tables)),
        }

    def count(self, scene, path, steps):
        """Build a scene; its listed pairs, and instructions of a step.

        These are None where the system does not count them.
        """
        counter = instructions.Counter()  # before the threads that it counts
        self.build(scene, path)
        self.sim.stepper.advance(steps)
        instructions_before = counter.read()
        self.sim.stepper.advance(steps)
        instructions_per_step = (
            None if instructions_before is None else (counter.read() - instructions_before) / steps
        )
        about = {"process": os.getpid(), "pairs": self.sim.grain_state.pair_count}
        return about | {"instructions": instructions_per_step}

    def mark_steps(self):
        """Mark a call with one step, and one with two, for an instructions.Stepper."""
        for steps in (1, 2):
            instructions.mark()
            self.sim.stepper.advance(steps)
            instructions.mark()
        return {}


def peak_memory():
    """Largest resident memory of this process [B]."""
    try:
        # ru_maxrss includes the size of the parent process at the start
        status = Path("/proc/self/status").read_text()
        return 1024 * int(status.split("VmHWM:")[1].split()[0])
    except (OSError, IndexError):
        unit = 1 if sys.platform == "darwin" else 1024
        return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


_benchmark = Benchmark()


def answer(parent, *, do, **arguments):
    """Answer of the worker. do: name of a method of Benchmark."""
    return getattr(_benchmark, do)(**arguments)
