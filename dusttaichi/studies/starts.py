"""Measured times of runs besides their steps: start, compilation, output, figures.

Every `dust run` adds a row to a small file in the cache of the user, beside that of the speeds
(speeds.py), from which `dust check` estimates the time of a further run.
"""

import time as real_time
from dataclasses import dataclass
from math import log
from statistics import median

from dusttaichi import __version__
from dusttaichi.compute import processor
from dusttaichi.compute.memory import capacity_for
from dusttaichi.studies import speeds

ALIKE = 5  # most runs of an estimate


@dataclass(frozen=True)
class Start:
    """One run.

    kernels: everything that the compiled kernels depend on, as far as it is known before the scene
    is built. cached: they were in the cache. seconds: besides the steps.
    """

    method: str
    kernels: str
    size: int
    cached: bool
    seconds: float


def path():
    """File of the runs of this machine."""
    return speeds.path().with_name("starts.json")


def known():
    """All runs, the newest last; [] without a readable file."""
    return speeds.read_rows(path(), Start)


def kernels_of(scene, size):
    """Text that identifies the kernels of a scene with `size` particles, on this processor."""
    kind = speeds.speed_of(scene, size, 0.0)
    own = (kind.backend, kind.precision, *kind.parts, capacity_for(size))
    return " ".join(map(str, (__version__, processor.kernel_key(), scene.method, *own)))


def are_cached(scene, size):
    """True if kernels of such a scene are in the cache of this machine."""
    if not any(processor.kernel_folder().glob("*.tcb")):
        return False
    kernels = kernels_of(scene, size)
    return any(start.kernels == kernels for start in known())


def likely(scene, size):
    """(whether kernels are cached, seconds besides the steps); seconds: None without such a run."""
    cached = are_cached(scene, size)
    fit = [s for s in reversed(known()) if s.method == scene.method and s.cached == cached]
    kernels = kernels_of(scene, size)
    fit.sort(key=lambda s: (s.kernels != kernels, abs(log(s.size / size))))
    same = [s for s in fit if s.kernels == kernels] or fit
    return cached, median(s.seconds for s in same[:ALIKE]) if same else None


class Clock:
    """Measures a run until the end of its first segment of steps, and from that of its last.

    timer: the speeds.Timer of its segments. cached: whether kernels were in the cache, once it is
    built.
    """

    def __init__(self, scene, timer):
        # imports before are a part of it, and their processor time is about their duration
        self._began = real_time.perf_counter() - real_time.process_time()
        self.scene, self.timer, self._size, self.cached = scene, timer, None, None

    def ready(self, sim):
        """Note the size of a simulation, once it is built."""
        self.timer.ready(sim)
        # this process writes its own kernels to the cache at its end
        self._size, self.cached = sim.size, are_cached(self.scene, sim.size)

    def keep(self):
        """Store the time up to now, if a step was computed."""
        if self.timer.ends is None:
            return
        first, last = self.timer.ends
        seconds = first - self._began + real_time.perf_counter() - last
        kernels = kernels_of(self.scene, self._size)
        start = Start(self.scene.method, kernels, self._size, self.cached, seconds)
        speeds.write_rows(path(), [*known(), start])
