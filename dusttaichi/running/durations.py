"""Durations and intervals as the Python interface takes them."""

from __future__ import annotations

import numbers
from typing import TYPE_CHECKING, Any

from dusttaichi.errors import DustError
from dusttaichi.scene.output import Interval
from dusttaichi.scene.quantities import parse

if TYPE_CHECKING:
    from dusttaichi.domain.clock import Clock


def steps_of(duration: int | str, clock: Clock) -> int:
    """Number of steps of a duration, a number of steps or a time. Raises DustError."""
    problem = DustError(
        f'duration = {duration!r}: a number of steps from 0 on or a time such as "1 us" is needed; '
        "a simulation only goes forwards"
    )
    if isinstance(duration, str):
        time = parse(duration, "time", "duration")
        if time < 0.0:
            raise problem
        return clock.steps_in(time)
    step_count = isinstance(duration, numbers.Real) and not isinstance(duration, bool)
    if not (step_count and duration >= 0 and duration % 1 == 0):
        raise problem
    return int(duration)


def interval_of(interval: int | str | dict[str, Any]) -> Interval:
    """An Interval from steps, a time, or a dict as in the YAML. Raises DustError."""
    if isinstance(interval, str):
        interval = {"time": interval}
    elif not isinstance(interval, dict):
        interval = {"steps": interval}
    try:
        return Interval(**interval)
    except ValueError as error:
        raise DustError(
            f'interval = {interval!r}: a number of steps, a time such as "1 us" or a dict such as '
            f"{{'strain': 0.01}} is needed"
        ) from error
