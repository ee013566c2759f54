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


def last_step(stop, clock):
    """Step at which a stage ends at the latest, and why; NEVER if only a pressure can end it.

    Times and steps count from the start of the stage.
    """
    first, ends = clock.first, [(NEVER, "")]
    if stop.steps is not None:
        ends.append((first + stop.steps, f"{stop.steps} steps"))
    if stop.time is not None:
        steps = clock.steps_in(stop.time / units.TIME)
        ends.append((first + steps, f"time {stop.time * 1e6:.6g} us"))
    if stop.strain is not None:
        ends.append((clock.step_of_strain(stop.strain), f"strain {stop.strain:.4g}"))
    if stop.filling_factor is not None and clock.bounded:
        ends.append(
            (
                clock.step_of_filling_factor(stop.filling_factor),
                f"filling factor {stop.filling_factor:.4g}",
            )
        )
    for axis, way in enumerate(("wide", "deep", "high")):
        if clock.start[axis] == clock.start[axis] and clock.moves:
            ends.append(
                (clock.step_of_length(clock.least[axis], axis), f"the room is two grains {way}")
            )
    return min(ends)
