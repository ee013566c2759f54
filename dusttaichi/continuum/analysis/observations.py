"""Observations of a material in grain runs: flow pressures, unloading slopes, largest tensions.

And the curves of compression at each rate, beside the law of G09.
"""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from dusttaichi.physics.laws import G09_OMNIDIRECTIONAL

BIN = 0.01  #: Width in filling factor of the averages during a compression.

LEAST_GROWTH = 1.06
"""Smallest filling factor over that of the start: below it a cut cake is not connected."""

LEAST_RECORDS = 8  #: Fewest records of an unloading for its slope.

SETTLING = 0.2
"""Share of an unloading at its start that is left out, because of waves from the reversal."""

UNCERTAIN = 0.5  #: Largest relative error of a slope.

COMPARED = (0.2, 0.4)  # filling factors of the comparison with G09 (p_m of its law)
LEAST_SPAN = 0.1  # of a curve within COMPARED

QUANTITIES = {
    "p": "mean pressure during compression",
    "q": "axial stress minus that at the sides during compression",
    "M": "slope of the axial stress during unloading",
    "lambda": "slope of the stress at the sides during unloading",
    "tension": "largest mean tension (minus the pressure)",
}


@dataclass(frozen=True)
class Observation:
    """One number [Pa] from a test, with the records it is from.

    quantity: of QUANTITIES. error: relative, of value. rows: records of the segment. scale [Pa]:
    unit of differences.
    """

    quantity: str
    segment: int
    phi: float
    value: float
    error: float
    rows: slice
    rate: float
    scale: float


def observations(test):
    """All Observations of a GrainTest."""
    rows = []
    for number, segment in enumerate(test.segments):
        if segment.kind == "press":
            rows += _observe_compression(number, segment, test.phi)
        elif segment.kind == "release":
            rows += _observe_unloading(number, segment, _rate_before(test, number))
        elif segment.kind == "pull":
            rows += _observe_tension(number, segment, _rate_before(test, number))
    return rows


def _rate_before(test, number):
    """Rate of the last compression before a segment [1/s], 0 without one."""
    return next((s.rate for s in test.segments[number::-1] if s.kind == "press"), 0.0)


def seen(quantity, strain, stress):
    """Value [Pa] of a quantity in records: strain (n, 3), stress (n, ..., 3), rows along axis 0."""
    if quantity == "p":
        return stress.mean(axis=-1).mean(axis=0)
    if quantity == "q":
        side = 0.5 * (stress[..., 0] + stress[..., 1])
        return (stress[..., 2] - side).mean(axis=0)
    if quantity == "tension":
        return smooth(-stress.mean(axis=-1)).max(axis=0)
    along = stress[..., 2] if quantity == "M" else 0.5 * (stress[..., 0] + stress[..., 1])
    return -slope(strain[:, 2], along)


def slope(x, y):
    """Slope of a straight line through y (n, ...) against x (n,)."""
    x = x - x.mean()
    return np.tensordot(x, y - y.mean(axis=0), axes=(0, 0)) / (x @ x)


def smooth(values):
    """Running mean of values (n, ...) over a twelfth of them along axis 0, at least three."""
    width = min(max(len(values) // 12, 3), len(values))
    total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), axis=0)
    return (total[width:] - total[:-width]) / width


def middle(strain):
    """Strain in the middle of each interval, (n, 3) of (n + 1, 3)."""
    return 0.5 * (strain[1:] + strain[:-1])


def _observe_compression(number, segment, start):
    bins = np.floor(segment.phi / BIN).astype(int)
    for bin_number in np.unique(bins):
        rows = np.flatnonzero(bins == bin_number)
        phi = float(segment.phi[rows].mean())
        if phi < LEAST_GROWTH * start or len(rows) < 2:
            continue
        records = slice(int(rows[0]), int(rows[-1]) + 1)
        for quantity in ("p", "q"):
            value = float(seen(quantity, None, segment.stress[records]))
            if value > 0:
                yield Observation(quantity, number, phi, value, 0.05, records, segment.rate, value)


def _observe_unloading(number, segment, rate):
    first = int(np.ceil(SETTLING * len(segment.stress)))
    records = slice(first, len(segment.stress))
    if len(segment.stress) - first < LEAST_RECORDS:
        return
    strain, stress = middle(segment.strain)[records], segment.stress[records]
    M = float(seen("M", strain, stress))
    x = strain[:, 2] - strain[:, 2].mean()
    residuals = stress[:, 2] - stress[:, 2].mean() + M * x
    error = float(np.sqrt((residuals @ residuals) / (len(x) - 2) / (x @ x)))
    if M <= 0 or error > UNCERTAIN * M:
        return
    phi = float(segment.phi[records].mean())
    for quantity in ("M", "lambda"):
        value = float(seen(quantity, strain, stress))
        yield Observation(quantity, number, phi, value, max(error / M, 0.05), records, rate, M)


def _observe_tension(number, segment, rate):
    pull = smooth(-segment.pressure)
    top = int(np.argmax(pull))
    if pull[top] > 0 and top < len(pull) - 1:
        phi, value = float(smooth(segment.phi)[top]), float(pull[top])
        rows = slice(0, len(segment.stress))
        yield Observation("tension", number, phi, value, 0.05, rows, rate, value)


def same_rate(rate, other_rate):
    """True for rates within a factor of two."""
    return bool(rate > 0 and other_rate > 0 and 0.5 < rate / other_rate < 2.0)


@dataclass(frozen=True)
class Curve:
    """Stress of one run at one rate of compression; rate 0: at rest after it.

    phi, mean pressure p and axial stress [Pa], each (points,).
    """

    run: str
    seed: int
    grains: int
    rate: float
    phi: np.ndarray
    p: np.ndarray
    axial: np.ndarray

    def p_m(self, which):
        """p_m [Pa] for which the curve of G09, with its phi_1, phi_2 and Delta, fits best.

        which: "p" or "axial". The geometric mean between the filling factors of COMPARED, nan where
        the curve has a smaller span than LEAST_SPAN.
        """
        inside = (self.phi > COMPARED[0]) & (self.phi < COMPARED[1] + 0.005)
        if not inside.any() or np.ptp(self.phi[inside]) < LEAST_SPAN:
            return np.nan
        law = G09_OMNIDIRECTIONAL.pressure(self.phi[inside]) / G09_OMNIDIRECTIONAL.p_m
        return float(np.exp(np.log(getattr(self, which)[inside] / law).mean()))


def curves(tests):
    """Curves of all compressions and the rests after them of GrainTests, by run and rate.

    Without runs whose stages are the first ones of a longer run.
    """
    longest = {}
    for test in tests:
        key = (test.seed, test.grains, test.segments[0].rate)
        if key not in longest or _reach(longest[key]) < _reach(test):
            longest[key] = test
    return _curves(longest.values())


def _reach(test):
    return max((segment.phi.max() for segment in test.segments), default=0.0)


def _curves(tests):
    drawn_curves = []
    for test in tests:
        points = defaultdict(dict)
        for observation in observations(test):
            if observation.quantity in ("p", "q"):
                points[observation.rate].setdefault(observation.phi, {})[observation.quantity] = (
                    observation.value
                )
        for number, segment in enumerate(test.segments):
            if segment.kind == "rest" and number and test.segments[number - 1].kind == "press":
                last = slice(-max(len(segment.stress) // 3, 1), None)
                mean_stress = segment.pressure[last].mean()
                difference = segment.difference[last].mean()
                if mean_stress > 0 and difference > 0:
                    points[0.0][float(segment.phi[-1])] = {"p": mean_stress, "q": difference}
        for rate, of_rate in points.items():
            complete_points = sorted(
                (phi, v["p"], v["q"]) for phi, v in of_rate.items() if len(v) == 2
            )
            if complete_points:
                phi, mean_stress, difference = np.array(complete_points).T
                axial = mean_stress + 2.0 / 3.0 * difference
                drawn_curves.append(
                    Curve(test.name, test.seed, test.grains, rate, phi, mean_stress, axial)
                )
    return drawn_curves


@dataclass(frozen=True)
class Speed:
    """p_m of G09 at one rate [1/s], 0 at rest, for samples with a number of grains.

    axial, p [Pa]: geometric mean over the runs; axial_spread, p_spread: standard deviation of the
    logarithm, nan for one run.
    """

    rate: float
    grains: int
    runs: int
    axial: float
    axial_spread: float
    p: float
    p_spread: float


def speeds(rate_curves):
    """A Speed for each rate and number of grains of the Curves within COMPARED."""
    groups = []
    for curve in rate_curves:
        for group in groups:
            alike = same_rate(group[0].rate, curve.rate) or group[0].rate == curve.rate
            if alike and group[0].grains == curve.grains:
                group.append(curve)
                break
        else:
            groups.append([curve])
    out = []
    for group in groups:
        numbers = [(np.log(c.p_m("axial")), np.log(c.p_m("p"))) for c in group]
        numbers = np.array([n for n in numbers if np.isfinite(n).all()])
        if len(numbers):
            mean = np.exp(numbers.mean(axis=0))
            several = len(numbers) > 1
            spread = numbers.std(axis=0, ddof=1) if several else np.full(2, np.nan)
            out.append(
                Speed(
                    rate=float(np.median([c.rate for c in group])),
                    grains=group[0].grains,
                    runs=len(numbers),
                    axial=float(mean[0]),
                    axial_spread=float(spread[0]),
                    p=float(mean[1]),
                    p_spread=float(spread[1]),
                )
            )
    return sorted(out, key=lambda speed: (speed.rate, speed.grains))
