"""The run: cadence of outputs, stop conditions, guards, checkpoints. Everything in whole steps."""

import signal
import time as real_time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from dusttaichi import files, samples, units
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.files import CHECKPOINT, RESULT
from dusttaichi.grains import record
from dusttaichi.grains import trust as guards
from dusttaichi.grains.build import build
from dusttaichi.names import NEVER, WALLS
from dusttaichi.results import Writer, provenance, select
from dusttaichi.run import checkpoint, stages
from dusttaichi.run.course import Course, Crew
from dusttaichi.run.error_bar import ErrorBar, States
from dusttaichi.run.schedule import clock_of, last_step, next_step
from dusttaichi.samples.sample import Sample
from dusttaichi.scene.material import DEFAULT

BURST_SECONDS = 0.25  # of machine time between two looks at the clock, the guards and Ctrl-C
FLUSH_SHARE = 0.02  # of the machine time that may go into writing
SCENE = "scene.yaml"
TOP = WALLS.index("top")
# what may differ between a run and its continuation
FREE_TO_CHANGE = (
    ("stop",),
    ("output", "directory"),
    ("output", "checkpoint"),
    ("replicas",),
    ("numerics", "threads"),
    ("numerics", "ledger_tolerance"),
)


@dataclass
class Progress:
    """What a run tells its watcher (the progress bar, or nothing)."""

    step: int
    end: int
    filling_factor: float | None
    pressure: float | None  # top wall, Pa
    steps_per_second: float
    task: str = ""  # what goes on, where it is not the run itself


def run_directory(scene, output=None):
    """Where the results of a scene go."""
    return Path(output) if output is not None else Path(scene.output.directory)


def execute(
    scene,
    directory,
    *,
    force=False,
    resume=False,
    fresh=False,
    error_bar=False,
    watch=lambda progress: None,
    say=lambda text: None,
    ready=lambda simulation: None,
):
    """Run a scene into `directory`; returns the directory.

    fresh: compute every stage, even those that an earlier run has finished and kept. error_bar:
    estimate the error of the time step at the end (error_bar.py). ready: called with the
    Simulation, everything compiled, before its first step.
    Raises DustError (bad input, an existing result, a full disk), GuardStop (with the result up to
    there kept), KeyboardInterrupt (after flushing and a checkpoint).
    """
    directory = Path(directory)
    with files.RunLock(directory) as lock:
        if not force and not resume and (directory / RESULT).exists():
            raise DustError(
                f"{directory / RESULT} exists already. Use --force to overwrite it, --resume to go "
                "on with it, or choose another output directory."
            )
        run = _Run(scene, directory, lock, watch, say, error_bar)
        if resume:
            run.open_resumed()
        elif fresh or not run.open_kept():
            run.open_new(force)
        ready(run.sim)
        run.go()
    return directory


class _Run:
    """One run in progress."""

    def __init__(self, scene, directory, lock, watch, say, error_bar=False):
        self.scene, self.directory, self.lock = scene, directory, lock
        self.watch, self.say = watch, say
        self.rate, self.flush_cost, self.interrupted = 0.0, 0.0, False
        self.pressure = None
        self.states, self.error_bar = States(directory), error_bar

    # -- opening ---------------------------------------------------------------------------------

    def _build(self, sample):
        self.sample = sample
        self.sim = build(self.scene, sample)
        self.plates = record.plates_of(self.scene.boundary, sample, self.sim.radius)
        self.features = features_of(self.scene, self.sim)
        self.crew = Crew(self.sim, fixed=self.scene.numerics.threads != "auto")
        clock = clock_of(self.sim)
        self.edges = (
            record.bin_edges(clock, self.sim.radius) if "profiles" in self.features else None
        )

    def _plan(self):
        """The present stage: its clock, and when it ends at the latest."""
        self.plan = self.scene.stage_plans[self.course.stage]
        self.clock = clock_of(self.sim, self.course.first)
        self.end, self.reason = last_step(self.plan.stop, self.clock)
        if self.course.ended:
            self.end, self.reason = self.sim.step, self.course.ended

    def open_new(self, force):
        self._build(samples.make(self.scene))
        self.course = Course(self.sim.measure())
        self.course.open_window(self.sim)
        self._plan()
        checkpoint.discard(self.directory / CHECKPOINT)
        _write_text(self.directory / SCENE, self.scene.to_yaml())
        self.writer = Writer.create(
            self.directory / RESULT,
            select(self.features),
            self._sizes(),
            self._coords(),
            self._attributes(),
            force=force,
            lock=self.lock,
        )
        self._record_due(first=True)
        self.states.begin(-1)
        self._keep_state()

    def open_kept(self):
        """Go on from the latest stage that an earlier run has finished; False where there is
        none."""
        if not self.scene.stages:
            return False
        found = stages.take(self.scene, self.directory)
        if found is None:
            return False
        stage, folder = found
        names = ", ".join(s.name for s in self.scene.stages[: stage + 1])
        self.say(f"finished before and taken over from {folder}: {names} (--fresh computes anew)")
        _write_text(self.directory / SCENE, self.scene.to_yaml())
        self._open_saved(checkpoint.load(self.directory / CHECKPOINT))
        self.writer.set_attributes(self._attributes())
        return True

    def open_resumed(self):
        saved = checkpoint.load(self.directory / CHECKPOINT)
        if saved.note:
            self.say(saved.note)
        stage = saved.meta["course"]["stage"]
        _same_scene(saved.meta["scene"], self.scene, stage)
        old = yaml.safe_load(saved.meta["scene"])
        new = yaml.safe_load(self.scene.to_yaml())
        ends = [d["stages"][stage]["stop"] if d.get("stages") else d["stop"] for d in (old, new)]
        if ends[0] != ends[1]:
            saved.meta["course"]["ended"] = ""
        self._open_saved(saved)
        self.say(f"going on from step {self.sim.step:,} ({self.sim.time:.6g} us)")

    def _open_saved(self, saved):
        arrays, meta = saved.arrays, saved.meta
        own = {k: arrays.pop(f"sample_{k}", None) for k in _UNLIKE}
        sample = Sample(
            *(arrays.pop(f"sample_{k}") for k in _SAMPLE), info=meta["sample_info"], **own
        )
        self._build(sample)
        self.sim.restore(arrays, meta["numbers"])
        self.states.begin(self.sim.step)
        self.course = Course.from_meta(meta["course"])
        self._plan()
        self.writer = Writer.resume(self.directory / RESULT, meta["counts"], lock=self.lock)

    def _sizes(self):
        sizes = {"grain": self.sim.grains, "channel": len(self.sim.layout.channels)}
        if self.edges is not None:
            sizes["bin"] = len(self.edges) - 1
        return sizes

    def _coords(self):
        coords = {"snapshots/radius": np.full(self.sim.grains, self.scene.material.radius)}
        if self.sim.bodies is not None:
            bodies = self.sim.bodies
            coords = {
                "snapshots/radius": bodies.radius * units.LENGTH,
                "snapshots/mass": bodies.mass * units.MASS,
                "snapshots/material": bodies.material,
            }
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
            stages=" ".join(stage.name for stage in scene.stages) or None,
            periodic_axes=" ".join(scene.boundary.periodic_axes),
            materials=" ".join([DEFAULT, *scene.materials]) if sim.bodies is not None else None,
            sample=yaml.safe_dump(_plain(self.sample.info), sort_keys=False),
        )

    # -- going -----------------------------------------------------------------------------------

    def go(self):
        """Run to the end; whatever ends it, what was computed is on disk."""
        handlers = {s: signal.signal(s, self._interrupt) for s in _signals()}
        self.opened_at = self.sim.step
        self.began = real_time.perf_counter() - self.course.wall_clock
        self.saved = self.flushed = real_time.perf_counter()
        try:
            self._loop()
            while self.course.stage + 1 < len(self.scene.stage_plans):
                self._keep_stage()
                self._next_stage()
                self._loop()
            self.finish(f"finished: {self.reason}")
            if self.error_bar:
                self._estimate()
        except GuardStop as stop:
            self.writer.set_status(f"stopped by guard: {stop}")
            self.writer.flush()
            self.states.discard()
            raise
        finally:
            for s, handler in handlers.items():
                signal.signal(s, handler)

    def _interrupt(self, *_):
        self.interrupted = True

    def _loop(self):
        """The present stage, to its end."""
        sim, plan, output = self.sim, self.plan, self.scene.output
        while sim.step < self.end:
            series = min(next_step(plan.series, self.clock, sim.step), self.end)
            window = NEVER
            if output.window != "interval" and series - output.window > sim.step:
                window = series - output.window
            due = min(
                series,
                window,
                next_step(plan.profiles, self.clock, sim.step),
                next_step(plan.snapshots, self.clock, sim.step),
            )
            if self.error_bar:
                due = min(due, self.states.next(sim.step))
            self._advance_to(due)
            if sim.step == window:
                self.course.open_window(sim)
            self._record_due()
            self._keep_state()
            self._keep()

    def _keep_stage(self):
        """The state at the end of a stage, for runs that begin alike. Only a convenience: a disk
        that is too full for it does not end the run."""
        self.save()
        try:
            stages.keep(self.scene, self.course.stage, self.directory)
        except OSError as error:
            self.say(f"stage {self.plan.name} is not kept for other runs: {error}")

    def _keep_state(self):
        """A state that the error bar may begin a stretch from, if it is due."""
        if self.error_bar and self.sim.step < self.end:
            self.states.keep(self.sim, self.course.stage, self.course.first)

    def _estimate(self):
        """The error bar, once the run is finished and on disk."""

        def stop():
            if self.interrupted:
                raise KeyboardInterrupt

        def watch(step, done, total):
            now = real_time.perf_counter()
            rate = done / max(now - began, 1e-9)
            if now - self.looked > BURST_SECONDS:
                self.looked = now
                self.watch(Progress(done, total, None, None, rate, "error bar, "))

        end, began = self.sim.step, real_time.perf_counter()
        bar = ErrorBar(self.sim, self.states, self.plates, watch=watch, stop=stop, say=self.say)
        found = bar.measure(len(self.scene.stage_plans), self.course.wall_clock)
        if found is not None:
            self.writer.set_attributes({"error_bar": yaml.safe_dump(found, sort_keys=False)})
            self.writer.flush()
            self.states.discard()
        elif self._error_bar_of() != end:
            self.say(
                "no error bar: it needs states that are kept on the way by a run which is begun "
                "with it; start anew with --force --error-bar"
            )

    def _error_bar_of(self):
        """Steps of the run that the error bar in the result is of, or None."""
        text = self.writer.attributes.get("error_bar", "")
        return yaml.safe_load(text)["run_steps"] if text else None

    def _next_stage(self):
        if self.sim.step > self.opened_at:
            self.say(f"stage {self.plan.name} finished: {self.reason}")
        if self.last_snapshot != self.sim.step:
            self._record_snapshot()
        following = self.course.stage + 1
        self.sim.drive(self.scene.stage_plans[following].drive)
        self.course.begin_stage(following, self.sim)
        self._plan()
        self._keep_state()

    def _advance_to(self, due):
        while self.sim.step < due:
            if self.interrupted:
                self._stop_early()
            burst = max(20, int(self.rate * BURST_SECONDS))
            began, first = real_time.perf_counter(), self.sim.step
            look = guards.next_look(first, self.course.first, self.sim.grains)
            self.sim.advance(min(due - first, burst, look - first))
            took = real_time.perf_counter() - began
            if self.sim.step - first == burst or self.rate == 0.0:
                self.rate = (self.sim.step - first) / took
                self.crew.after_burst(self.rate)
            self._look_around(self.sim.step == look)
            if self.sim.step < due:
                self._keep()

    def _guard(self, m):
        guards.check(self.sim, m, self.course.start, self.scene.numerics.ledger_tolerance)

    def _look_around(self, due):
        """Guards and watcher, where a look is due or some machine time has passed."""
        now = real_time.perf_counter()
        self.course.wall_clock = now - self.began
        if due or now - self.looked > BURST_SECONDS:
            self.looked = now
            self._guard(self.sim.measure())
            phi = self.clock.filling_factor_at(self.sim.step) if self.clock.bounded else None
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
        sim, plan = self.sim, self.plan

        def due(interval):
            return first or (
                interval is not None and next_step(interval, self.clock, sim.step - 1) == sim.step
            )

        if due(plan.series) or sim.step == self.end:
            self._record_series(first)
        if "profiles" in self.features and due(plan.profiles):
            self.writer.append("profiles", record.profile(sim, self.clock, self.edges))
        if due(plan.snapshots):
            self._record_snapshot()

    def _record_series(self, first):
        sim, course = self.sim, self.course
        if first:
            course.mean_force = sim.books.wall_force
        else:
            course.close_window(sim)
        m = sim.measure()
        self._guard(m)
        entry = record.series(
            sim,
            self.clock,
            m,
            course.start,
            course.mean_force,
            course.mean_stress if sim.layout.stress else None,
            course.wall_clock,
            stage=course.stage if self.scene.stages else None,
            plates=self.plates,
        )
        keys = [k for k in select(self.features) if "/" not in k]
        self.writer.append("series", {k: entry[k] for k in keys})
        if not first:
            self._end_by(entry)

    def _end_by(self, entry):
        """Ends the stage where a condition is met that only its record tells."""
        stop, ended = self.plan.stop, ""
        self.pressure = self._pressure(entry)
        if stop.pressure is not None and self.pressure >= stop.pressure:
            ended = f"pressure {stop.pressure / 1e3:.6g} kPa"
        if stop.filling_factor is not None and not self.clock.bounded:
            way = 1.0 if (self.plan.drive.wall_speed or 0.0) > 0.0 else -1.0
            if way * (entry["filling_factor"] - stop.filling_factor) >= 0.0:
                ended = f"filling factor {stop.filling_factor:.4g}"
        if stop.past_maximum is not None and self.course.past_maximum(
            self._tension(entry) / units.PRESSURE, stop.past_maximum
        ):
            ended = f"the tension has fallen by {stop.past_maximum:.0%} below its largest value"
        if ended:
            self.end, self.reason, self.course.ended = self.sim.step, ended, ended

    def _pressure(self, entry):
        """Pressure of a record [Pa]: on the top wall, else of the cell; None without either."""
        if self.sim.box is not None and self.sim.box.present[TOP]:
            return float(entry["pressure"][TOP])
        return -float(np.trace(entry["stress"])) / 3.0 if "stress" in entry else None

    def _tension(self, entry):
        """Tension of a record along the axis that strains most [Pa]."""
        if "stress" not in entry:
            return -float(entry["pressure"][TOP])
        now, before = (np.array(self.clock.lengths(s)) for s in (self.sim.step, self.clock.first))
        axis = int(np.argmax(np.abs(now / before - 1.0)))
        return float(entry["stress"][axis, axis])

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
        sample = {
            f"sample_{k}": getattr(self.sample, k)
            for k in (*_SAMPLE, *_UNLIKE)
            if getattr(self.sample, k) is not None
        }
        meta = {
            "scene": self.scene.to_yaml(),
            "numbers": self.sim.numbers(),
            "course": self.course.to_meta(),
            "counts": self.writer.counts(),
            "sample_info": self.sample.info,
        }
        checkpoint.save(self.directory / CHECKPOINT, self.sim.arrays() | sample, meta)
        self.saved = real_time.perf_counter()

    def finish(self, status):
        """Last frame, status, checkpoint. The checkpoint comes before the last frame that is only
        there because the run ends: a continuation with a later stop is free of it."""
        if self._error_bar_of() not in (None, self.sim.step):
            self.writer.set_attributes({"error_bar": ""})  # of a shorter run
        counts_are_exact = self.last_snapshot != self.sim.step
        self.save()
        if counts_are_exact:
            self._record_snapshot()
        self.writer.set_status(status)
        self.flush()


_SAMPLE = ("positions", "velocities", "spins")
_UNLIKE = ("radii", "materials")  # None where all grains are alike


def _signals():
    return (signal.SIGINT, signal.SIGTERM)


def features_of(scene, sim):
    """What the result of a scene has, in the words of `results.select`."""
    lengths = sim.lengths()
    bounded = not np.isnan(lengths).any()
    asked = {
        "snapshots": True,
        "unlike": sim.bodies is not None,
        "contacts": scene.output.contacts,
        "walls": sim.box is not None,
        "cell": sim.cell is not None,
        "height": not np.isnan(lengths[2]),
        "plates": scene.boundary.kind == "plates",
        "room": sim.box is not None or sim.cell is not None,
        "filling": bounded or scene.boundary.kind == "plates",
        "stress": sim.layout.stress,
        "push": sim.push.works,
        "stages": bool(scene.stages),
        "profiles": bounded and any(plan.profiles is not None for plan in scene.stage_plans),
    }
    return {name for name, there in asked.items() if there}


def _same_scene(saved, scene, stage):
    """Refuse to go on with another scene than the one the checkpoint is of.

    stage: number of the one that the checkpoint stands in: its end and later stages may change.
    """
    old, new = yaml.safe_load(saved), yaml.safe_load(scene.to_yaml())
    for path in FREE_TO_CHANGE:
        for tree in (old, new):
            for key in path[:-1]:
                tree = tree.get(key, {})
            tree.pop(path[-1], None)
    for tree in (old, new):
        done = tree.get("stages", [])[: stage + 1]
        tree["stages"] = {str(n): s for n, s in enumerate(done)}
        tree["stages"].get(str(stage), {}).pop("stop", None)
    changed = sorted(_differences(old, new))
    if changed:
        raise DustError(
            "--resume: the scene is not the one that this run was started with; it differs in "
            f"{', '.join(changed)}. Put that back, or start anew with --force. (stop, "
            "numerics.threads, output.checkpoint and stages still to come may change.)"
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
        raise DustError(f"Cannot write {path}: {files.explain(error, path)}.") from error
