"""When something happens in a run, in whole steps: a pure function of the step number, so that an
interrupted run goes on with the very same steps."""

from dataclasses import dataclass
from math import ceil, floor

from dusttaichi import units

NEVER = 2**62


@dataclass(frozen=True)
class Clock:
    """Time step [us] and, for a closed box, how its filling factor grows.

    phi(step) = volume / (area (height - speed dt step)); volume of the grains [um^3], area [um^2],
    height at the start [um], speed of the top wall [um/us].
    """

    dt: float
    volume: float = 0.0
    area: float = 0.0
    height: float = 0.0
    speed: float = 0.0

    def height_at(self, step):
        return self.height - self.speed * self.dt * step

    def filling_factor_at(self, step):
        """Filling factor of the box after `step` steps (S12 eq 28)."""
        return self.volume / (self.area * self.height_at(step))

    def step_of_filling_factor(self, phi):
        """First step at which the filling factor is at least phi."""
        if self.filling_factor_at(0) >= phi:
            return 0
        way = self.height - self.volume / (self.area * phi)
        return ceil(way / (self.speed * self.dt) - 1e-9)

    def step_of_height(self, height):
        """First step at which the box is no higher than `height`."""
        if self.speed == 0.0:
            return NEVER
        return max(0, ceil((self.height - height) / (self.speed * self.dt)))

    def steps_in(self, time):
        """Whole steps in a time [us], at least one."""
        return max(1, floor(time / self.dt + 0.5))


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
    k = floor(clock.filling_factor_at(step) / interval.filling_factor) + 1
    while (due := clock.step_of_filling_factor(k * interval.filling_factor)) <= step:
        k += 1
    return due


def last_step(stop, clock, floor_height):
    """Step at which a run ends at the latest, and why; NEVER if only a pressure can end it.

    `floor_height` [um]: a moving top wall is not driven further down than this.
    """
    ends = [(NEVER, "")]
    if stop.steps is not None:
        ends.append((stop.steps, f"{stop.steps} steps"))
    if stop.time is not None:
        ends.append((clock.steps_in(stop.time / units.TIME), f"time {stop.time * 1e6:.6g} us"))
    if stop.filling_factor is not None:
        ends.append(
            (
                clock.step_of_filling_factor(stop.filling_factor),
                f"filling factor {stop.filling_factor:.4g}",
            )
        )
    if clock.area:
        ends.append((clock.step_of_height(floor_height), "the box is two grains high"))
    return min(ends)
