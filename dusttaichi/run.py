"""The run: cadence of outputs, stop conditions, guards, checkpoints. Everything in whole steps."""

import signal
import time as real_time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

from dusttaichi import checkpoint, guards, record, samples, units
from dusttaichi.build import build
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.results import Writer, provenance, select
from dusttaichi.samples.sample import Sample
from dusttaichi.schedule import NEVER, Clock, last_step, next_step

BURST_SECONDS = 0.25  # of machine time between two looks at the clock, the guards and Ctrl-C
FLUSH_SHARE = 0.02  # of the machine time that may go into writing
RESULT, CHECKPOINT, SCENE = "result.nc", "checkpoint.bin", "scene.yaml"
# what may differ between a run and its continuation
FREE_TO_CHANGE = (("stop",), ("output", "directory"), ("output", "checkpoint"),
                  ("numerics", "threads"))  # fmt: skip


@dataclass
class Progress:
    """What a run tells its watcher (the progress bar, or nothing)."""

    step: int
    end: int
    filling_factor: float | None
    pressure: float | None  # top wall, Pa
    steps_per_second: float


class Crew:
    """How many workers the steps get: all, or one where another process has the cores.

    The bits do not depend on it, so the run may try the other number now and then and take the
    faster: workers that wait for one which the system does not run lose more than they gain.
    """

    EVERY = 10.0  # seconds between two trials

    def __init__(self, sim, fixed):
        self.sim, self.most = sim, sim.threads
        self.alone = fixed or self.most == 1
        self.tried = real_time.perf_counter()
        self.before = None  # (workers, rate) that a trial is compared with

    def after_burst(self, rate):
        """Tell the steps a second of a full burst; may change sim.threads for the next one."""
        if self.alone:
            return
        now = real_time.perf_counter()
        if self.before is not None:
            workers, known = self.before
            if rate < 1.03 * known:
                self.sim.threads = workers
            self.before, self.tried = None, now
        elif now - self.tried > self.EVERY:
            self.before = (self.sim.threads, rate)
            self.sim.threads = 1 if self.sim.threads > 1 else self.most


@dataclass
class Course:
    """The part of a run's state that is not in the simulation; goes into the checkpoint."""

    start: dict  # measurement at step 0
    window_step: int = 0
    window_impulse: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    mean_force: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    wall_clock: float = 0.0

    def to_meta(self):
        return {
            "start": {k: np.asarray(v).tolist() for k, v in self.start.items()},
            "window_step": self.window_step,
            "window_impulse": self.window_impulse.tolist(),
            "mean_force": self.mean_force.tolist(),
            "wall_clock": self.wall_clock,
        }

    @classmethod
    def from_meta(cls, meta):
        start = {k: np.array(v) if isinstance(v, list) else v for k, v in meta["start"].items()}
        return cls(start, meta["window_step"], np.array(meta["window_impulse"]),
                   np.array(meta["mean_force"]), meta["wall_clock"])  # fmt: skip


def run_directory(scene, output=None):
    """Where the results of a scene go."""
    return Path(output) if output is not None else Path(scene.output.directory)


def execute(scene, directory, *, force=False, resume=False, watch=lambda progress: None,
            say=lambda text: None):  # fmt: skip
    """Run a scene into `directory`; returns the directory.

    Raises DustError (bad input, an existing result, a full disk), GuardStop (with the result up to
    there kept), KeyboardInterrupt (after flushing and a checkpoint).
    """
    directory = Path(directory)
    with checkpoint.RunLock(directory) as lock:
        if not force and not resume and (directory / RESULT).exists():
            raise DustError(
                f"{directory / RESULT} exists already. Use --force to overwrite it, --resume to go "
                "on with it, or choose another output directory."
            )
        run = _Run(scene, directory, lock, watch)
        run.open_resumed(say) if resume else run.open_new(force)
        run.go()
    return directory


class _Run:
    """One run in progress."""

    def __init__(self, scene, directory, lock, watch):
        self.scene, self.directory, self.lock, self.watch = scene, directory, lock, watch
        self.rate, self.flush_cost, self.interrupted = 0.0, 0.0, False
        self.pressure = None

    # -- opening ---------------------------------------------------------------------------------

    def _build(self, sample):
        self.sample = sample
        self.sim = build(self.scene, sample)
        self.clock = clock_of(self.sim)
        self.features = features_of(self.scene, self.sim)
        self.end, self.reason = last_step(self.scene.stop, self.clock, 4.0 * self.sim.radius)
        self.crew = Crew(self.sim, fixed=self.scene.numerics.threads != "auto")

    def open_new(self, force):
        sample = samples.make(self.scene)
        self._build(sample)
        self.course = Course(self.sim.measure())
        checkpoint.discard(self.directory / CHECKPOINT)
        _write_text(self.directory / SCENE, self.scene.to_yaml())
        self.edges = record.bin_edges(self.clock, self.sim.radius) if self.clock.area else None
        self.writer = Writer.create(
            self.directory / RESULT, select(self.features), self._sizes(), self._coords(),
            self._attributes(), force=force, lock=self.lock,
        )  # fmt: skip
        self._record_due(first=True)

    def open_resumed(self, say):
        saved = checkpoint.load(self.directory / CHECKPOINT)
        if saved.note:
            say(saved.note)
        _same_scene(saved.meta["scene"], self.scene)
        arrays = saved.arrays
        self._build(Sample(*(arrays.pop(f"sample_{k}") for k in _SAMPLE)))
        self.sim.restore(arrays, saved.meta["numbers"])
        self.course = Course.from_meta(saved.meta["course"])
        self.edges = record.bin_edges(self.clock, self.sim.radius) if self.clock.area else None
        self.writer = Writer.resume(self.directory / RESULT, saved.meta["counts"], lock=self.lock)
        say(f"going on from step {self.sim.step:,} ({self.sim.time:.6g} us)")

    def _sizes(self):
        sizes = {"grain": self.sim.grains}
        if self.edges is not None:
            sizes["bin"] = len(self.edges) - 1
        return sizes

    def _coords(self):
        coords = {"snapshots/radius": np.full(self.sim.grains, self.scene.material.radius)}
        if self.edges is not None:
            edges = self.edges * units.LENGTH
            coords |= {
                "profiles/bin_lower": edges[:-1],
                "profiles/bin_upper": edges[1:],
                "profiles/bin_height": 0.5 * (edges[1:] + edges[:-1]),
            }
        return coords

    def _attributes(self):
        scene, sim = self.scene, self.sim
        return provenance(
            scene.source or "",
            scene.to_yaml(),
            title=scene.name,
            seed=getattr(scene.sample, "seed", None),
            backend=scene.numerics.backend,
            precision=scene.numerics.precision,
            threads=sim.threads,
            time_step=sim.dt * units.TIME,
            sample=yaml.safe_dump(_plain(self.sample.info), sort_keys=False),
        )

    # -- going -----------------------------------------------------------------------------------

    def go(self):
        """Run to the end; whatever ends it, what was computed is on disk."""
        handlers = {s: signal.signal(s, self._interrupt) for s in _signals()}
        self.began = real_time.perf_counter() - self.course.wall_clock
        self.saved = self.flushed = real_time.perf_counter()
        try:
            self._loop()
            self.finish(f"finished: {self.reason}")
        except GuardStop as stop:
            self.writer.set_status(f"stopped by guard: {stop}")
            self.writer.flush()
            raise
        finally:
            for s, handler in handlers.items():
                signal.signal(s, handler)

    def _interrupt(self, *_):
        self.interrupted = True

    def _loop(self):
        sim, output = self.sim, self.scene.output
        while sim.step < self.end:
            series = min(next_step(output.series, self.clock, sim.step), self.end)
            window = NEVER
            if output.window != "interval" and series - output.window > sim.step:
                window = series - output.window
            due = min(series, window, next_step(output.profiles, self.clock, sim.step),
                      next_step(output.snapshots, self.clock, sim.step))  # fmt: skip
            self._advance_to(due)
            if sim.step == window:
                self.course.window_step, self.course.window_impulse = window, sim.impulses()
            self._record_due()
            self._keep()

    def _advance_to(self, due):
        while self.sim.step < due:
            if self.interrupted:
                self._stop_early()
            burst = max(20, int(self.rate * BURST_SECONDS))
            began, first = real_time.perf_counter(), self.sim.step
            self.sim.advance(min(due - first, burst))
            took = real_time.perf_counter() - began
            if self.sim.step - first == burst or self.rate == 0.0:
                self.rate = (self.sim.step - first) / took
                self.crew.after_burst(self.rate)
            self._look_around()
            if self.sim.step < due:
                self._keep()

    def _look_around(self):
        now = real_time.perf_counter()
        self.course.wall_clock = now - self.began
        if now - self.looked > BURST_SECONDS:
            self.looked = now
            guards.check(self.sim, self.sim.measure(), self.course.start)
            phi = self.clock.filling_factor_at(self.sim.step) if "volume" in self.features else None
            self.watch(Progress(self.sim.step, self.end, phi, self.pressure, self.rate))

    def _keep(self):
        """Flush or checkpoint if it is time. Never at a step whose records are still due: a run
        that goes on from there would lack them."""
        now = real_time.perf_counter()
        if now - self.saved > self.scene.output.checkpoint:
            self.save()
        elif now - self.flushed > max(5.0, self.flush_cost / FLUSH_SHARE):
            self.flush()

    looked = 0.0

    def _stop_early(self):
        self.writer.set_status("interrupted")
        self.save()
        raise KeyboardInterrupt

    # -- recording -------------------------------------------------------------------------------

    def _record_due(self, first=False):
        """Write what is due at this step. `first`: the state at step 0, before any motion."""
        sim, output = self.sim, self.scene.output

        def due(interval):
            return first or (
                interval is not None and next_step(interval, self.clock, sim.step - 1) == sim.step
            )

        if due(output.series) or sim.step == self.end:
            self._record_series(first)
        if "profiles" in self.features and due(output.profiles):
            self.writer.append("profiles", record.profile(sim, self.clock, self.edges))
        if due(output.snapshots):
            self._record_snapshot()

    def _record_series(self, first):
        sim, course = self.sim, self.course
        if sim.box is not None and not first:
            impulse = sim.impulses()
            span = (sim.step - course.window_step) * sim.dt
            course.mean_force = (impulse - course.window_impulse) / span
            course.window_step, course.window_impulse = sim.step, impulse
        elif sim.box is not None:
            course.mean_force = sim.first_wall_force
        m = sim.measure()
        guards.check(sim, m, course.start)
        entry = record.series(sim, self.clock, m, course.start, course.mean_force,
                              course.wall_clock)  # fmt: skip
        keys = [k for k in select(self.features) if "/" not in k]
        self.writer.append("series", {k: entry[k] for k in keys})
        if sim.box is not None and sim.box.present[5]:
            self.pressure = float(entry["pressure"][5])
            if self.scene.stop.pressure is not None and self.pressure >= self.scene.stop.pressure:
                self.end = sim.step
                self.reason = f"pressure {self.scene.stop.pressure / 1e3:.6g} kPa"

    def _record_snapshot(self):
        for group, entry in record.snapshot(self.sim, self.scene.output.contacts):
            self.writer.append(group, entry)
        self.last_snapshot = self.sim.step

    last_snapshot = -1

    # -- keeping ---------------------------------------------------------------------------------

    def flush(self):
        self.flush_cost = self.writer.flush()
        self.flushed = real_time.perf_counter()

    def save(self):
        """Result first, then the checkpoint, which so never knows more than the result."""
        self.flush()
        sample = {f"sample_{k}": getattr(self.sample, k) for k in _SAMPLE}
        meta = {
            "scene": self.scene.to_yaml(),
            "numbers": self.sim.numbers(),
            "course": self.course.to_meta(),
            "counts": self.writer.counts(),
        }
        checkpoint.save(self.directory / CHECKPOINT, self.sim.arrays() | sample, meta)
        self.saved = real_time.perf_counter()

    def finish(self, status):
        """Last frame, status, checkpoint. The checkpoint comes before the last frame that is only
        there because the run ends: a continuation with a later stop is free of it."""
        counts_are_exact = self.last_snapshot != self.sim.step
        self.save()
        if counts_are_exact:
            self._record_snapshot()
        self.writer.set_status(status)
        self.flush()


_SAMPLE = ("positions", "velocities", "spins")


def _signals():
    return (signal.SIGINT, signal.SIGTERM)


def clock_of(sim):
    """The Clock of a simulation: its step, and its box if it has a floor and a lid."""
    if sim.box is None or not (sim.box.present[4] and sim.box.present[5]):
        return Clock(sim.dt)
    volume = sim.grains * 4.0 / 3.0 * np.pi * sim.radius**3
    size = sim.box.size
    return Clock(sim.dt, volume, float(size[0] * size[1]), float(size[2]), float(sim.box.speed[5]))


def features_of(scene, sim):
    """What the result of a scene has, in the words of `results.select`."""
    features = {"snapshots"}
    if scene.output.contacts:
        features.add("contacts")
    if sim.box is not None:
        features.add("walls")
        if sim.box.present[4] and sim.box.present[5]:
            features.add("height")
            if sim.box.present.all():
                features.add("volume")
                if scene.output.profiles is not None:
                    features.add("profiles")
    return features


def _same_scene(saved, scene):
    """Refuse to go on with another scene than the one the checkpoint is of."""
    old, new = yaml.safe_load(saved), yaml.safe_load(scene.to_yaml())
    for path in FREE_TO_CHANGE:
        for tree in (old, new):
            for key in path[:-1]:
                tree = tree.get(key, {})
            tree.pop(path[-1], None)
    changed = sorted(_differences(old, new))
    if changed:
        raise DustError(
            "--resume: the scene is not the one that this run was started with; it differs in "
            f"{', '.join(changed)}. Put that back, or start anew with --force. (stop, "
            "numerics.threads, output.checkpoint may change.)"
        )


def _differences(old, new, path=""):
    if isinstance(old, dict) and isinstance(new, dict):
        for key in old.keys() | new.keys():
            yield from _differences(old.get(key), new.get(key), f"{path}.{key}".lstrip("."))
    elif old != new:
        yield path


def _plain(value):
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value


def _write_text(path, text):
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DustError(f"Cannot write {path}: {checkpoint.explain(error, path)}.") from error
