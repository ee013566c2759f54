"""Engine of named parts, of which every method of this package has one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dusttaichi.method.engine_protocol import Drive, Measurement
from dusttaichi.method.simple import SimpleEngine

if TYPE_CHECKING:
    from dusttaichi.domain.domain import Domain
    from dusttaichi.domain.environment import Environment


class EngineOfParts(SimpleEngine):
    """Engine whose parts know time, walls and energies; a method has further parts.

    Attributes
    ----------
    environment
        Walls and cell at the present step.
    ledger
        Measures energies, losses and work.
    stepper
        Makes steps, and moves walls and faces.
    workers
        Number of workers of the steps (compute.worker_choice.WorkerChoice).
    """

    environment: Environment
    ledger: Any
    stepper: Any
    workers: Any

    @property
    def step(self) -> int:  # type: ignore[override]
        return self.environment.step

    @property
    def dt(self) -> float:  # type: ignore[override]
        return self.environment.dt

    @property
    def domain(self) -> Domain:
        return self.environment.domain

    def advance(self, steps: int) -> None:
        self.workers.advance(steps)

    def drive(self, drive: Drive) -> None:
        self.stepper.drive(drive)

    def measure(self) -> Measurement:
        measurement: Measurement = self.ledger.measure()
        return measurement
