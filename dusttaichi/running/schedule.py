"""Scheduled steps of a run: pure functions of the step, so that a resumed run has the same ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import floor
from typing import TYPE_CHECKING, Any, cast

from dusttaichi.domain.clock import NEVER

if TYPE_CHECKING:
    from dusttaichi.domain.clock import Clock
    from dusttaichi.scene.output import Interval
    from dusttaichi.scene.stage import StagePlan


SNAPSHOTS = 30  # automatic snapshots of a run, enough for playback
LARGEST = 40e6  # bytes of these before compression
STRAIN = 1.0  # over which they are spread if the final strain of the stage is unknown


def next_step(interval: Interval | None, clock: Clock, step: int) -> int:
    """Next step of `interval` (scene.output) after `step`, or NEVER."""
    if interval is None:
        return NEVER
    if interval.steps is not None:
        return (step // interval.steps + 1) * interval.steps
    if interval.time is not None:
        every = clock.steps(interval.time)
        multiple = floor((step + 0.5) / every) + 1
        while (next_due := floor(multiple * every + 0.5)) <= step:
            multiple += 1
        return next_due
    if interval.strain is not None:
        multiple = floor(clock.strain_at(step) / interval.strain) + 1
        while (next_due := clock.step_of_strain(multiple * interval.strain)) <= step:
            multiple += 1
        return next_due
    sign, change = -1 if clock.loosens else 1, cast(float, interval.filling_factor)
    multiple = floor(sign * clock.filling_factor_at(step) / change) + 1
    while (
        multiple != 0
        and (next_due := clock.step_of_filling_factor(sign * multiple * change)) <= step
    ):
        multiple += 1
    return next_due if multiple != 0 else NEVER


def next_record(interval: Interval | None, clock: Clock, step: int, first: int) -> int:
    """Next step of the records of a stage after `step`, or NEVER; first: first step of the stage.

    The first record is at least half an interval long: an average over a few steps has the peak
    with which a wall starts to move.
    """
    due_step = next_step(interval, clock, step)
    following = next_step(interval, clock, due_step) if due_step < NEVER else NEVER
    return (
        following
        if following < NEVER and 2 * (due_step - first) < following - due_step
        else due_step
    )


def bytes_of(records: Iterable[tuple[str, Mapping[str, Any]]]) -> int:
    """Bytes of (group, record) pairs of a frame."""
    return sum(getattr(value, "nbytes", 8) for _, record in records for value in record.values())


def steps_apart(plans: Sequence[StagePlan], clock: Clock, plan: StagePlan, size: int) -> int:
    """Steps between two automatic snapshots of a stage, 0 for none.

    plans: all StagePlans of the scene, of which those with automatic snapshots share their number.
    clock: of the stage, at its start; plan: its StagePlan; size: bytes of its first frame.
    """
    sharing = sum(stage_plan.snapshots == "auto" for stage_plan in plans)
    count = min(SNAPSHOTS, LARGEST // max(size, 1)) // max(sharing, 1)
    end, _ = clock.last_step(plan.stop)
    if end == NEVER and clock.moves:
        end = clock.step_of_strain(STRAIN)
    if count < 2 or end == NEVER:
        return 0
    return max(1, -(-(end - clock.first) // int(count)))
