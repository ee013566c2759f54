"""How far a run has come: what goes into a checkpoint beside the simulation itself."""

import time as real_time
from dataclasses import dataclass, field, fields

import numpy as np

from dusttaichi.grains import record

TENSIONS = 10  # points of the series that stop.past_maximum averages over


@dataclass
class Course:
    """Measurement at step 0, stage, and the averages since `window_step`.

    stage: number of the leg; first: its first step; ended: why it has ended before its last step
    was known, or "". mean_force (6, 3) [nN] and mean_stress (3, 3) [kPa]: of the last record.
    """

    start: dict
    stage: int = 0
    first: int = 0
    ended: str = ""
    window_step: int = 0
    window_impulse: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    window_flux: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    window_lengths: np.ndarray = field(default_factory=lambda: np.zeros(3))
    mean_force: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    mean_stress: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    tensions: list = field(default_factory=list)  # of the last points of the series [kPa]
    tension_count: int = 0
    tension_most: float = 0.0
    wall_clock: float = 0.0

    def to_meta(self):
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}

    @classmethod
    def from_meta(cls, meta):
        arrays = {"window_impulse", "window_flux", "window_lengths", "mean_force", "mean_stress"}
        values = {k: np.array(v) if k in arrays else v for k, v in meta.items()}
        values["start"] = {
            k: np.array(v) if isinstance(v, list) else v for k, v in meta["start"].items()
        }
        return cls(**values)

    def open_window(self, sim):
        """Averages count from here on."""
        self.window_step, self.window_lengths = sim.step, sim.lengths()
        if sim.box is not None:
            self.window_impulse = sim.impulses()
        if sim.layout.stress:
            self.window_flux = sim.momentum_flux()

    def close_window(self, sim):
        """Averages up to here, kept in mean_force and mean_stress; the next window opens."""
        span = (sim.step - self.window_step) * sim.dt
        if sim.box is not None:
            self.mean_force = (sim.impulses() - self.window_impulse) / span
        if sim.layout.stress:
            self.mean_stress = record.stress(
                sim, self.window_flux, span, self.window_lengths, sim.lengths()
            )
        self.open_window(sim)

    def begin_stage(self, stage, sim):
        self.stage, self.first, self.ended = stage, sim.step, ""
        self.tensions, self.tension_count, self.tension_most = [], 0, 0.0
        self.open_window(sim)

    def past_maximum(self, tension, share):
        """True once the tension [kPa], averaged over the last points, has fallen by `share` below
        the largest such average of the stage."""
        self.tensions = [*self.tensions, tension][-TENSIONS:]
        self.tension_count += 1
        if self.tension_count < TENSIONS:
            return False
        mean = float(np.mean(self.tensions))
        self.tension_most = max(self.tension_most, mean)
        pulled = self.tension_most > 0.0 and self.tension_count >= 2 * TENSIONS
        return pulled and mean < (1.0 - share) * self.tension_most


def _plain(value):
    if isinstance(value, dict):
        return {k: np.asarray(v).tolist() for k, v in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value


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
