"""How fast this machine has computed before: what `dust check` estimates a run time from.

Every run of `dust run` and every `dust check --time` leaves a line in a small file of the user's
cache: which kind of scene, how many particles and threads, seconds a particle and step.
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

KEPT = 200  # measurements, the newest
ALIKE = 9  # measurements that an estimate looks at, the most
AS_LIKE = 1.0  # about as like: as a size 2.7 times as far, or one part more
OFF = 1.3  # factor that a speed of the same scene may be off by
LEAST_SECONDS = 0.5  # of steps that tell a speed
TRIAL_SECONDS = 1.0
FOLDER = "DUST_CACHE"  # environment variable that names another folder


@dataclass(frozen=True)
class Speed:
    """One measurement. seconds: of one particle and one step. parts: as of a Method."""

    name: str
    method: str
    backend: str
    precision: str
    parts: tuple[str, ...]
    size: int
    threads: int
    seconds: float


def path():
    """The file of the measurements of this machine."""
    folder = os.environ.get(FOLDER) or platformdirs.user_cache_dir("dusttaichi")
    return Path(folder) / "speeds.json"


def known():
    """All measurements, the newest last; none where there is no readable file."""
    try:
        rows = json.loads(path().read_text(encoding="utf-8"))
        return [
            Speed(**{f.name: row[f.name] for f in fields(Speed)} | {"parts": tuple(row["parts"])})
            for row in rows
        ]
    except (OSError, ValueError, TypeError, KeyError):
        return []


def remember(speed):
    """Keep a measurement."""
    write_rows(path(), [*known(), speed])


def write_rows(file, rows):
    """Write the newest of some measurements (dataclasses) into a file. It is a convenience: a disk
    that refuses it is no error."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        beside = file.with_suffix(f".{os.getpid()}")
        beside.write_text(json.dumps([asdict(row) for row in rows[-KEPT:]]), encoding="utf-8")
        files.replace_atomically(beside, file)
    except OSError:
        pass


def speed_of(scene, size, seconds):
    """The Speed of a scene with `size` particles that took so many seconds a particle and step."""
    n = scene.numerics
    kind = (getattr(n, "backend", "cpu"), getattr(n, "precision", "f64"))
    parts = (*method.of(scene).parts(scene), *["debug"] * getattr(n, "debug", False))
    threads = threads_of(scene, size)
    return Speed(scene.name, scene.method, *kind, parts, size, threads, seconds)


def likely(scene, size):
    """(Speed, (least, likely, most) seconds of a step), None where nothing is known.

    The Speed is the one known that is most like the scene: of its method, backend and precision,
    then like in parts, threads and size, and of equal ones the newest. The seconds are the median
    of those that are about as like, so that one run on a busy machine does not decide.
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
    """The same of one Speed of a scene with `size` particles, that has just been measured."""
    seconds = speed.seconds * size
    return speed, (seconds / OFF, seconds, seconds * OFF)


def _distance(one, other):
    """How little two Speeds tell of each other: 0 for the same kind, size and threads."""
    sizes = abs(log(one.size / other.size)) + abs(log(one.threads / other.threads))
    return len(set(one.parts) ^ set(other.parts)) + sizes


def measure(scene, plan):
    """Steps of the scene from its start, for about a second: its Speed, which is kept.

    plan: of its Preview. Compiles what is not in the cache. Raises DustError where the scene ends
    before that tells anything.
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
        raise DustError("--time: the scene ends after one step, which tells nothing of its speed.")
    speed = speed_of(scene, sim.size, took / made / sim.size)
    remember(speed)
    return speed


class Timer:
    """Times the stretches of a run, and keeps its speed at the end. The first stretch does not
    count: it makes the kernels.

    `ready` and the Timer itself are what dusttaichi.run.execute takes as ready and advancing. ends:
    when the first and the last stretch have ended (perf_counter), None before.
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
        """Keep the speed of the run, where it was long enough to tell one."""
        if self.seconds >= LEAST_SECONDS and self.steps:
            each = self.seconds / self.steps / self.sim.size
            remember(speed_of(self.scene, self.sim.size, each))
