"""A run in progress, as its activities and files use it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from dusttaichi.domain.clock import Clock
    from dusttaichi.method import Engine, Measurement
    from dusttaichi.results.writer import Writer
    from dusttaichi.running.stage_end import End
    from dusttaichi.running.state import Report, RunState
    from dusttaichi.scene.scene import Scene
    from dusttaichi.scene.stage import StagePlan

Records = list[tuple[str, dict[str, Any]]]  # (group, record) of one moment


class Run(Protocol):
    """The members of loop.Run that they use."""

    scene: Scene
    sim: Engine
    state: RunState
    writer: Writer
    plan: StagePlan
    end: End
    report: Callable[[Report], Any]

    @property
    def clock(self) -> Clock:
        """The Clock of the present stage, with the current motion of walls and faces."""

    def guard(self, m: Measurement) -> None:
        """Raise GuardStop if the Measurement is invalid."""

    def record(self, group_name: str) -> Records:
        """Write records of "profiles" or "snapshots" now; returns them."""
