"""A point of a trade: what is changed in the scene, and what its run gave."""

from dataclasses import asdict, dataclass, field

from dusttaichi.analysis.observables import Measured

NUMERICAL, PHYSICAL, SAMPLE = "numerical", "physical", "sample"
KINDS = (NUMERICAL, PHYSICAL, SAMPLE)
"""Kind of change by a parameter: how the same equations are solved or read; the equations or the
way the sample is driven; the sample itself."""


@dataclass(frozen=True)
class Point:
    """One scene to run. changes: as `scenes.changed` takes them.

    paired: its cost is wanted, so a run of the default goes beside it. again: it is run though an
    equal scene has been.
    """

    label: str
    knob: str
    text: str
    value: float
    kind: str
    changes: dict = field(default_factory=dict)
    paired: bool = True
    again: bool = False


@dataclass(frozen=True)
class PointResult:
    """How the run of a point ended.

    code: 0, that of a DustError (2: refused, 3: stopped by a guard), or 1: the process was lost.
    status: how the run ended, or why not. cost [s]: core-seconds of the time steps, or None. ratio:
    of the cost to that of the default beside it, or None. costs: (steps, core-seconds) on the way.
    """

    code: int
    status: str
    cost: float | None = None
    ratio: float | None = None
    steps: int | None = None
    time_step: float | None = None
    ledger: float | None = None
    measured: Measured = field(default_factory=lambda: Measured({}))
    costs: tuple = ((), ())

    @property
    def ok(self):
        """True where the run came to its end."""
        return self.code == 0

    def to_json(self):
        """As plain data, for the file of a finished point."""
        plain = {k: v for k, v in asdict(self).items() if k != "measured"}
        return plain | {"measured": self.measured.to_json()}

    @classmethod
    def from_json(cls, data):
        """From what `to_json` gave."""
        costs = tuple(tuple(column) for column in data["costs"])
        found = Measured.from_json(data["measured"])
        return cls(**(data | {"measured": found, "costs": costs}))
