"""Measured speeds of this machine, for the estimate of a run time by `dust check`.

Every `dust run` and every `dust check --time` adds a row to a small file in the cache of the user:
kind of scene, numbers of particles and threads, seconds per particle and step.
"""

import json
import os
import time as real_time
from dataclasses import asdict, dataclass, fields
from math import exp, log
from pathlib import Path
from statistics import quantiles

import platformdirs

from dusttaichi import files, method
from dusttaichi.compute.backend import threads_of
from dusttaichi.errors import DustError

STORED = 200  # most measurements in the file, the newest
ALIKE = 9  # most measurements of an estimate
AS_LIKE = 1.0  # largest additional distance: a factor 2.7 in size, or one part
OFF = 1.3  # factor of uncertainty of a speed of the same scene
LEAST_SECONDS = 0.5  # of steps for a speed
TRIAL_SECONDS = 1.0
FOLDER = "DUST_CACHE"  # environment variable that names another folder


@dataclass(frozen=True)
class Speed:
    """One measurement. seconds: per particle and step. parts: of the Method of the scene."""

    name: str
    method: str
    backend: str
    precision: str
    parts: tuple[str, ...]
    size: int
    threads: int
    seconds: float


def path():
    """File of the measurements of this machine."""
    folder = os.environ.get(FOLDER) or platformdirs.user_cache_dir("dusttaichi")
    return Path(folder) / "speeds.json"


def known():
    """All measurements, the newest last; [] without a readable file."""
    return read_rows(path(), Speed)


def remember(speed):
    """Store a measurement."""
    write_rows(path(), [*known(), speed])


def read_rows(file, kind):
    """The rows of a file, of that dataclass; [] without a readable file."""
    try:
        rows = json.loads(file.read_text(encoding="utf-8"))
        values = [[row[f.name] for f in fields(kind)] for row in rows]
        return [kind(*(tuple(v) if isinstance(v, list) else v for v in row)) for row in values]
    except (OSError, ValueError, TypeError, KeyError):
        return []


def write_rows(file, rows):
    """Write the newest of some measurements (dataclasses) into a file; a failure is no error."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        beside = file.with_suffix(f".{os.getpid()}")
        beside.write_text(json.dumps([asdict(row) for row in rows[-STORED:]]), encoding="utf-8")
        files.replace_atomically(beside, file)
    except OSError:
        pass


def speed_of(scene, size, seconds):
    """The Speed of a scene with `size` particles from its seconds per particle and step."""
    n = scene.numerics
    kind = (getattr(n, "backend", "cpu"), getattr(n, "precision", "f64"))
    parts = (*method.of(scene).parts(scene), *["debug"] * getattr(n, "debug", False))
    threads = threads_of(scene, size)
    return Speed(scene.name, scene.method, *kind, parts, size, threads, seconds)


def likely(scene, size):
    """(Speed, (least, likely, most) seconds of a step), None without a measurement.

    The Speed is that of the most similar scene: of the same method, backend and precision, then by
    parts, threads and size, the newest of equal ones. The seconds are the median of those about as
    similar, so that a single run on a busy machine has little weight.
    """
    wanted = speed_of(scene, size, 0.0)
    same = ("method", "backend", "precision")
    fit = [s for s in reversed(known()) if all(getattr(s, a) == getattr(wanted, a) for a in same)]
    if not fit:
        return None
    fit.sort(key=lambda s: _distance(s, wanted))
    least = _distance(fit[0], wanted)
    alike = [s for s in fit[:ALIKE] if _distance(s, wanted) <= least + AS_LIKE]
    low, seconds, high = quantiles([s.seconds * s.threads for s in alike] * 2, n=4)
    factor = OFF * exp(min(0.2 * least, 1.5))
    step = (min(low, seconds / factor), seconds, max(high, seconds * factor))
    return fit[0], tuple(s * size / wanted.threads for s in step)


def as_measured(speed, size):
    """The same as `likely`, from one new Speed of a scene with `size` particles."""
    seconds = speed.seconds * size
    return speed, (seconds / OFF, seconds, seconds * OFF)


def _distance(one, other):
    """Distance of two Speeds: 0 for the same kind, size and threads."""
    sizes = abs(log(one.size / other.size)) + abs(log(one.threads / other.threads))
    return len(set(one.parts) ^ set(other.parts)) + sizes


def measure(scene, plan):
    """The Speed of a scene from its first steps, for about a second; it is stored.

    plan: of its Preview. Compiles kernels that are not in the cache. Raises DustError where the
    scene ends after one step.
    """
    how = method.of(scene)
    sim = how.build(scene, how.make_sample(scene))
    sim.advance(1)
    steps, took, made = 20, 0.0, 0
    while took < TRIAL_SECONDS and sim.step < plan[0][1]:
        steps = min(steps, plan[0][1] - sim.step)
        began, first = real_time.perf_counter(), sim.step
        sim.advance(steps)
        took, made = real_time.perf_counter() - began, sim.step - first
        steps = int(steps * min(10.0, max(2.0, 1.2 * TRIAL_SECONDS / took)))
    if not made:
        raise DustError(
            "--time: the scene ends after one step, too early for a measurement of its speed."
        )
    speed = speed_of(scene, sim.size, took / made / sim.size)
    remember(speed)
    return speed


class Timer:
    """Measures the segments of a run, and stores its speed at the end.

    The first segment does not count: it compiles the kernels. `ready` and the Timer itself are
    arguments `ready` and `advancing` of dusttaichi.run.execute. ends: times of the end of the first
    and the last segment (perf_counter), None before.
    """

    def __init__(self, scene):
        self.scene, self.sim, self.seconds, self.steps = scene, None, 0.0, 0
        self._warm, self.ends = False, None

    def ready(self, sim):
        self.sim = sim

    def __enter__(self):
        self._from = self.sim.step, real_time.perf_counter()

    def __exit__(self, *_):
        first, began = self._from
        now = real_time.perf_counter()
        self.ends = (now if self.ends is None else self.ends[0]), now
        if self._warm:
            self.seconds += now - began
            self.steps += self.sim.step - first
        self._warm = True

    def keep(self):
        """Store the speed of a run of at least LEAST_SECONDS."""
        if self.seconds >= LEAST_SECONDS and self.steps:
            each = self.seconds / self.steps / self.sim.size
            remember(speed_of(self.scene, self.sim.size, each))
