"""State of a run beside that of its simulation, part of every checkpoint; and
what it reports of itself meanwhile."""

from dataclasses import asdict, dataclass, field

import numpy as np

from dusttaichi.method import Start, Window


@dataclass
class Tension:
    """The last points of the series of a stage, for stop.past_maximum: their tensions [kPa], how
    many points there have been, and the largest average so far."""

    last: list = field(default_factory=list)
    count: int = 0
    most: float = 0.0


@dataclass
class RunState:
    """How far a run has come.

    start: energies of step 0. stage: its number; first: its first step; ended: why it has ended
    before its last step was known, or "". last_snapshot: step of the last frame written, or -1;
    frame_bytes: what it took; apart: steps between two, where the scene leaves that to the run.
    opened: step at which the average of the next record begins; sums: of that step. pressures
    [Pa]: of the last points of the stage, for stop.plateau; settling: (time [s], logarithm of the
    filling factor, load over that held) of these, for stop.creep. wall_clock: real time spent [s].
    """

    start: Start
    stage: int = 0
    first: int = 0
    ended: str = ""
    last_snapshot: int = -1
    frame_bytes: int = 0
    apart: int = 0
    opened: int = 0
    sums: dict[str, np.ndarray] = field(default_factory=dict)
    tension: Tension = field(default_factory=Tension)
    pressures: list[float] = field(default_factory=list)
    settling: list[list[float]] = field(default_factory=list)
    wall_clock: float = 0.0

    def begin_stage(self, stage, step):
        """The next stage begins at this step."""
        self.stage, self.first, self.ended, self.tension = stage, step, "", Tension()
        self.pressures, self.settling = [], []

    def open_window(self, sim):
        """The average of the next record begins at this step."""
        self.opened, self.sums = sim.step, sim.sums()

    def close_window(self, sim):
        """The Window that ends at this step; the next one opens."""
        opened, before = self.opened, self.sums
        self.open_window(sim)
        return Window(before, self.sums, (sim.step - opened) * sim.dt)

    def to_meta(self):
        """Plain data that JSON can hold."""
        return asdict(self) | {"sums": {k: np.asarray(v).tolist() for k, v in self.sums.items()}}

    @classmethod
    def from_meta(cls, meta):
        own = {
            "start": Start(**meta["start"]),
            "tension": Tension(**meta["tension"]),
            "sums": {name: np.array(values) for name, values in meta["sums"].items()},
        }
        return cls(**(meta | own))


@dataclass
class Report:
    """How far a run is, for whoever shows it.

    filling_factor, pressure [Pa]: None where there is none. task: what goes on, where it is not the
    run itself.
    """

    step: int
    end: int
    filling_factor: float | None
    pressure: float | None
    steps_per_second: float
    task: str = ""
