"""The time-step error of a run: segments of its trajectory are run again at half the step.

States of the run are kept on the way, evenly over what has been run so far. At the end each of
them is taken up twice, at the run's step and at half of it, for the same segment of time, and what
was measured is written into the result as the global attribute `error_bar`, from which
analysis.error_bar makes the estimate. Any method that can halve its step has one. Grains of a dense
sample part ways whatever the step, so averages over segments are compared, and their scatter over
the segments goes with them. A run that is over in no time is run again as a whole, at a quarter of
the step too.
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

FOLDER = ".error_bar"  # of a run directory, while the run goes on
FIRST = 256  # steps between the first states
MOST = 12  # states kept; at this number every other one goes
SHARE = 0.05  # of the steps of the run, in all segments together
MOMENTS = 20  # of a segment at which energies and counts are taken
REPORT_SECONDS = 0.25
WORK, FEWEST = 1e7, 20  # grain-steps that are done in no time; grains that cost no less a step


@dataclass(frozen=True)
class Kept:
    """A state kept: at `step`, in the stage with that number, which began at step `first`."""

    stage: int
    first: int
    step: int

    @property
    def name(self):
        return f"{self.stage}_{self.first}_{self.step}.bin"


class States:
    """States of a run on disk, beside its result. Which are kept is a function of the step."""

    def __init__(self, directory):
        self.folder = Path(directory) / FOLDER

    def begin(self, step):
        """Forget states after `step`, those of another way that the run took; -1: all of them."""
        for state in self.kept():
            if state.step > step:
                (self.folder / state.name).unlink()

    def next(self, step):
        """The step after `step` at which a state is due."""
        every = _spacing(step)
        return (step // every + 1) * every

    def keep(self, sim, stage, first):
        """Keep the state of now if it is due, or the first one of a stage. Raises DustError."""
        every = _spacing(sim.step)
        if sim.step % every and sim.step != first:
            return
        self.folder.mkdir(exist_ok=True)
        path = self.folder / Kept(stage, first, sim.step).name
        checkpoint.save(path, *sim.state())
        for state in self.kept():
            if state.step % every and state.step != state.first:
                (self.folder / state.name).unlink()

    def kept(self):
        """Files of states, in order of the steps: a list of Kept."""
        parts = [path.stem.split("_") for path in self.folder.glob("*_*_*.bin")]
        return sorted((Kept(*map(int, part)) for part in parts), key=lambda s: (s.step, s.stage))

    def load(self, state, sim):
        """The simulation goes back to a state."""
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
class Stretch:
    """Steps from a Kept state on that are run again; levels: how many step lengths, 2 or 3."""

    state: Kept
    steps: int
    levels: int


def segments_of(states, end, grains, stages):
    """Stretches for the states of a run (list of Kept) that ended at step `end`: a list.

    stages: how many the run has. None crosses the end of a stage.
    """
    if not states or end == 0:
        return []
    total = min(end, max(SHARE * end, WORK / max(grains, FEWEST)))
    if stages == 1 and total == end and states[0].step == 0:
        return [Stretch(states[0], end, 3)]
    ends = {state.stage - 1: state.first for state in states}
    room = [
        min(ends.get(s.stage, end), following.step if following.stage == s.stage else end) - s.step
        for s, following in zip(states, [*states[1:], Kept(-1, 0, end)], strict=True)
    ]
    each = max(1, round(total / len(states)))
    found = [Stretch(state, min(each, free), 2) for state, free in zip(states, room, strict=True)]
    return [segment for segment in found if 2 * segment.steps > each]


class ErrorBar:
    """The segments of a run that has ended, run again on its Simulation, which is left elsewhere.

    sim: a Refinable simulation (dusttaichi.method). states: the States of the run. report: called
    with (steps done, steps in all) now and then. pause: called often; may raise. log: called with
    what is left out.
    """

    def __init__(self, sim, states, *, report, pause, log):
        self.sim, self.states = sim, states
        self.report, self.pause, self.log = report, pause, log
        self.dt, self.done, self.total = sim.dt, 0, 0

    def measure(self, stages, seconds):
        """Content of the attribute `error_bar`, as plain data; None where there is no state.

        stages: how many the run has had; seconds: how long it took.
        """
        end, began = self.sim.step, real_time.perf_counter()
        plan = segments_of(self.states.kept(), end, self.sim.size, stages)
        self.total = sum(s.steps * (2**s.levels - 1) for s in plan)
        found = []
        for segment in plan:
            try:
                found.append(self._compare(segment))
            except GuardStop as stop:
                self.log(f"error bar: without the segment from step {segment.state.step:,}: {stop}")
        if not found:
            return None
        took = real_time.perf_counter() - began
        return {
            "run_steps": end,
            "time_step": self.dt * units.TIME,
            "cost": took / seconds if seconds > 0.0 else None,
            "stretches": found,
        }

    def _compare(self, segment):
        """One segment at every level: the values by name are lists from the run's step down."""
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
        """Advance by `steps` times `finer` steps; returns name -> number [SI], see
        analysis.error_bar.QUANTITIES.

        Forces are averaged over all steps, energies and counts over MOMENTS moments, which are the
        same for any `finer`.
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
        own = replace(last, losses=lost, lost=lost.sum(), work=work)
        out = {
            f"loss_{name}": value * units.ENERGY
            for name, value in zip(self.sim.channels, lost, strict=True)
        }
        out["losses"] = own.lost * units.ENERGY
        out["energy_end"] = last.energy * units.ENERGY
        out["residual"] = ledger(own, first)[1]
        if any(v.name.endswith("work") for v in self.sim.variables):
            out["work"] = work * units.ENERGY
        return out

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
    """The error bar of a Run that is finished and on disk; into its result, or a word why not."""
    began, reported = real_time.perf_counter(), 0.0

    def pause():
        if run.interrupts.asked:
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
            "no error bar: it needs states that are kept on the way by a run which is begun "
            "with it; start anew with --force --error-bar"
        )
