"""Dependence of the strength on the speed of compression."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from dusttaichi.physics.laws import G09_OMNIDIRECTIONAL
from dusttaichi.studies.continuum_fit.fitting import same_rate
from dusttaichi.studies.continuum_fit.observations import observations

COMPARED = (0.2, 0.4)  # filling factors of the comparison with G09
LEAST_SPAN = 0.1  # of a curve within COMPARED


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
    found = []
    for test in tests:
        points = defaultdict(dict)
        for one in observations(test):
            if one.quantity in ("p", "q"):
                points[one.rate].setdefault(one.phi, {})[one.quantity] = one.value
        for number, segment in enumerate(test.segments):
            if segment.kind == "rest" and number and test.segments[number - 1].kind == "press":
                last = slice(-max(len(segment.stress) // 3, 1), None)
                p, q = segment.pressure[last].mean(), segment.difference[last].mean()
                if p > 0 and q > 0:
                    points[0.0][float(segment.phi[-1])] = {"p": p, "q": q}
        for rate, of_rate in points.items():
            whole = sorted((phi, v["p"], v["q"]) for phi, v in of_rate.items() if len(v) == 2)
            if whole:
                phi, p, q = np.array(whole).T
                axial = p + 2.0 / 3.0 * q
                found.append(Curve(test.name, test.seed, test.grains, rate, phi, p, axial))
    return found


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


def speeds(found):
    """A Speed for each rate and number of grains of the Curves within COMPARED."""
    groups = []
    for curve in found:
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
