"""State of a run beside that of its simulation, part of every checkpoint; progress reports."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.method import Start, Window

if TYPE_CHECKING:
    from dusttaichi.method import Engine


@dataclass
class Tension:
    """Tensions [Pa] of the last records of a stage, for stop.past_maximum.

    count: number of records so far; largest: the largest average so far.
    """

    last: list[float] = field(default_factory=list)
    count: int = 0
    largest: float = 0.0


@dataclass
class RunState:
    """Progress of a run.

    start: energies of step 0. stage: its number; first: its first step; end_reason: why it has
    ended before its last step was known, or "". last_snapshot: step of the last frame, or -1;
    frame_bytes: its size; apart: steps between automatic snapshots. opened: step at which the
    average of the next record begins; sums: of that step. last_sums, last_span: sums at which
    the average of the last record began, and its duration, 0 before the first. pressures [Pa]: of
    the last records of the stage, for stop.plateau; settling: (time [s], logarithm of the filling
    factor, load over the controlled one) of these, for stop.creep. tests: (step, values) of the
    tests of stop.pressure and stop.stress since `opened`. wall_clock: real time spent [s].
    """

    start: Start
    stage: int = 0
    first: int = 0
    end_reason: str = ""
    last_snapshot: int = -1
    frame_bytes: int = 0
    apart: int = 0
    opened: int = 0
    sums: dict[str, np.ndarray] = field(default_factory=dict)
    last_sums: dict[str, np.ndarray] = field(default_factory=dict)
    last_span: float = 0.0
    tension: Tension = field(default_factory=Tension)
    pressures: list[float] = field(default_factory=list)
    settling: list[list[float]] = field(default_factory=list)
    tests: list[tuple[int, list[float]]] = field(default_factory=list)
    wall_clock: float = 0.0

    def begin_stage(self, stage: int, step: int) -> None:
        """The next stage begins at this step."""
        self.stage, self.first, self.end_reason, self.tension = stage, step, "", Tension()
        self.pressures, self.settling = [], []

    def open_window(self, sim: Engine) -> None:
        """The average of the next record begins at this step."""
        self.opened, self.sums, self.tests = sim.step, sim.sums(), []

    def close_window(self, sim: Engine) -> Window:
        """The Window that ends at this step; the next one opens."""
        self.last_sums, self.last_span = self.sums, (sim.step - self.opened) * sim.dt
        self.open_window(sim)
        return Window(self.last_sums, self.sums, self.last_span)

    def last_steps(self, sim: Engine) -> int:
        """Steps over which the last record is averaged."""
        return round(self.last_span / sim.dt)

    def window(self, sim: Engine) -> Window | None:
        """The Window since the last record, that of the record at its step; None before any."""
        if sim.step > self.opened:
            return Window(self.sums, sim.sums(), (sim.step - self.opened) * sim.dt)
        return Window(self.last_sums, self.sums, self.last_span) if self.last_span > 0.0 else None


@dataclass
class Report:
    """Progress of a run for display.

    `filling_factor` and `pressure` [Pa] may be None, as is `end` before it is known.
    """

    step: int
    end: int | None
    filling_factor: float | None
    pressure: float | None
    steps_per_second: float
