"""Lengths of the box during a stage, as functions of the step."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from math import exp, floor, inf, isnan, nan
from typing import TYPE_CHECKING

from dusttaichi.units import SI, Units

if TYPE_CHECKING:
    from dusttaichi.domain.drives import Stop


NEVER = 2**62  # a step that no run reaches
FARTHEST = 2**52  # steps beyond this are never reached
LARGEST = 600.0  # exponent beyond which a length is as good as infinite; its powers stay finite


@dataclass(frozen=True)
class Clock:
    """Time step and lengths of the box during a stage, in its `units`.

    Length along axis k at a step: start[k] exp(growth[k] t) + rate[k] t with t = dt step; NaN where
    the box is open. volume: of the grains; least: lengths below which the box is not driven; first:
    step at which the stage began. controlled: numbers of the axes along which a load is controlled,
    whose lengths are known for the current step only. shear: rate, which is part of the strain.
    """

    dt: float
    volume: float = 0.0
    start: tuple[float, ...] = (nan, nan, nan)
    rate: tuple[float, ...] = (0.0, 0.0, 0.0)
    growth: tuple[float, ...] = (0.0, 0.0, 0.0)
    least: tuple[float, ...] = (0.0, 0.0, 0.0)
    first: int = 0
    controlled: tuple[int, ...] = ()
    shear: float = 0.0
    units: Units = SI

    def lengths(self, step: int) -> list[float]:
        """Lengths of the box, a list of three."""
        t = self.dt * step
        return [
            a * exp(min(g * t, LARGEST)) + c * t
            for a, c, g in zip(self.start, self.rate, self.growth, strict=True)
        ]

    def height_at(self, step: int) -> float:
        return self.lengths(step)[2]

    def area_at(self, step: int) -> float:
        """Horizontal area of the box."""
        x, y, _ = self.lengths(step)
        return x * y

    @property
    def moves(self) -> bool:
        """True where some length changes, or a shear."""
        return any((*self.rate, *self.growth, self.shear))

    @property
    def bounded(self) -> bool:
        """True where the box is finite along all axes."""
        return not any(map(isnan, self.start))

    def filling_factor_at(self, step: int) -> float:
        """Filling factor of the box after `step` steps (S12 eq 28)."""
        x, y, z = self.lengths(step)
        return self.volume / (x * y * z) if x > 0.0 and y > 0.0 and z > 0.0 else inf

    def strain_at(self, step: int) -> float:
        """Largest relative change of a length since the start of the stage, or shear since then.

        Lengths that follow a load are left out.
        """
        lengths, first_lengths = self.lengths(step), self.lengths(self.first)
        axes = [n for n in range(3) if not isnan(first_lengths[n]) and n not in self.controlled]
        changes = [abs(lengths[n] / first_lengths[n] - 1.0) for n in axes]
        return max([abs(self.shear) * self.dt * (step - self.first), *changes])

    def step_of_filling_factor(self, phi: float) -> int:
        """First step of the stage at which the filling factor has reached phi, from either side."""
        if self.loosens:
            return self._first(lambda step: self.filling_factor_at(step) <= phi)
        return self._first(lambda step: self.filling_factor_at(step) >= phi)

    @property
    def loosens(self) -> bool:
        """True where the filling factor falls from the first step on."""
        speeds = [self._find_speed(axis) for axis in range(3)]
        return any(v > 0.0 for v in speeds) and not any(v < 0.0 for v in speeds)

    def step_of_strain(self, strain: float) -> int:
        """First step of the stage at which the strain is at least `strain`."""
        return self._first(lambda step: self.strain_at(step) >= strain)

    def step_of_length(self, length: float, axis: int) -> int:
        """First step of the stage at which that length is no more than `length`, or NEVER."""
        if not self.narrows(axis):
            return NEVER
        return self._first(lambda step: self.lengths(step)[axis] <= length)

    def narrows(self, axis: int) -> bool:
        """True where a length shrinks."""
        return self._find_speed(axis) < 0.0

    def _find_speed(self, axis: int) -> float:
        """Speed at which a length grows at the start of the stage; its sign does not change."""
        a, c, g = self.start[axis], self.rate[axis], self.growth[axis]
        return c + g * a * exp(min(g * self.dt * self.first, LARGEST))

    def _first(self, reached: Callable[[int], bool]) -> int:
        """First step of the stage at which a condition is met that, once met, stays so."""
        if reached(self.first):
            return self.first
        low, ahead = self.first, 1
        while not reached(low + ahead):
            low, ahead = low + ahead, 2 * ahead
            if not self.moves or low > FARTHEST:
                return NEVER
        return bisect_left(range(NEVER), True, lo=low + 1, hi=low + ahead, key=reached)

    def steps(self, time: float) -> float:
        """Number of steps in a time [s], with the fraction of the last."""
        return time / self.units("s") / self.dt

    def steps_in(self, time: float) -> int:
        """Number of whole steps in a time [s], at least one."""
        return max(1, floor(self.steps(time) + 0.5))

    def last_step(self, stop: Stop) -> tuple[int, str]:
        """Latest step at which a Stop ends the stage, and the reason.

        NEVER if only a measured quantity can end it. Times and steps count from the start of the
        stage.
        """
        first, ends = self.first, [(NEVER, "")]
        if stop.steps is not None:
            ends.append((first + stop.steps, f"{stop.steps} steps"))
        if stop.time is not None:
            ends.append((first + self.steps_in(stop.time), f"time {stop.time_text}"))
        if stop.strain is not None:
            ends.append((self.step_of_strain(stop.strain), f"strain {stop.strain:.4g}"))
        if stop.filling_factor is not None and self.bounded and not self.controlled:
            step = self.step_of_filling_factor(stop.filling_factor)
            ends.append((step, f"filling factor {stop.filling_factor:.4g}"))
        for axis, word in enumerate(("wide", "deep", "high")):
            is_prescribed = not isnan(self.start[axis]) and axis not in self.controlled
            if is_prescribed and self.moves:
                step = self.step_of_length(self.least[axis], axis)
                narrow = f"two grains {word}" if self.least[axis] else "closed"
                ends.append((step, f"the box is {narrow}"))
        return min(ends)
