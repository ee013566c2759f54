"""The time-step error of a run: stretches of its trajectory are run again at half the step.

States of the run are kept on the way, evenly over what has been run so far. At the end each of
them is taken up twice, at the run's step and at half of it (refine.py), for the same stretch of
time, and what was measured is written into the result as the global attribute `error_bar`, from
which analysis.error_bar makes the estimate. Grains of a dense sample part ways whatever the step,
so averages over stretches are compared, and their scatter over the stretches goes with them.
A run that is over in no time is run again as a whole, at a quarter of the step too.
"""

import shutil
import time as real_time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dusttaichi import units
from dusttaichi.errors import GuardStop
from dusttaichi.grains.refine import halve_time_step
from dusttaichi.grains.stretch import measure_stretch
from dusttaichi.run import checkpoint

FOLDER = ".error_bar"  # of a run directory, while the run goes on
FIRST = 256  # steps between the first states
MOST = 12  # states kept; at this number every other one goes
SHARE = 0.05  # of the steps of the run, in all stretches together
WORK, FEWEST = 1e7, 20  # grain-steps that are done in no time; grains that cost no less a step


@dataclass(frozen=True)
class State:
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
        """Forget states after `step`, those of another course of the run; -1: all of them."""
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
        path = self.folder / State(stage, first, sim.step).name
        checkpoint.save(path, sim.arrays(), sim.numbers())
        for state in self.kept():
            if state.step % every and state.step != state.first:
                (self.folder / state.name).unlink()

    def kept(self):
        """What there is, in order of the steps: a list of State."""
        parts = [path.stem.split("_") for path in self.folder.glob("*_*_*.bin")]
        return sorted((State(*map(int, part)) for part in parts), key=lambda s: (s.step, s.stage))

    def load(self, state, sim):
        """The simulation goes back to a state."""
        saved = checkpoint.load(self.folder / state.name)
        sim.restore(saved.arrays, saved.meta)

    def discard(self):
        shutil.rmtree(self.folder, ignore_errors=True)


def _spacing(step):
    every = FIRST
    while step >= MOST * every:
        every *= 2
    return every


@dataclass(frozen=True)
class Stretch:
    """Steps from a State on that are run again; levels: how many steps are compared, 2 or 3."""

    state: State
    steps: int
    levels: int


def stretches_of(states, end, grains, stages):
    """Stretches for the states of a run (list of State) that ended at step `end`: a list.

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
        for s, following in zip(states, [*states[1:], State(-1, 0, end)], strict=True)
    ]
    each = max(1, round(total / len(states)))
    found = [Stretch(state, min(each, free), 2) for state, free in zip(states, room, strict=True)]
    return [stretch for stretch in found if 2 * stretch.steps > each]


class ErrorBar:
    """The stretches of a run that has ended, run again on its Simulation, which is left elsewhere.

    states: the States of the run. watch: told (step, steps done, steps in all) now and then.
    stop: called often; may raise. say: told what is left out.
    """

    def __init__(self, sim, states, plates, *, watch, stop, say):
        self.sim, self.states, self.plates = sim, states, plates
        self.watch, self.stop, self.say = watch, stop, say
        self.dt, self.push, self.done, self.total = sim.dt, sim.push, 0, 0

    def measure(self, stages, seconds):
        """What the attribute `error_bar` holds, as plain data; None where there is no state.

        stages: how many the run has had; seconds: how long it took.
        """
        end, began = self.sim.step, real_time.perf_counter()
        plan = stretches_of(self.states.kept(), end, self.sim.grains, stages)
        self.total = sum(s.steps * (2**s.levels - 1) for s in plan)
        found = []
        for stretch in plan:
            try:
                found.append(self._compare(stretch))
            except GuardStop as stop:
                self.say(f"error bar: without the stretch from step {stretch.state.step:,}: {stop}")
        if not found:
            return None
        took = real_time.perf_counter() - began
        return {
            "run_steps": end,
            "time_step": self.dt * units.TIME,
            "cost": took / seconds if seconds > 0.0 else None,
            "stretches": found,
        }

    def _compare(self, stretch):
        """One stretch at every level: the values by name are lists from the run's step down."""
        levels = [self._run(stretch, level) for level in range(stretch.levels)]
        numbers, places = zip(*levels, strict=True)
        return {
            "step": stretch.state.step,
            "steps": stretch.steps,
            "stage": stretch.state.stage,
            "apart": [self._apart(a, b) for a, b in zip(places, places[1:], strict=False)],
            "values": {name: [float(n[name]) for n in numbers] for name in numbers[0]},
        }

    def _run(self, stretch, level):
        """(values, positions at the end [um]) of a stretch at 1/2^level of the step."""
        sim = self.sim
        sim.dt, sim.push = self.dt, self.push
        self.states.load(stretch.state, sim)
        for _ in range(level):
            halve_time_step(sim)
        values = measure_stretch(sim, stretch.steps, 2**level, self.plates, self._advance)
        return values, sim.grain_state()[0]

    def _advance(self, steps):
        self.stop()
        self.sim.advance(steps)
        self.done += steps
        self.watch(self.sim.step, self.done, self.total)

    def _apart(self, one, other):
        """Root mean square distance of the same grains at two levels [m]."""
        d = one - other
        if self.sim.cell is not None:
            edges = self.sim.cell.edges(self.sim.time)
            d -= np.where(edges > 0.0, edges * np.round(d / np.where(edges > 0.0, edges, 1.0)), 0.0)
        return float(np.sqrt(np.mean(np.sum(d**2, axis=1)))) * units.LENGTH
