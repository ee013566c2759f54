"""What a run reports of itself while it goes."""

from dataclasses import dataclass


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
