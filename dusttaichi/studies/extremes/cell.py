"""Cells of the map: a scene at an extreme, and how it ends."""

from dataclasses import asdict, dataclass, field
from math import nan

VERDICTS = ("stable", "refused", "stopped", "WRONG")


@dataclass(frozen=True)
class Cell:
    """One point of the map, in plain numbers and texts (it goes to another process).

    group, name: where it stands. scene: the blocks of its YAML. sample: a name of
    `arrangements` with its numbers, in place of the scene's. steps: how many are made. fraction:
    step over the stiffest period of the contacts as they are, past any refusal. limit: measure the
    largest stable step too. coordinates: `row` and `column` of the figure. kernels: name of the
    cells that share their compiled kernels, by default those of its group and row.
    """

    group: str
    name: str
    scene: dict
    sample: dict | None = None
    steps: int = 1000
    fraction: float | None = None
    limit: bool = False
    time_limit: float = 120.0  # s, after which it counts as hanging
    coordinates: dict = field(default_factory=dict)
    kernels: str = ""

    def to_dict(self):
        """As plain data, for another process and for the file of finished cells."""
        return asdict(self)


@dataclass(frozen=True)
class CellResult:
    """How a cell ended, and why.

    residual: largest of the ledger, a share of what went through (run.ledger.turnover),
    seen at any check. steps: made. dt, estimated, measured [s]: the step and the largest stable
    one, nan where not asked for. seconds: of machine time.
    """

    verdict: str
    reason: str = ""
    residual: float = nan
    steps: int = 0
    dt: float = nan
    estimated: float = nan
    measured: float = nan
    seconds: float = nan

    @property
    def ratio(self):
        """Estimated over measured limit."""
        return self.estimated / self.measured
