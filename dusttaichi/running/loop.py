"""The loop: a run advances to the next scheduled step of its activities, which then act.

All records are written at steps that the scene determines (schedule.py). Actions that depend on
real time (guards between records, flushes, checkpoints, Ctrl-C, the report) change no number.
"""

from __future__ import annotations

import time as real_time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any

from dusttaichi.domain.clock import NEVER
from dusttaichi.errors import GuardStop, Interrupted
from dusttaichi.running import activities, ledger
from dusttaichi.running.stage_end import End
from dusttaichi.running.state import Report

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from dusttaichi.domain.clock import Clock
    from dusttaichi.method import Engine, Measurement
    from dusttaichi.running.interrupts import Interrupts
    from dusttaichi.running.persistence import RunFiles
    from dusttaichi.running.run_protocol import Records
    from dusttaichi.running.state import RunState
    from dusttaichi.scene.scene import Scene


BURST_SECONDS = 0.25  # of real time between two checks of the clock, the guards and Ctrl-C
BURST_STEPS = 20  # least number of steps between checks of the guards
GUARDED = 0.01  # largest share of the time that checks of the guards between records take
LONGEST_UNGUARDED = 2.5  # seconds of real time between two of these, however long they take


class Run:
    """A run in progress: its simulation, state, files and activities.

    sim: an Engine (dusttaichi.method). state: RunState. files: RunFiles. interrupts: Interrupts.
    report: called regularly with a Report; log: called with messages for the user. advancing: a
    context manager that is entered around every segment of steps.
    """

    def __init__(
        self,
        scene: Scene,
        sim: Engine,
        state: RunState,
        files: RunFiles,
        *,
        interrupts: Interrupts,
        report: Callable[[Report], None],
        log: Callable[[str], object],
        advancing: AbstractContextManager[Any] | None = None,
    ) -> None:
        self.scene, self.sim, self.state, self.files = scene, sim, state, files
        self.writer, self.interrupts, self.report, self.log = files.writer, interrupts, report, log
        self.advancing = advancing or nullcontext()
        self.rate, self.checked = 0.0, 0.0
        self.began = real_time.perf_counter() - state.wall_clock
        self.opened_at = self.guarded_at = sim.step
        self.guard_due = 0.0  # real time of the next check of the guards
        self.activities = self._make_activities()
        self.plan_stage()

    def _make_activities(self) -> list[activities.Activity]:
        series = activities.Series(self)
        self.snapshots = activities.Snapshots(self)
        end_check = activities.EndCheck(self, series)
        run_activities = [activities.Averages(self, series), series, end_check]
        run_activities.append(activities.StopTests(self, series, end_check))
        return [*run_activities, activities.Profiles(self), self.snapshots]

    def plan_stage(self) -> None:
        """Set the plan and the end of the present stage."""
        self.plan = self.scene.stage_plans[self.state.stage]
        self.end = End(self.plan, self.clock, self.state, self.sim.step)

    @property
    def clock(self) -> Clock:
        """The Clock of the present stage, with the current motion of walls and faces."""
        return self.sim.domain.clock(self.state.first)

    def begin(self) -> None:
        """Step 0: the first records and the first state."""
        self.state.open_window(self.sim)
        for activity in self.activities:
            activity.begin()

    # -- going -----------------------------------------------------------------------------------

    def go(self) -> None:
        """Run to the end of the last stage; any end leaves the computed records on disk."""
        with self.record_guard_stop():
            self.advance_to(None)
            while self.next_stage():
                self.advance_to(None)
            self.finish()

    @contextmanager
    def record_guard_stop(self) -> Iterator[None]:
        """Context in which a stop by a guard leaves a result on disk."""
        try:
            yield
        except GuardStop as stop:
            self.writer.set_status(f"stopped by guard: {stop}")
            self.files.join()
            raise

    def advance_to(self, step: int | None) -> None:
        """Advance the present stage to that step, or to its end (None)."""
        sim = self.sim
        while sim.step < self.end.step and (step is None or sim.step < step):
            scheduled = [(activity.next(sim.step), activity) for activity in self.activities]
            first = min(at for at, _ in scheduled)
            self._advance_in_bursts(first if step is None else min(first, step))
            for at, activity in scheduled:
                if at == sim.step:
                    activity.act()
            self.files.write_if_due(self)

    def _advance_in_bursts(self, last_step: int) -> None:
        """Advance to the step `due`, with pauses for guards and the user."""
        sim = self.sim
        while sim.step < last_step:
            self.stop_if_interrupted()
            # at most a second of slow steps, for Ctrl-C in large scenes
            burst = max(int(self.rate * BURST_SECONDS), min(BURST_STEPS, int(self.rate)), 1)
            began, first = real_time.perf_counter(), sim.step
            check = ledger.next_check(first, self.state.first, sim.size)
            with self.advancing:
                sim.advance(min(last_step - first, burst, check - first))
            if sim.step - first == burst or self.rate == 0.0:
                self.rate = (sim.step - first) / (real_time.perf_counter() - began)
            self._check(sim.step == check)
            if sim.step < last_step:
                self.files.write_if_due(self)

    def _check(self, is_scheduled: bool) -> None:
        """Guards and report, if a check is due or after some real time."""
        current_time = real_time.perf_counter()
        self.state.wall_clock = current_time - self.began
        if is_scheduled or current_time - self.checked > BURST_SECONDS:
            self.checked = current_time
            is_due = current_time >= self.guard_due
            if is_scheduled or (is_due and self.sim.step >= self.guarded_at + BURST_STEPS):
                self.guarded_at = self.sim.step
                self.guard(self.sim.measure())
                took = real_time.perf_counter() - current_time
                self.guard_due = current_time + min(took / GUARDED, LONGEST_UNGUARDED)
            phi = self.clock.filling_factor_at(self.sim.step) if self.clock.bounded else None
            end = self.end.step if self.end.step < NEVER else None
            self.report(Report(self.sim.step, end, phi, self.end.pressure, self.rate))

    def guard(self, m: Measurement) -> None:
        """Raise GuardStop if the Measurement is invalid."""
        ledger.check(self.sim, m, self.state.start, self.scene.numerics.ledger_tolerance)

    def record(self, group_name: str) -> Records:
        """Write records of "profiles" or "snapshots" now; returns them, (group, record) pairs."""
        records = activities.take_records(self.sim, group_name)
        for group, entry in records:
            self.writer.append(group, entry, copy=False)
        return records

    def stop_if_interrupted(self) -> None:
        """After a signal, write result and checkpoint and raise Interrupted."""
        if self.interrupts.requested:
            self.writer.set_status("interrupted")
            self.files.save(self)
            raise Interrupted(f"interrupted; everything up to here is in {self.files.directory}")

    # -- stages ----------------------------------------------------------------------------------

    def next_stage(self) -> bool:
        """End the present stage, and begin the next, if any."""
        following = self.state.stage + 1
        if following >= len(self.scene.stage_plans):
            return False
        self.files.save(self)
        if self.sim.step > self.opened_at:
            self.log(f"stage {self.plan.name} finished: {self.end.reason}")
        self.snapshots.act()
        self.sim.drive(self.scene.stage_plans[following].drive)
        self.state.begin_stage(following, self.sim.step)
        self.state.open_window(self.sim)
        self.plan_stage()
        for activity in self.activities:
            activity.begin_stage()
        return True

    def finish(self) -> None:
        """Write the last frame, the status and the checkpoint.

        A continuation with a later stop lacks the last frame.
        """
        self.before_end = self.writer.counts(), self.state.last_snapshot
        self.files.save(self, self._end)
        self.files.join()

    def _end(self) -> None:
        self.snapshots.act()
        self.writer.set_status(f"finished: {self.end.reason}")
