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

THIN = 0.1  #: Largest filling factor of the comparison with (E_roll/r^3) phi^3 (T19 eq 9).

DENSE = 0.105
"""Smallest filling factor of the comparison with Tatsuuma et al. 2023: no bin of runs to 0.1."""


@dataclass(frozen=True)
class Isotropic:
    """Mean pressure against filling factor, smoothed and as measured."""

    #: Mean of every bin of lg(filling factor) with a positive pressure, (bins,).
    filling_factor: np.ndarray
    pressure: np.ndarray  #: Median pressure of the bins [Pa], (bins,).
    #: (E_roll/r^3) phi^3 [Pa], (bins,); NaN for an unknown material, as are the ratios.
    law: np.ndarray
    ratio: np.ndarray  #: Median of the pressure over that law, (bins,).
    #: The same over (E_roll/r^3) (1/phi - 1/0.74)^-3 of Tatsuuma et al. 2023, (bins,).
    dense_ratio: np.ndarray
    count: np.ndarray  #: Number of records of the bins, (bins,).
    raw_filling_factor: np.ndarray  #: As recorded, (times,).
    raw_pressure: np.ndarray  #: As recorded [Pa], (times,).

    def ratio_between(self, low=0.0, high=THIN) -> "Ratio":
        """Pressure over law in the bins with a mean filling factor in a range.

        Parameters
        ----------
        low : float
            Lower end of the range.
        high : float
            Upper end of the range.
        """
        return self._between(self.ratio, low, high)

    def dense_ratio_between(self, low=DENSE, high=1.0) -> "Ratio":
        """Pressure over the law of Tatsuuma et al. 2023, likewise.

        Parameters
        ----------
        low : float
            Lower end of the range of filling factor.
        high : float
            Upper end of the range of filling factor.
        """
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
    """Pressure over law, NaN without bins."""

    value: float  #: Median of the bins.
    scatter: float  #: Their standard deviation [dex].
    low: float  #: Lower end of the range of filling factor.
    high: float  #: Upper end of the range of filling factor.


def isotropic(run, stage=None, decades=DECADES) -> Isotropic:
    """Mean pressure -trace(stress)/3 of a cell that is compressed from all sides.

    Parameters
    ----------
    run : Run
    stage : str or int, optional
        Default: the first in which the cell shrinks equally along all axes.
    decades : float
        Width of the bins in lg(filling factor).

    Raises
    ------
    DustError
        There is no stress or no filling factor.
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
