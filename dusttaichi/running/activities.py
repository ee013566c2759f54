"""Activities of a run at scheduled steps: records, averages, stop conditions.

The next scheduled step of an activity is a pure function of the step. Activities of the same step
act in the order in which the run lists them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.domain.clock import FARTHEST, NEVER
from dusttaichi.errors import DustError
from dusttaichi.results.variables import declare
from dusttaichi.running.ledger import turnover
from dusttaichi.running.schedule import bytes_of, next_record, next_step, steps_apart
from dusttaichi.running.stage_end import LEAST_STEPS, TESTS

if TYPE_CHECKING:
    from dusttaichi.domain.clock import Clock
    from dusttaichi.method import Engine, Measurement, Window
    from dusttaichi.running.run_protocol import Records, Run
    from dusttaichi.running.state import RunState
    from dusttaichi.scene.output import Interval


class Activity(ABC):
    """Base class of the actions of a run at scheduled steps."""

    def __init__(self, run: Run) -> None:
        self.run = run

    @abstractmethod
    def next(self, step: int) -> int:
        """The next scheduled step after `step`, or NEVER."""

    @abstractmethod
    def act(self) -> None:
        """Act at the present step."""

    def begin(self) -> None:  # noqa: B027
        """Act at step 0, before any motion, if at all."""

    def begin_stage(self) -> None:  # noqa: B027
        """Act at the first step of a further stage."""


class Series(Activity):
    """Records of the time series: at their interval, and at the end of every stage."""

    record: dict[str, Any]
    measurement: Measurement

    def next(self, step: int) -> int:
        run = self.run
        return min(next_record(run.plan.series, run.clock, step, run.state.first), run.end.step)

    def begin(self) -> None:
        self._write(None)

    def act(self) -> None:
        self._write(self.run.state.close_window(self.run.sim))

    def _write(self, window: Window | None) -> None:
        run, sim = self.run, self.run.sim
        m = sim.measure()
        run.guard(m)
        self.measurement = m
        run.state.start = run.state.start.include_record(m)
        self.record = series_record(sim, run.clock, run.state, m, window)
        run.writer.append("series", self.record)


def series_record(
    sim: Engine, clock: Clock, state: RunState, m: Measurement, window: Window | None
) -> dict[str, Any]:
    """A record of the time series [SI]: name -> number or array.

    m: the current Measurement; window: the Window of its averages, or None.
    """
    return in_si(sim, "series", _common_record(sim, clock, state, m) | sim.series(m, window))


def take_records(sim: Engine, group_name: str) -> Records:
    """Records [SI] of "profiles" or "snapshots" now, (group, record) pairs."""
    records, converted = list(sim.records(group_name)), []
    while records:  # a group is freed before the next one is converted
        group, record = records.pop(0)
        values = in_si(sim, group, record)
        arrays = [name for name, value in values.items() if isinstance(value, np.ndarray)]
        unchanged = [name for name in arrays if values[name] is record[name]]
        del record  # each array is freed with its copy
        for name in unchanged:  # maybe of the simulation
            values[name] = values[name].copy()
        converted.append((group, values))
    return converted


def in_si(sim: Engine, group: str, record: Mapping[str, Any]) -> dict[str, Any]:
    """The variables of a record that its simulation declares, in SI: the one place where they are.

    record: in the units of the simulation, maybe with more than these.
    """
    declared = [v for v in sim.variables if v.group == group and v.name in record]
    return {v.name: sim.units.si(record[v.name], v.units) for v in declared}


def _common_record(sim: Engine, clock: Clock, state: RunState, m: Measurement) -> dict[str, Any]:
    """Variables of any method in the series (results.variables.COMMON), as `sim` counts."""
    residual, through = turnover(m, state.start)
    lengths = sim.domain.lengths(sim.step)
    record = {
        "time": sim.time,
        "step": sim.step,
        "stage": state.stage,
        "height": lengths[2],
        "box_length": lengths,
        "energy_residual": residual,
        "energy_residual_relative": residual / through if through > 0.0 else 0.0,
        "wall_clock": state.wall_clock / sim.units("s"),
    }
    if clock.bounded:
        record["filling_factor"] = clock.filling_factor_at(sim.step)
    return record


class Averages(Activity):
    """Starts of the averages of records, if output.window is shorter than their interval."""

    def __init__(self, run: Run, series: Series) -> None:
        super().__init__(run)
        self.series, self.steps = series, run.scene.output.window

    def next(self, step: int) -> int:
        if self.steps == "interval":
            return NEVER
        begin = self.series.next(step) - self.steps
        return begin if begin > step else NEVER

    def act(self) -> None:
        self.run.state.open_window(self.run.sim)


class EndCheck(Activity):
    """Checks of the stop conditions of a stage at every record."""

    def __init__(self, run: Run, series: Series) -> None:
        super().__init__(run)
        self.series = series

    def next(self, step: int) -> int:
        return self.series.next(step)

    def act(self) -> None:
        state, sim = self.run.state, self.run.sim
        self.check(bounds=sim.step - state.last_steps(sim) > state.first)

    def check(self, *, bounds: bool = True) -> None:
        """Check the record of this step; bounds: see End.check."""
        measurement = self.series.measurement
        self.run.end.check(self.series.record, self.run.sim, measurement, bounds=bounds)


class StopTests(Activity):
    """Tests of the loads and filling factors of the stop conditions between two records.

    Where one has surely been reached, the stage ends with a record. The tests measure alone: the
    motion and the other records keep their bits.
    """

    def __init__(self, run: Run, series: Series, end_check: EndCheck) -> None:
        super().__init__(run)
        self.series, self.end_check = series, end_check

    def next(self, step: int) -> int:
        run = self.run
        if not run.end.tested:
            return NEVER
        opened, next_series = run.state.opened, self.series.next(step)
        every = max(LEAST_STEPS, -(-(min(next_series, FARTHEST) - opened) // TESTS))
        following = opened + ((step - opened) // every + 1) * every
        return following if following < next_series else NEVER

    def act(self) -> None:
        run, sim = self.run, self.run.sim
        window = run.state.window(sim)
        loads = getattr(sim, "mean_loads", lambda window: sim.series(sim.measure(), window))
        record = in_si(sim, "series", loads(window))
        if run.clock.bounded:
            record["filling_factor"] = run.clock.filling_factor_at(sim.step)
        if run.end.reached_between(record, sim):
            self.series.act()
            self.end_check.check()


class Profiles(Activity):
    """Profiles at their interval, if the result has them."""

    def next(self, step: int) -> int:
        return next_step(self.run.plan.profiles, self.run.clock, step)

    def act(self) -> None:
        if "profiles" in self.run.writer.groups:
            self.run.record("profiles")

    begin = act


class Snapshots(Activity):
    """Frames at their interval; the run adds those at the ends of stages."""

    def next(self, step: int) -> int:
        run = self.run
        if run.plan.snapshots == "auto":
            apart = run.state.apart
            return (step // apart + 1) * apart if apart else NEVER
        return next_step(run.plan.snapshots, run.clock, step)

    def begin(self) -> None:
        self.act()
        self.begin_stage()

    def begin_stage(self) -> None:
        """Set the distance of automatic snapshots."""
        run, plans = self.run, self.run.scene.stage_plans
        run.state.apart = steps_apart(plans, run.clock, run.plan, run.state.frame_bytes)

    def act(self) -> None:
        """Write the current frame, unless it was written."""
        run = self.run
        if run.state.last_snapshot != run.sim.step and "snapshots" in run.writer.groups:
            run.state.frame_bytes = bytes_of(run.record("snapshots"))
            run.state.last_snapshot = run.sim.step


class OwnRecords(Activity):
    """Numbers recorded by the user, in a separate group of the result.

    interval: an Interval (scene.output). function(simulation): returns a number, an array, or a
    dict of these by name, always the same ones. units: name -> unit, for the result.
    """

    def __init__(
        self,
        run: Run,
        interval: Interval,
        group: str,
        function: Callable[[], Any],
        units: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(run)
        self.interval, self.group = interval, group
        self.function, self.units = function, dict(units or {})

    def next(self, step: int) -> int:
        return next_step(self.interval, self.run.clock, step)

    def act(self) -> None:
        result = self.function()
        if result is None:
            return
        values = result if isinstance(result, dict) else {self.group: result}
        values = {name: np.asarray(value) for name, value in values.items()}
        if self.group not in self.run.writer.groups:
            self._declare(values)
        sim = self.run.sim
        when = {"record_time": sim.time * sim.units("s"), "step": sim.step}
        self.run.writer.append(self.group, when | values)

    def _declare(self, values: Mapping[str, NDArray[Any]]) -> None:
        rows = [
            ("record_time", "record", "s", "simulated time", "", ""),
            ("step", "record", "1", "time steps done", "", ""),
        ]
        sizes: dict[str, int] = {}
        dtypes = {"step": "i8"}
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
            dtypes[name] = "f8" if value.dtype.kind == "f" else "i8"
        self.run.writer.add(declare(self.group, rows, dtypes), sizes)
