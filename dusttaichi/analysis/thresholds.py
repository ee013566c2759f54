"""Threshold speeds of collisions, with confidence intervals by resampling the pairs of bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.analysis.collisions import FAILED
from dusttaichi.analysis.outcome import DEFINITIONS
from dusttaichi.results.shown import THRESHOLDS

if TYPE_CHECKING:
    import xarray as xr


RESAMPLES = 1000
CONFIDENCE = 0.68
"""Confidence of the intervals: that of one standard deviation, like the errors of the table."""


@dataclass(frozen=True, kw_only=True)
class Condition:
    """Condition that pairs meet from a threshold speed on.

    name: v_NAME is the threshold. meaning: for tables. value: function from the outcomes and the
    growth efficiencies of pairs, arrays of one shape, to the number whose mean decides. limit: of
    this mean at the threshold. rises: the mean exceeds the limit from there on, and is used as
    measured; otherwise it falls below, and is made to fall with the speed by isotonic regression.
    """

    name: str
    meaning: str
    value: Callable[[NDArray[np.str_], NDArray[np.float64]], NDArray[np.float64]]
    limit: float = 0.5
    rises: bool = False


STICK = Condition(
    name="stick",
    meaning="half of the pairs that touch no longer stick (outcome sticking or growth)",
    value=lambda outcome, growth: np.isin(outcome, ("sticking", "growth")).astype(float),
)
FRAGMENT = Condition(
    name="fragment",
    meaning="the mean growth efficiency falls below 0 (Wada et al. 2013)",
    value=lambda outcome, growth: growth,
    limit=0.0,
)

THRESHOLDS.built_in.update({condition.name: condition for condition in (STICK, FRAGMENT)})


def register(condition: Condition) -> None:
    """Add a Condition to those of which `find_thresholds` gives the speed.

    A file that calls it takes effect where it is among the `extensions` of a scene. Raises
    ValueError where another one has the name.
    """
    THRESHOLDS.add(condition.name, condition)


def list_conditions() -> list[Condition]:
    """The conditions of the package, and then those of extensions."""
    return list(THRESHOLDS.values())


@dataclass(frozen=True)
class Threshold:
    """One threshold of one body and mass ratio.

    name: of its Condition. speed [m/s]: 0 where it is below all `speeds`, infinite where it is
    above them, not a number where there are none. low, high [m/s]: ends of the confidence interval,
    not a number of one pair. filling_factor: mean of the targets within their characteristic
    radius. speeds [m/s]: those at which the collisions with an outcome decide on which side of the
    threshold they are. censored [m/s]: those inside of the interval at which failed collisions
    leave that open.
    """

    body: str
    mass_ratio: float
    name: str
    speed: float
    low: float
    high: float
    filling_factor: float
    speeds: tuple[float, ...] = ()
    censored: tuple[float, ...] = ()


def find_thresholds(data: xr.Dataset) -> list[Threshold]:
    """A Threshold of each Condition for each body and mass ratio of a dataset of collisions.

    Impact parameters have equal weights, so that those of equal areas give means over the area. The
    numbers are means of the pairs that touched at each speed, between speeds linear in the
    logarithm of the speed. The pairs (seeds), which meet at all speeds, are drawn RESAMPLES
    times.

    A speed is censored where the mean is on either side of the limit, depending on the unknown
    outcomes of its failed collisions, and where all of them failed. The estimate leaves it out, and
    the interval reaches to the speeds beside it.
    """
    thresholds = []
    for body, ratio in np.ndindex(data.sizes["body"], data.sizes["mass_ratio"]):
        collisions = data.isel(body=body, mass_ratio=ratio)
        phi = collisions.target_filling_factor.values
        phi = float(np.nanmean(phi)) if np.isfinite(phi).any() else np.nan
        labels = str(data.body.values[body]), float(data.mass_ratio.values[ratio])
        for condition in list_conditions():
            speed, low, high, speeds, censored = _find_threshold(collisions, condition)
            numbers = speed, low, high, phi
            thresholds.append(Threshold(*labels, condition.name, *numbers, speeds, censored))
    return thresholds


def find_growth_bracket(data: xr.Dataset, body: int, ratio: int) -> tuple[float, float] | None:
    """The two speeds [m/s] between which the growth efficiency falls below 0.

    None where it does not do so between two speeds of the study.
    """
    sums = _Sums.from_collisions(data.isel(body=body, mass_ratio=ratio), FRAGMENT)
    speeds, mean = sums.course(sums.count.sum(axis=1) > 0)
    below = np.flatnonzero(mean < 0.0)
    if not len(below) or below[0] == 0:
        return None
    return float(speeds[below[0] - 1]), float(speeds[below[0]])


def _find_threshold(
    collisions: xr.Dataset, condition: Condition
) -> tuple[float, float, float, tuple[float, ...], tuple[float, ...]]:
    """(speed, low, high, speeds that decide, censored speeds) of a Threshold."""
    sums = _Sums.from_collisions(collisions, condition)
    best, *ends = sums.crossing()
    decided = sums.find_decided()
    decisive_speeds = tuple(sums.speeds[decided].tolist())
    if not sums.count.any():
        return np.nan, np.nan, np.nan, decisive_speeds, ()
    seeds = sums.total.shape[1]
    if seeds > 1:
        draws = np.random.default_rng(0).integers(seeds, size=(RESAMPLES, seeds))
        resampled_ends = np.array([sums.resample(draw).crossing()[1:] for draw in draws])
        tail = 0.5 * (1.0 - CONFIDENCE)
        ends = [_compute_quantile(resampled_ends[:, n], q) for n, q in ((0, tail), (1, 1.0 - tail))]
    open_speeds = sums.speeds[~decided & (sums.failed.sum(axis=1) > 0)]
    # above all speeds that decide the interval has no end
    inside = (open_speeds > ends[0]) & (open_speeds < ends[1])
    censored = tuple(open_speeds[inside].tolist())
    if seeds == 1 and not censored:
        ends = [np.nan, np.nan]
    return best, float(ends[0]), float(ends[1]), decisive_speeds, censored


def _compute_quantile(values: NDArray[np.float64], fraction: float) -> float:
    """Quantile of the draws with collisions that decide; not a number without one."""
    crossings = values[~np.isnan(values)]
    return np.quantile(crossings, fraction, method="nearest") if len(crossings) else np.nan


@dataclass(frozen=True)
class _Sums:
    """Collisions of a body and mass ratio, summed over the impact parameters.

    total: sum of the quantity of a Condition over the collisions that touched and have an outcome;
    count, failed: numbers of these and of failed ones; (speeds, seeds) each. ends: lowest and
    largest value of the quantity.
    """

    condition: Condition
    speeds: NDArray[np.float64]
    total: NDArray[np.float64]
    count: NDArray[np.integer]
    failed: NDArray[np.integer]
    ends: tuple[float, float]

    @classmethod
    def from_collisions(cls, collisions: xr.Dataset, condition: Condition) -> _Sums:
        collisions = collisions.transpose("speed", "seed", "impact_parameter", ...)
        hit = np.isfinite(collisions.growth_efficiency.values)
        growth = np.where(hit, collisions.growth_efficiency.values, 0.0)
        value = condition.value(collisions.outcome.values, growth) * hit
        failed = (collisions.outcome.values == FAILED).sum(axis=2)
        ends = _find_ends(condition, float(collisions.mass_ratio))
        return cls(
            condition, collisions.speed.values, value.sum(axis=2), hit.sum(axis=2), failed, ends
        )

    def resample(self, seeds: NDArray[np.integer]) -> _Sums:
        """The same of pairs that are drawn, by their numbers."""
        drawn = self.count[:, seeds], self.failed[:, seeds]
        return _Sums(self.condition, self.speeds, self.total[:, seeds], *drawn, self.ends)

    def find_decided(self) -> NDArray[np.bool_]:
        """True for speeds whose mean is on one side of the limit, however failed ones ended."""
        total, count, failed = (a.sum(axis=1) for a in (self.total, self.count, self.failed))
        largest_count = np.maximum(count + failed, 1)
        low, high = (self._past((total + failed * end) / largest_count) for end in self.ends)
        decided: NDArray[np.bool_] = (count > 0) & (low == high)
        return decided

    def course(
        self, is_selected: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Chosen speeds, and the mean there.

        It falls with the speed unless it rises to the threshold.
        """
        count = self.count.sum(axis=1)[is_selected]
        mean = self.total.sum(axis=1)[is_selected] / count
        if not self.condition.rises and len(mean):
            falling = scipy.optimize.isotonic_regression(mean, weights=count, increasing=False)
            mean = falling.x
        return self.speeds[is_selected], mean

    def crossing(self) -> tuple[float, float, float]:
        """(speed, low, high) [m/s]: where the mean first crosses the limit, and its range.

        low and high differ from it where censored speeds leave it open. Not a number without a
        speed that decides.
        """
        decided = self.find_decided()
        speeds, mean = self.course(decided)
        if not len(speeds):
            return (np.nan, 0.0, np.inf) if self.failed.any() else (np.nan,) * 3
        past = np.flatnonzero(self._past(mean))
        n = past[0] if len(past) else len(speeds)
        below, above = ([0.0, *speeds][n], [*speeds, np.inf][n])
        best = self._interpolate_crossing(speeds, mean, n)
        unknown = self.speeds[~decided & (self.failed.sum(axis=1) > 0)]
        low, high = best, best
        if ((unknown > below) & (unknown < above)).any():
            low, high = below, above
        if self.condition.rises and (unknown < below).any():  # it may have risen before
            low = float(max(speeds[speeds < unknown.min()], default=0.0))
        return best, low, high

    def _interpolate_crossing(
        self, speeds: NDArray[np.float64], mean: NDArray[np.float64], n: int
    ) -> float:
        """Speed before the n-th at which the mean crosses the limit [m/s]."""
        if n in (0, len(speeds)):
            return np.inf if n else 0.0
        distance = np.abs(mean[n - 1 : n + 1] - self.condition.limit)
        return float(speeds[n - 1] * (speeds[n] / speeds[n - 1]) ** (distance[0] / distance.sum()))

    def _past(self, mean: NDArray[np.float64]) -> NDArray[np.bool_]:
        """True for means on the far side of the limit."""
        limit = self.condition.limit
        return mean > limit if self.condition.rises else mean < limit


def _find_ends(condition: Condition, ratio: float) -> tuple[float, float]:
    """(lowest, largest) value of the quantity of a Condition, over all outcomes and growths."""
    growth = np.array([-ratio, 0.0, 1.0])
    names, growths = np.meshgrid(list(DEFINITIONS), growth, indexing="ij")
    values = condition.value(names, growths)
    return float(np.min(values)), float(np.max(values))
