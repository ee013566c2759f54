"""Bouncing: the speed and the mass from which on half of the pairs bounce.

Named by scenes under `extensions`; after Oshiro et al. 2025 (arXiv:2502.03107).
"""

import numpy as np

from dusttaichi.analysis.thresholds import Condition, register

STEEPNESS = np.linspace(0.0, 8.0, 41)  # b: at 8 from 5 to 95 % within a factor of two in the mass
EXPONENTS = np.linspace(-6.0, 6.0, 61)
BEYOND = np.log(100.0)  # a threshold beyond the masses of a table, at most
HALF = 0.5  # fall of the log likelihood at the ends of an interval of 68 %

BOUNCE = Condition(
    name="bounce",
    meaning="half of the pairs that touch bounce",
    value=lambda outcome, growth: (outcome == "bouncing").astype(float),
    rises=True,  # and may end again
)
register(BOUNCE)


def likelihoods(points, exponents):
    """Log likelihood (T, S, B) on a grid, and its thresholds T (ln N at the mean of ln v).

    A logistic regression, P = 1/(1 + exp(-b (ln N - t - s ln v))), b >= 0, of the threshold mass
    N ~ v^s. points: ln N, ln v, pairs, bouncing, each (n,). exponents: s.
    """
    mass, speed, pairs, bounced = points
    middles = np.linspace(mass.min() - BEYOND, mass.max() + BEYOND, 121)
    t, s, steepness = np.meshgrid(middles, exponents, STEEPNESS, indexing="ij")
    total = np.zeros(t.shape)
    for m, v, n, bounces in zip(mass, speed - speed.mean(), pairs, bounced, strict=True):
        x = steepness * (m - t - s * v)
        total -= bounces * np.logaddexp(0.0, -x) + (n - bounces) * np.logaddexp(0.0, x)
    return total, middles


def interval(values, profile):
    """(best value, low, high); not a number where the interval reaches the end of the values."""
    inside = np.flatnonzero(profile >= profile.max() - HALF)
    low, high = inside[[0, -1]]
    ends = [np.nan if n in (0, len(values) - 1) else values[n] for n in (low, high)]
    return values[profile.argmax()], *ends
