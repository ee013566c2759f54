"""Defaults that most engines share, for a method to inherit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.method.engine_protocol import Drive, Measurement, State, Window
from dusttaichi.units import SI, Units

if TYPE_CHECKING:
    from dusttaichi.domain.domain import Domain
    from dusttaichi.results.variables import Variable


class SimpleEngine:
    """Defaults that most engines share: a method inherits them and adds only its own.

    A method has to define `dt`, `variables`, `advance` and `measure`, and `stored`: the names of
    the attributes, arrays or numbers, that a checkpoint stores beside `step` and `dt`. By default
    it has no boundary and one particle, and it loses, averages and refuses nothing.
    """

    step: int = 0
    dt: float
    units: Units = SI
    size: int = 1
    variables: tuple[Variable, ...]
    channels: tuple[str, ...] = ()
    step_key: str = "numerics.time_step"
    stored: tuple[str, ...] = ()
    suspect: str = ""

    @property
    def time(self) -> float:
        return self.step * self.dt

    @property
    def domain(self) -> Domain:
        from dusttaichi.domain.domain import Domain

        return Domain(self.dt, units=self.units)

    def drive(self, drive: Drive) -> None:
        """There are no walls and faces that could move."""

    def sums(self) -> dict[str, np.ndarray]:
        return {}

    def series(self, measurement: Measurement, window: Window | None) -> dict[str, Any]:
        return {}

    def snapshot(self) -> dict[str, Any]:
        """The variables of "snapshots" now, beside its time and step."""
        return {}

    def records(self, group: str) -> list[tuple[str, dict[str, Any]]]:
        if group != "snapshots":
            return []
        record = {"snapshot_time": self.time, "step": self.step}
        return [(group, record | self.snapshot())]

    def validate(self, measurement: Measurement) -> None:
        """The guard of the ledger, which is the run's, is enough."""

    def state(self) -> State:
        values = {name: getattr(self, name) for name in ("step", "dt", *self.stored)}
        arrays = {n: v.copy() for n, v in values.items() if isinstance(v, np.ndarray)}
        return State(arrays, {n: v for n, v in values.items() if n not in arrays})

    def view_state(self) -> State:
        return self.state()

    def restore(self, state: State) -> None:
        for name, value in {**state.numbers, **state.arrays}.items():
            setattr(self, name, value.copy() if name in state.arrays else value)

    def sizes(self) -> dict[str, int | tuple[str, ...]]:
        return {"channel": self.channels}

    def constants(self) -> dict[str, np.ndarray]:
        return {}

    def attributes(self) -> dict[str, Any]:
        return {}
