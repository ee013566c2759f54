"""Cells of the map: a scene at an extreme of its parameters, and its result."""

from dataclasses import asdict, dataclass
from math import nan

VERDICTS = ("stable", "refused", "stopped", "WRONG")


@dataclass(frozen=True)
class Cell:
    """One point of the map, as plain numbers and texts for another process.

    scene: the blocks of its YAML. sample: a name of `arrangements` with its numbers, in place of
    the scene's. fraction: time step over the stiffest period of the contacts of the sample, also
    one that a scene would refuse. limit: measure the largest stable step, too. row, column: in the
    figure of the group. time_limit [s]: a longer cell counts as WRONG. kernels: name shared by
    cells with the same compiled kernels, by default that of the row.
    """

    group: str
    name: str
    scene: dict
    sample: dict | None = None
    steps: int = 1000
    fraction: float | None = None
    limit: bool = False
    time_limit: float = 120.0
    row: str = ""
    column: str | float = ""
    kernels: str = ""

    def to_dict(self):
        """Plain data, for another process and for the file of finished cells."""
        return asdict(self)


@dataclass(frozen=True)
class CellResult:
    """Verdict on a cell, with its reason.

    residual: largest of the ledger at any check, relative to run.ledger.turnover. steps: computed.
    dt, estimated, measured [s]: time step and largest stable one, nan where not requested. seconds:
    wall time.
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
