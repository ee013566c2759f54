"""Threshold speeds of collisions, with confidence intervals by resampling the pairs of bodies."""

from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.analysis.texts import csv_text

RESAMPLES = 1000
CONFIDENCE = 0.68
"""Confidence of the intervals: that of one standard deviation, like the errors of the table."""

MEANINGS = {
    "stick": "half of the pairs that touch no longer stick (outcome sticking or growth)",
    "bounce": "half of the pairs that touch bounce",
    "fragment": "the mean growth efficiency falls below 0 (Wada et al. 2013)",
}


@dataclass(frozen=True)
class Threshold:
    """One threshold of one body and mass ratio.

    name: of MEANINGS. speed [m/s]: 0 where it is below all speeds of the study, infinite where it
    is above them. low, high [m/s]: ends of the confidence interval, not a number of one pair.
    filling_factor: mean of the targets within their characteristic radius.
    """

    body: str
    mass_ratio: float
    name: str
    speed: float
    low: float
    high: float
    filling_factor: float


def thresholds(data, resamples=RESAMPLES):
    """List of Threshold of a dataset of `collisions_dataset`: three for each body and mass ratio.

    Impact parameters have equal weights, so that those of equal areas give means over the area. The
    numbers are means of the pairs that touched at each speed, between speeds linear in the
    logarithm of the speed; sticking and growth are made to fall with the speed by isotonic
    regression. The pairs (seeds), which meet at all speeds, are drawn `resamples` times.
    """
    found = []
    for body, ratio in np.ndindex(data.sizes["body"], data.sizes["mass_ratio"]):
        own = data.isel(body=body, mass_ratio=ratio)
        phi = own.target_filling_factor.values
        phi = float(np.nanmean(phi)) if np.isfinite(phi).any() else np.nan
        about = str(data.body.values[body]), float(data.mass_ratio.values[ratio])
        for name in MEANINGS:
            speed, low, high = _threshold(own, name, resamples)
            found.append(Threshold(*about, name, speed, low, high, phi))
    return found


def growth_bracket(data, body, ratio):
    """The two speeds [m/s] between which the growth efficiency falls below 0.

    None where it does not do so between two speeds of the study.
    """
    own = data.isel(body=body, mass_ratio=ratio)
    speeds, mean = _course(*_sums(own, "fragment"), own.speed.values, "fragment")
    below = np.flatnonzero(mean < 0.0)
    if not len(below) or below[0] == 0:
        return None
    return float(speeds[below[0] - 1]), float(speeds[below[0]])


def _threshold(own, name, resamples):
    total, count = _sums(own, name)
    speeds, seeds = own.speed.values, total.shape[1]
    best = _crossing(total, count, speeds, name)
    if seeds < 2:
        return best, np.nan, np.nan
    draws = np.random.default_rng(0).integers(seeds, size=(resamples, seeds))
    several = np.sort([_crossing(total[:, d], count[:, d], speeds, name) for d in draws])
    tail = 0.5 * (1.0 - CONFIDENCE)
    ends = np.quantile(several, [tail, 1.0 - tail], method="nearest")
    return best, float(ends[0]), float(ends[1])


def _sums(own, name):
    """Sum of the quantity that decides, and number of pairs that touched: (speeds, seeds) each."""
    own = own.transpose("speed", "seed", "impact_parameter", ...)
    hit = np.isfinite(own.growth_efficiency.values)
    outcome = own.outcome.values
    values = {
        "stick": lambda: np.isin(outcome, ("sticking", "growth")).astype(float),
        "bounce": lambda: (outcome == "bouncing").astype(float),
        "fragment": lambda: np.where(hit, own.growth_efficiency.values, 0.0),
    }[name]()
    return np.sum(values * hit, axis=2), hit.sum(axis=2)


def _course(total, count, speeds, name):
    """Speeds at which pairs touched, and the mean over these.

    It falls with the speed if it should; bouncing is as measured, since it may end again.
    """
    total, count = total.sum(axis=1), count.sum(axis=1)
    there = count > 0
    mean = total[there] / count[there]
    if name != "bounce" and len(mean):
        mean = scipy.optimize.isotonic_regression(mean, weights=count[there], increasing=False).x
    return speeds[there], mean


def _crossing(total, count, speeds, name):
    """Speed at which a course first crosses its threshold [m/s]."""
    speeds, mean = _course(total, count, speeds, name)
    # what is above 0 before the threshold and below it from there on
    left = {"stick": mean - 0.5, "bounce": 0.5 - mean, "fragment": mean}[name]
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
    columns = [f"v_{n}{end}_m_per_s" for n in MEANINGS for end in ("", "_low", "_high")]
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
        for n, name in enumerate(MEANINGS)
    ]
    return keys, columns


def _by_point(found):
    return [found[n : n + len(MEANINGS)] for n in range(0, len(found), len(MEANINGS))]


def _text(threshold, speeds):
    ends = [_bound(v, speeds) for v in (threshold.low, threshold.high)]
    between = "" if np.isnan(threshold.low) else f" ({ends[0]} to {ends[1]})"
    return _bound(threshold.speed, speeds) + between


def _bound(speed, speeds):
    if speed == 0.0:
        return f"< {speeds.min():.3g}"
    return f"> {speeds.max():.3g}" if np.isinf(speed) else f"{speed:.3g}"
