"""Activities of a run at scheduled steps: records, averages, the check of its end, kept states.

An activity says at which step it is due next, a pure function of the step, and acts there. Those
that are due at the same step act in the order in which the run lists them.
"""

from abc import ABC, abstractmethod

import numpy as np

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.names import NEVER
from dusttaichi.results.variables import declare
from dusttaichi.run.ledger import turnover
from dusttaichi.run.schedule import next_step
from dusttaichi.run.spread import bytes_of, steps_apart


class Activity(ABC):
    """Base class of what a run does at scheduled steps."""

    @abstractmethod
    def next(self, step: int) -> int:
        """The first step after `step` at which it is due, or NEVER."""

    @abstractmethod
    def act(self) -> None:
        """Do it, at the present step."""

    def begin(self) -> None:  # noqa: B027, most have nothing to do there
        """Act at step 0, before any motion."""

    def begin_stage(self) -> None:  # noqa: B027
        """Act at the first step of a further stage."""


class Series(Activity):
    """Records of the time series: at their interval, and at the end of every stage."""

    def __init__(self, run):
        self.run, self.record, self.measurement = run, {}, None

    def next(self, step):
        run = self.run
        return min(next_step(run.plan.series, run.clock, step), run.end.step)

    def begin(self):
        """The record of step 0, before any motion."""
        self._write(None)

    def act(self):
        self._write(self.run.state.close_window(self.run.sim))

    def _write(self, window):
        run, sim = self.run, self.run.sim
        m = sim.measure()
        run.guard(m)
        self.measurement = m
        run.state.start = run.state.start.after(m)
        self.record = series_record(sim, run.clock, run.state, m, window)
        run.writer.append("series", self.record)


def series_record(sim, clock, state, m, window):
    """A record of the time series [SI]: name -> number or array.

    m: the Measurement of now; window: the Window of its averages, None where there is none yet.
    """
    known = _common_record(sim, clock, state, m) | sim.series(m, window)
    return {v.name: known[v.name] for v in sim.variables if v.group == "series"}


def _common_record(sim, clock, state, m):
    """Variables of any method in the series (results.variables.COMMON), SI, where they apply."""
    residual, through = turnover(m, state.start)
    lengths = sim.domain.lengths(sim.step)
    record = {
        "time": (sim.began + sim.time) * units.TIME,
        "step": sim.step,
        "stage": state.stage,
        "height": lengths[2] * units.LENGTH,
        "box_length": lengths * units.LENGTH,
        "energy_residual": residual * units.ENERGY,
        "energy_residual_relative": residual / through if through > 0.0 else 0.0,
        "wall_clock": state.wall_clock,
    }
    if clock.bounded:
        record["filling_factor"] = clock.filling_factor_at(sim.step)
    return record


class Averages(Activity):
    """Begins the average of the next record, where output.window makes it shorter than the
    interval."""

    def __init__(self, run, series):
        self.run, self.series, self.steps = run, series, run.scene.output.window

    def next(self, step):
        if self.steps == "interval":
            return NEVER
        begin = self.series.next(step) - self.steps
        return begin if begin > step else NEVER

    def act(self):
        self.run.state.open_window(self.run.sim)


class EndCheck(Activity):
    """Ends the stage where the last record meets one of its stop conditions."""

    def __init__(self, run, series):
        self.run, self.series = run, series

    def next(self, step):
        return self.series.next(step)

    def act(self):
        self.run.end.check(self.series.record, self.run.sim, self.series.measurement)


class Profiles(Activity):
    """Profiles at their interval, where the result has them."""

    def __init__(self, run):
        self.run = run

    def next(self, step):
        return next_step(self.run.plan.profiles, self.run.clock, step)

    def begin(self):
        self.act()

    def act(self):
        if "profiles" in self.run.writer.groups:
            self.run.record("profiles")


class Snapshots(Activity):
    """Frames at their interval; the run adds those at the ends of stages."""

    def __init__(self, run):
        self.run = run

    def next(self, step):
        run = self.run
        if run.plan.snapshots == "auto":
            apart = run.state.apart
            return (step // apart + 1) * apart if apart else NEVER
        return next_step(run.plan.snapshots, run.clock, step)

    def begin(self):
        self.act()
        self.begin_stage()

    def begin_stage(self):
        """How far apart they are, where the scene leaves that to the run."""
        run, plans = self.run, self.run.scene.stage_plans
        run.state.apart = steps_apart(plans, run.clock, run.plan, run.state.frame_bytes)

    def act(self):
        """A frame of now, unless there is one."""
        run = self.run
        if run.state.last_snapshot != run.sim.step and "snapshots" in run.writer.groups:
            run.state.frame_bytes = bytes_of(run.record("snapshots"))
            run.state.last_snapshot = run.sim.step


class OwnRecords(Activity):
    """Numbers of the user's own at times of his own, in a group of the result of their own.

    interval: an Interval (scene.output). function(simulation): returns a number, an array, or a
    dict of such by name, the same ones each time. units: name -> unit, for the result.
    """

    def __init__(self, run, interval, group, function, units=()):
        self.run, self.interval, self.group = run, interval, group
        self.function, self.units = function, dict(units)

    def next(self, step):
        return next_step(self.interval, self.run.clock, step)

    def begin(self):
        self.act()

    def act(self):
        found = self.function()
        if found is None:
            return
        values = found if isinstance(found, dict) else {self.group: found}
        values = {name: np.asarray(value) for name, value in values.items()}
        if self.group not in self.run.writer.groups:
            self._declare(values)
        sim = self.run.sim
        own = {"record_time": (sim.began + sim.time) * units.TIME, "step": sim.step}
        self.run.writer.append(self.group, own | values)

    def _declare(self, values):
        rows = [
            ("record_time", "record", "s", "simulated time", "", ""),
            ("step", "record", "1", "time steps done", "", ""),
        ]
        sizes, kinds = {}, {"step": "i8"}
        for name, value in values.items():
            if value.dtype.kind not in "fiub":
                raise DustError(
                    f"{self.group}: {name} is {value!r}; allowed: numbers and arrays of numbers"
                )
            dims = {f"{self.group}_{name}_{n}": size for n, size in enumerate(value.shape)}
            sizes |= dims
            text = f"{name}, recorded by {getattr(self.function, '__name__', self.group)}"
            rows.append(
                (name, " ".join(["record", *dims]), self.units.get(name, "1"), text, "", "")
            )
            kinds[name] = "f8" if value.dtype.kind == "f" else "i8"
        self.run.writer.add(declare(self.group, rows, kinds), sizes)


class KeptStates(Activity):
    """States on the way that the error bar may begin a segment from (error_bar.States)."""

    def __init__(self, run, states):
        self.run, self.states = run, states

    def next(self, step):
        return self.states.next(step)

    def begin(self):
        self.act()

    def begin_stage(self):
        """The first state of a stage."""
        self.act()

    def act(self):
        run = self.run
        if run.sim.step < run.end.step:
            self.states.keep(run.sim, run.state.stage, run.state.first)
