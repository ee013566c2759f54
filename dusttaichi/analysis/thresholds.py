"""Threshold speeds of collisions, with confidence intervals by resampling the pairs of bodies."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.analysis.texts import csv_text
from dusttaichi.results.shown import THRESHOLDS

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
    value: Callable[[np.ndarray, np.ndarray], np.ndarray]
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


def register(condition: Condition) -> None:
    """Add a Condition to those of which `thresholds` gives the speed.

    A file that calls it takes effect where it is among the `extensions` of a scene. Raises
    ValueError where another one has the name.
    """
    if any(one.name == condition.name and one != condition for one in conditions()):
        raise ValueError(f"there is a threshold {condition.name}; another name is needed")
    THRESHOLDS[condition.name] = condition


def conditions() -> list[Condition]:
    """The conditions of the package, and then those of extensions."""
    return [STICK, FRAGMENT, *THRESHOLDS.values()]


@dataclass(frozen=True)
class Threshold:
    """One threshold of one body and mass ratio.

    name: of its Condition. speed [m/s]: 0 where it is below all speeds of the study, infinite where
    it is above them. low, high [m/s]: ends of the confidence interval, not a number of one pair.
    filling_factor: mean of the targets within their characteristic radius.
    """

    body: str
    mass_ratio: float
    name: str
    speed: float
    low: float
    high: float
    filling_factor: float


def thresholds(data):
    """A Threshold of each Condition for each body and mass ratio of a `collisions_dataset`.

    Impact parameters have equal weights, so that those of equal areas give means over the area. The
    numbers are means of the pairs that touched at each speed, between speeds linear in the
    logarithm of the speed. The pairs (seeds), which meet at all speeds, are drawn RESAMPLES
    times.
    """
    found = []
    for body, ratio in np.ndindex(data.sizes["body"], data.sizes["mass_ratio"]):
        own = data.isel(body=body, mass_ratio=ratio)
        phi = own.target_filling_factor.values
        phi = float(np.nanmean(phi)) if np.isfinite(phi).any() else np.nan
        about = str(data.body.values[body]), float(data.mass_ratio.values[ratio])
        for condition in conditions():
            speed, low, high = _threshold(own, condition)
            found.append(Threshold(*about, condition.name, speed, low, high, phi))
    return found


def growth_bracket(data, body, ratio):
    """The two speeds [m/s] between which the growth efficiency falls below 0.

    None where it does not do so between two speeds of the study.
    """
    own = data.isel(body=body, mass_ratio=ratio)
    speeds, mean = _course(*_sums(own, FRAGMENT), own.speed.values, FRAGMENT)
    below = np.flatnonzero(mean < 0.0)
    if not len(below) or below[0] == 0:
        return None
    return float(speeds[below[0] - 1]), float(speeds[below[0]])


def _threshold(own, condition):
    total, count = _sums(own, condition)
    speeds, seeds = own.speed.values, total.shape[1]
    best = _crossing(total, count, speeds, condition)
    if seeds < 2:
        return best, np.nan, np.nan
    draws = np.random.default_rng(0).integers(seeds, size=(RESAMPLES, seeds))
    several = np.sort([_crossing(total[:, d], count[:, d], speeds, condition) for d in draws])
    tail = 0.5 * (1.0 - CONFIDENCE)
    ends = np.quantile(several, [tail, 1.0 - tail], method="nearest")
    return best, float(ends[0]), float(ends[1])


def _sums(own, condition):
    """Sum of the quantity that decides, and number of pairs that touched: (speeds, seeds) each."""
    own = own.transpose("speed", "seed", "impact_parameter", ...)
    hit = np.isfinite(own.growth_efficiency.values)
    growth = np.where(hit, own.growth_efficiency.values, 0.0)
    return np.sum(condition.value(own.outcome.values, growth) * hit, axis=2), hit.sum(axis=2)


def _course(total, count, speeds, condition):
    """Speeds at which pairs touched, and the mean over these.

    It falls with the speed unless it rises to the threshold.
    """
    total, count = total.sum(axis=1), count.sum(axis=1)
    there = count > 0
    mean = total[there] / count[there]
    if not condition.rises and len(mean):
        mean = scipy.optimize.isotonic_regression(mean, weights=count[there], increasing=False).x
    return speeds[there], mean


def _crossing(total, count, speeds, condition):
    """Speed at which a course first crosses its threshold [m/s]."""
    speeds, mean = _course(total, count, speeds, condition)
    # what is above 0 before the threshold and below it from there on
    left = condition.limit - mean if condition.rises else mean - condition.limit
    past = np.flatnonzero(left < 0.0)
    if not len(past):
        return np.inf
    n = past[0]
    if n == 0:
        return 0.0
    part = left[n - 1] / (left[n - 1] - left[n])
    return float(speeds[n - 1] * (speeds[n] / speeds[n - 1]) ** part)


def threshold_text(found):
    """The `thresholds` as CSV: speeds in m/s, `inf` above all speeds of the study, 0 below them."""
    names = _names(found)
    columns = [f"v_{n}{end}_m_per_s" for n in names for end in ("", "_low", "_high")]
    table = [["body", "mass_ratio", "target_filling_factor", *columns]]
    for rows in _by_point(found):
        numbers = [v for t in rows for v in (t.speed, t.low, t.high)]
        cells = ["" if np.isnan(v) else f"{v:.4g}" for v in (rows[0].filling_factor, *numbers)]
        table.append([rows[0].body, rows[0].mass_ratio, *cells])
    return csv_text(table)


def threshold_columns(found, speeds):
    """(keys, columns) of a table of the `thresholds`: a row for each body and mass ratio.

    speeds: those of the study [m/s].
    """
    points = _by_point(found)
    keys = [
        ("body", [rows[0].body for rows in points]),
        ("mass ratio", [f"{rows[0].mass_ratio:g}" for rows in points]),
    ]
    columns = [
        (f"v_{name} m/s", [_text(rows[n], speeds) for rows in points])
        for n, name in enumerate(_names(found))
    ]
    return keys, columns


def _names(found):
    return list(dict.fromkeys(threshold.name for threshold in found))


def _by_point(found):
    size = len(_names(found))
    return [found[n : n + size] for n in range(0, len(found), size)]


def _text(threshold, speeds):
    ends = [_bound(v, speeds) for v in (threshold.low, threshold.high)]
    between = "" if np.isnan(threshold.low) else f" ({ends[0]} to {ends[1]})"
    return _bound(threshold.speed, speeds) + between


def _bound(speed, speeds):
    if speed == 0.0:
        return f"< {speeds.min():.3g}"
    return f"> {speeds.max():.3g}" if np.isinf(speed) else f"{speed:.3g}"
