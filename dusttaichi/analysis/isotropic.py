"""Compression of a periodic cell from all sides: pressure against filling factor.

Compared with T19 eq 9 and Tatsuuma et al. 2023.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.compression import binned
from dusttaichi.analysis.cycles import cell_pressure
from dusttaichi.errors import DustError
from dusttaichi.physics import laws

DECADES = 0.05
"""Width in lg(filling factor) of the bins: the pressure, ~ phi^3, grows by 0.15 dex in one."""

THIN = 0.1
"""Largest filling factor of the comparison with (E_roll/r^3) phi^3 (T19 eq 9)."""

DENSE = 0.105
"""Smallest filling factor of the comparison with Tatsuuma et al. 2023: no bin of runs to 0.1."""


@dataclass(frozen=True)
class Isotropic:
    """Mean pressure against filling factor, smoothed and as measured.

    filling_factor, pressure [Pa], law [Pa], count, each (bins,): mean filling factor, median
    pressure and (E_roll/r^3) phi^3 in every bin of lg(filling factor) with a positive pressure.
    ratio, dense_ratio (bins,): median of the pressure over that law, and over (E_roll/r^3)
    (1/phi - 1/0.74)^-3 of Tatsuuma et al. 2023. law and the ratios are nan for an unknown material.
    raw_filling_factor, raw_pressure [Pa], each (times,).
    """

    filling_factor: np.ndarray
    pressure: np.ndarray
    law: np.ndarray
    ratio: np.ndarray
    dense_ratio: np.ndarray
    count: np.ndarray
    raw_filling_factor: np.ndarray
    raw_pressure: np.ndarray

    def ratio_between(self, low=0.0, high=THIN):
        """The Ratio of pressure and law over the bins with a mean filling factor in the range."""
        return self._between(self.ratio, low, high)

    def dense_ratio_between(self, low=DENSE, high=1.0):
        """The same as `ratio_between`, of the law of Tatsuuma et al. 2023."""
        return self._between(self.dense_ratio, low, high)

    def _between(self, ratio, low, high):
        inside = (self.filling_factor >= low) & (self.filling_factor <= high)
        inside &= ratio > 0
        if not inside.any():
            return Ratio(*[np.nan] * 4)
        decades, phi = np.log10(ratio[inside]), self.filling_factor[inside]
        return Ratio(*map(float, (10 ** np.median(decades), decades.std(), phi[0], phi[-1])))


@dataclass(frozen=True)
class Ratio:
    """Pressure over law, nan without bins.

    value: median of the bins; scatter: their standard deviation [dex]; low, high: range of filling
    factor.
    """

    value: float
    scatter: float
    low: float
    high: float


def isotropic(run, stage=None, decades=DECADES):
    """The Isotropic of a Run: the mean pressure is -trace(stress)/3.

    stage: name or number (default: the first in which the cell shrinks equally along all axes).
    decades: width of the bins in lg(filling factor). Raises DustError without stress or filling
    factor.
    """
    series = run.part_that("shrinks", stage).series
    if not {"stress", "filling_factor"} <= set(series):
        raise DustError(
            f"{run.path} has no mean pressure: it needs a filling factor and the stress "
            "(a periodic boundary, or output: stress: on)."
        )
    phi = series.filling_factor.values
    pressure = cell_pressure(series)
    known = np.isfinite(phi) & np.isfinite(pressure) & (phi > 0)
    phi, pressure = phi[known], pressure[known]
    law, dense = _law(run, phi), _law(run, phi, laws.compressive_strength)
    numbers = np.floor(np.log10(phi) / decades + 1e-9)
    mean, median, count = binned(numbers, phi, pressure)
    ratio, dense = (binned(numbers, phi, pressure / one)[1] for one in (law, dense))
    up = median > 0
    columns = mean[up], median[up], _law(run, mean[up]), ratio[up], dense[up]
    return Isotropic(*columns, count[up].astype(int), phi, pressure)


def _law(run, phi, law=laws.isotropic_pressure):
    m = run.material
    if m is None:
        return np.full(len(phi), np.nan)
    return law(phi, m.surface_energy, m.radius, m.critical_rolling)
