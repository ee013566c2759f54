"""The time-step error of a run: segments of its trajectory are repeated at half the step.

States of the run are stored, evenly over the steps so far. At the end each of them is continued
twice, at the step of the run and at half of it, for the same segment of time. The measurements are
written into the result as the global attribute `error_bar`, from which analysis.error_bar computes
the estimate. It needs a method that can halve its step. Trajectories in a dense sample diverge for
any step, so averages over segments are compared, with their scatter over the segments. A short run
is repeated as a whole, also at a quarter of the step.
"""

import shutil
import time as real_time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dusttaichi import units
from dusttaichi.errors import GuardStop, Interrupted
from dusttaichi.method import State, Window
from dusttaichi.run import checkpoint
from dusttaichi.run.ledger import ledger
from dusttaichi.run.state import Report

FOLDER = ".error_bar"  # in the run directory during the run
FIRST = 256  # steps between the first states
MOST = 12  # stored states; beyond this number every other one is removed
SHARE = 0.05  # of the steps of the run, in all segments together
MOMENTS = 20  # of a segment at which energies and counts are measured
REPORT_SECONDS = 0.25
WORK, FEWEST = 1e7, 20  # grain-steps of a short run; least number of grains in its estimate


@dataclass(frozen=True)
class StoredState:
    """A stored state: at `step`, in the stage with that number, which began at step `first`."""

    stage: int
    first: int
    step: int

    @property
    def name(self):
        return f"{self.stage}_{self.first}_{self.step}.bin"


class States:
    """States of a run on disk, beside its result; a function of the step determines which."""

    def __init__(self, directory):
        self.folder = Path(directory) / FOLDER

    def begin(self, step):
        """Remove states after `step`, of an earlier run; -1: all of them."""
        for state in self.stored():
            if state.step > step:
                (self.folder / state.name).unlink()

    def next(self, step):
        """The next scheduled step of a state after `step`."""
        every = _spacing(step)
        return (step // every + 1) * every

    def store(self, sim, stage, first):
        """Store the present state if it is due, or the first one of a stage. Raises DustError."""
        every = _spacing(sim.step)
        if sim.step % every and sim.step != first:
            return
        self.folder.mkdir(exist_ok=True)
        path = self.folder / StoredState(stage, first, sim.step).name
        checkpoint.save(path, *sim.state())
        for state in self.stored():
            if state.step % every and state.step != state.first:
                (self.folder / state.name).unlink()

    def stored(self):
        """StoredStates of the files, in order of the steps."""
        parts = [path.stem.split("_") for path in self.folder.glob("*_*_*.bin")]
        return sorted(
            (StoredState(*map(int, part)) for part in parts), key=lambda s: (s.step, s.stage)
        )

    def load(self, state, sim):
        """Restore a state of the simulation."""
        saved = checkpoint.load(self.folder / state.name)
        sim.restore(State(saved.arrays, saved.meta))

    def discard(self):
        shutil.rmtree(self.folder, ignore_errors=True)


def _spacing(step):
    every = FIRST
    while step >= MOST * every:
        every *= 2
    return every


@dataclass(frozen=True)
class Segment:
    """Steps after a StoredState that are repeated; levels: number of step lengths, 2 or 3."""

    state: StoredState
    steps: int
    levels: int


def segments_of(states, end, grains, stages):
    """Segments for the states of a run (StoredStates) that ended at step `end`: a list.

    stages: number of stages of the run. No segment crosses the end of a stage.
    """
    if not states or end == 0:
        return []
    total = min(end, max(SHARE * end, WORK / max(grains, FEWEST)))
    if stages == 1 and total == end and states[0].step == 0:
        return [Segment(states[0], end, 3)]
    ends = {state.stage - 1: state.first for state in states}
    available = [
        min(ends.get(s.stage, end), following.step if following.stage == s.stage else end) - s.step
        for s, following in zip(states, [*states[1:], StoredState(-1, 0, end)], strict=True)
    ]
    each = max(1, round(total / len(states)))
    found = [
        Segment(state, min(each, free), 2) for state, free in zip(states, available, strict=True)
    ]
    return [segment for segment in found if 2 * segment.steps > each]


class ErrorBar:
    """Repeats the segments of a finished run on its Simulation, whose state changes.

    sim: a Refinable simulation (dusttaichi.method). states: the States of the run. report: called
    regularly with (steps done, all steps). pause: called often; may raise. log: called with
    messages on omitted segments.
    """

    def __init__(self, sim, states, *, report, pause, log):
        self.sim, self.states = sim, states
        self.report, self.pause, self.log = report, pause, log
        self.dt, self.done, self.total = sim.dt, 0, 0

    def measure(self, stages, seconds):
        """Content of the attribute `error_bar`, as plain data; None without states.

        stages: number of stages of the run; seconds: its run time.
        """
        end, began = self.sim.step, real_time.perf_counter()
        plan = segments_of(self.states.stored(), end, self.sim.size, stages)
        self.total = sum(s.steps * (2**s.levels - 1) for s in plan)
        results = []
        for segment in plan:
            try:
                results.append(self._compare(segment))
            except GuardStop as stop:
                self.log(f"error bar: without the segment from step {segment.state.step:,}: {stop}")
        if not results:
            return None
        took = real_time.perf_counter() - began
        return {
            "run_steps": end,
            "time_step": self.dt * units.TIME,
            "cost": took / seconds if seconds > 0.0 else None,
            "stretches": results,
        }

    def _compare(self, segment):
        """One segment at every level: lists of values by name, from the step of the run down."""
        levels = [self._run(segment, level) for level in range(segment.levels)]
        numbers, places = zip(*levels, strict=True)
        return {
            "step": segment.state.step,
            "steps": segment.steps,
            "stage": segment.state.stage,
            "apart": [self._apart(a, b) for a, b in zip(places, places[1:], strict=False)],
            "values": {name: [float(n[name]) for n in numbers] for name in numbers[0]},
        }

    def _run(self, segment, level):
        """(values, positions at the end [um]) of a segment at 1/2^level of the step."""
        self.states.load(segment.state, self.sim)
        for _ in range(level):
            self.sim.halve_step()
        return self._values(segment.steps, 2**level), self.sim.positions()

    def _values(self, steps, finer):
        """Advance by `steps` times `finer` steps; returns name -> number [SI].

        See analysis.error_bar.QUANTITIES. Forces are averaged over all steps, energies and counts
        over MOMENTS moments, which are the same for any `finer`.
        """
        sim = self.sim
        before, first = sim.ends(), sim.measure()
        moments, done = [], 0
        for step in np.unique(np.linspace(0, steps, MOMENTS + 1).round().astype(int))[1:]:
            self._advance(int(step - done) * finer)
            done = int(step)
            moments.append(sim.measure())
        window = Window(before, sim.ends(), steps * finer * sim.dt)
        values = {"kinetic_energy": np.mean([m.kinetic for m in moments]) * units.ENERGY}
        values |= self._energies(first, moments[-1] if moments else first)
        return values | sim.compared(window, moments)

    def _energies(self, first, last):
        """Losses, work and residual of a segment."""
        lost, work = last.losses - first.losses, last.work - first.work
        change = replace(last, losses=lost, lost=lost.sum(), work=work)
        values = {
            f"loss_{name}": value * units.ENERGY
            for name, value in zip(self.sim.channels, lost, strict=True)
        }
        values["losses"] = change.lost * units.ENERGY
        values["energy_end"] = last.energy * units.ENERGY
        values["residual"] = ledger(change, first)[1]
        if any(v.name.endswith("work") for v in self.sim.variables):
            values["work"] = work * units.ENERGY
        return values

    def _advance(self, steps):
        self.pause()
        self.sim.advance(steps)
        self.done += steps
        self.report(self.done, self.total)

    def _apart(self, one, other):
        """Root mean square distance of the same particles at two levels [m]."""
        d = self.sim.domain.nearest(one - other, self.sim.step)
        return float(np.sqrt(np.mean(np.sum(d**2, axis=1)))) * units.LENGTH


def estimate(run, states):
    """Write the error bar of a finished Run into its result, or log the reason why not."""
    began, reported = real_time.perf_counter(), 0.0

    def pause():
        if run.interrupts.requested:
            text = "interrupted; the run is finished, its error bar is not"
            raise Interrupted(text)

    def report(done, total):
        nonlocal reported
        now = real_time.perf_counter()
        if now - reported > REPORT_SECONDS:
            reported, rate = now, done / max(now - began, 1e-9)
            run.report(Report(done, total, None, None, rate, "error bar, "))

    end, found = run.sim.step, None
    if hasattr(run.sim, "halve_step"):
        bar = ErrorBar(run.sim, states, report=report, pause=pause, log=run.log)
        found = bar.measure(len(run.scene.stage_plans), run.state.wall_clock)
    if found is not None:
        run.files.write_error_bar(found)
        states.discard()
    elif run.files.error_bar_steps() != end:
        run.log(
            "no error bar: it needs states that a run stores if it is started with --error-bar; "
            "start again with --force --error-bar"
        )
