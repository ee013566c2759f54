"""When something happens in a run, in whole steps: a pure function of the step number, so that an
interrupted run goes on with the very same steps."""

from math import floor

from dusttaichi import units
from dusttaichi.names import NEVER


def next_step(interval, clock, step):
    """First step after `step` at which `interval` (scene.output) is due, or NEVER."""
    if interval is None:
        return NEVER
    if interval.steps is not None:
        return (step // interval.steps + 1) * interval.steps
    if interval.time is not None:
        every = interval.time / units.TIME / clock.dt
        k = floor((step + 0.5) / every) + 1
        while (due := floor(k * every + 0.5)) <= step:
            k += 1
        return due
    if interval.strain is not None:
        k = floor(clock.strain_at(step) / interval.strain) + 1
        while (due := clock.step_of_strain(k * interval.strain)) <= step:
            k += 1
        return due
    way = -1 if clock.fills(-1) else 1
    k = floor(way * clock.filling_factor_at(step) / interval.filling_factor) + 1
    while (
        k != 0 and (due := clock.step_of_filling_factor(way * k * interval.filling_factor)) <= step
    ):
        k += 1
    return due if k != 0 else NEVER
