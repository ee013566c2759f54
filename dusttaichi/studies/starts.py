"""How long runs have taken beside their steps: start, compiling, output, figures.

Every run of `dust run` leaves a line in a small file of the user's cache, beside that of the speeds
(speeds.py), and `dust check` estimates from it what a further run takes.
"""

import json
import time as real_time
from dataclasses import dataclass, fields
from math import log
from statistics import median

from dusttaichi import __version__
from dusttaichi.compute import processor
from dusttaichi.compute.memory import capacity_for
from dusttaichi.studies import speeds

ALIKE = 5  # runs that an estimate looks at, the most


@dataclass(frozen=True)
class Start:
    """One run. kernels: all that decides whether compiled kernels serve again, as far as it is
    known before anything is built. cached: they were there. seconds: beside those of the steps."""

    method: str
    kernels: str
    size: int
    cached: bool
    seconds: float


def path():
    """The file of the runs of this machine."""
    return speeds.path().with_name("starts.json")


def known():
    """All runs, the newest last; none where there is no readable file."""
    try:
        rows = json.loads(path().read_text(encoding="utf-8"))
        return [Start(**{f.name: row[f.name] for f in fields(Start)}) for row in rows]
    except (OSError, ValueError, TypeError, KeyError):
        return []


def kernels_of(scene, size):
    """One text for the kernels of a scene with `size` particles, on this processor."""
    kind = speeds.speed_of(scene, size, 0.0)
    own = (kind.backend, kind.precision, *kind.parts, capacity_for(size))
    return " ".join(map(str, (__version__, processor.kernel_key(), scene.method, *own)))


def are_cached(scene, size):
    """Whether kernels of such a scene have been compiled here before, and are still there."""
    if not any(processor.kernel_folder().glob("*.tcb")):
        return False
    kernels = kernels_of(scene, size)
    return any(start.kernels == kernels for start in known())


def likely(scene, size):
    """(whether kernels are cached, seconds beside the steps); the seconds are None where no run
    of the method has begun so here."""
    cached = are_cached(scene, size)
    fit = [s for s in reversed(known()) if s.method == scene.method and s.cached == cached]
    kernels = kernels_of(scene, size)
    fit.sort(key=lambda s: (s.kernels != kernels, abs(log(s.size / size))))
    same = [s for s in fit if s.kernels == kernels] or fit
    return cached, median(s.seconds for s in same[:ALIKE]) if same else None


class Clock:
    """Times a run before the end of its first stretch of steps, and after that of its last.

    timer: the speeds.Timer of its stretches. cached: whether kernels were there, once it is built.
    """

    def __init__(self, scene, timer):
        # what has been imported before is part of the wait, and little else than computing
        self._began = real_time.perf_counter() - real_time.process_time()
        self.scene, self.timer, self._size, self.cached = scene, timer, None, None

    def ready(self, sim):
        """The scene is built."""
        self.timer.ready(sim)
        # this process writes its own kernels to the disk when it ends
        self._size, self.cached = sim.size, are_cached(self.scene, sim.size)

    def keep(self):
        """Keep the time up to now, where any step was made."""
        if self.timer.ends is None:
            return
        first, last = self.timer.ends
        seconds = first - self._began + real_time.perf_counter() - last
        kernels = kernels_of(self.scene, self._size)
        start = Start(self.scene.method, kernels, self._size, self.cached, seconds)
        speeds.write_rows(path(), [*known(), start])
