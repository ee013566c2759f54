"""Compression of a periodic cell from all sides: pressure against filling factor.

Compared with T19 eq 9, or another law.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.compression import bin_medians
from dusttaichi.analysis.cycles import compute_cell_pressure
from dusttaichi.errors import DustError
from dusttaichi.physics import laws
from dusttaichi.results.shown import PRESSURES

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


DECADES = 0.05
"""Width in lg(filling factor) of the bins: the pressure, ~ phi^3, grows by 0.15 dex in one."""

THIN = 0.1  #: Largest filling factor of the comparison with (E_roll/r^3) phi^3 (T19 eq 9).


# pressure [Pa] of filling factors (n,) and of the numbers of find_law_numbers
PressureLaw = Callable[[NDArray[np.float64], float, float, float], NDArray[np.float64]]


@dataclass(frozen=True)
class Isotropic:
    """Mean pressure against filling factor, smoothed and as measured."""

    #: Mean of every bin of lg(filling factor) with a positive pressure, (bins,).
    filling_factor: NDArray[np.float64]
    pressure: NDArray[np.float64]  #: Median pressure of the bins [Pa], (bins,).
    law: NDArray[np.float64]  #: Pressure of the law [Pa], (bins,); NaN for an unknown material.
    ratio: NDArray[np.float64]  #: Median of the pressure over that law, (bins,).
    count: NDArray[np.integer]  #: Number of records of the bins, (bins,).
    raw_filling_factor: NDArray[np.float64]  #: As recorded, (times,).
    raw_pressure: NDArray[np.float64]  #: As recorded [Pa], (times,).

    def ratio_between(self, low: float = 0.0, high: float = THIN) -> Ratio:
        """Pressure over law in the bins with a mean filling factor in a range.

        Parameters
        ----------
        low : float
            Lower end of the range.
        high : float
            Upper end of the range.
        """
        inside = (self.filling_factor >= low) & (self.filling_factor <= high)
        inside &= self.ratio > 0
        if not inside.any():
            return Ratio(*[np.nan] * 4)
        decades, phi = np.log10(self.ratio[inside]), self.filling_factor[inside]
        return Ratio(*map(float, (10 ** np.median(decades), decades.std(), phi[0], phi[-1])))


@dataclass(frozen=True)
class Ratio:
    """Pressure over law, NaN without bins."""

    value: float  #: Median of the bins.
    scatter: float  #: Their standard deviation [dex].
    low: float  #: Lower end of the range of filling factor.
    high: float  #: Upper end of the range of filling factor.


def measure_isotropic_compression(
    run: Run, law: PressureLaw = laws.isotropic_pressure
) -> Isotropic:
    """Mean pressure -trace(stress)/3 of a cell in the first stage that compresses it evenly.

    Parameters
    ----------
    run : Run
    law : function
        Pressure [Pa] from filling factors (n,), and from surface energy [J/m^2], radius and
        critical rolling displacement [m], see `find_law_numbers`. Default: T19 eq 9.

    Raises
    ------
    DustError
        There is no stress or no filling factor.
    """
    series = run.part_that("shrinks").series
    if not {"stress", "filling_factor"} <= set(series):
        raise DustError(
            f"{run.path} has no mean pressure: it needs a filling factor and the stress "
            "(a periodic boundary, or output: stress: on)."
        )
    phi = series.filling_factor.values
    pressure = compute_cell_pressure(series)
    is_finite = np.isfinite(phi) & np.isfinite(pressure) & (phi > 0)
    phi, pressure = phi[is_finite], pressure[is_finite]
    numbers = np.floor(np.log10(phi) / DECADES + 1e-9)
    mean, median, count = bin_medians(numbers, phi, pressure)
    ratio = bin_medians(numbers, phi, pressure / _apply_law(law, run, phi))[1]
    up = median > 0
    columns = mean[up], median[up], _apply_law(law, run, mean[up]), ratio[up]
    return Isotropic(*columns, count[up].astype(int), phi, pressure)


def find_law_numbers(run: Run) -> tuple[float, float, float] | None:
    """Surface energy [J/m^2], radius and critical rolling displacement [m] of a law for a run.

    The displacement is times `interaction.rolling.modifier`: a stiffer spring needs as many times
    more work E_roll until grains roll. None for an unknown material, or grains that roll freely.
    """
    material = run.material
    rolling = run.scene.get("interaction", {}).get("rolling", {})
    modifier = float(rolling.get("modifier", 1.0)) if isinstance(rolling, dict) else 0.0
    if material is None or modifier == 0.0:
        return None
    return material.surface_energy, material.radius, modifier * material.critical_rolling


def register(label: str, law: PressureLaw) -> None:
    """Draw a law beside T19 eq 9 in figures of the pressure; for extensions.

    Parameters
    ----------
    label : str
        Its label in the legend.
    law : function
        As for `measure_isotropic_compression`.
    """
    PRESSURES.replace(label, law)


def _apply_law(law: PressureLaw, run: Run, phi: NDArray[np.float64]) -> NDArray[np.float64]:
    numbers = find_law_numbers(run)
    return np.full(len(phi), np.nan) if numbers is None else law(phi, *numbers)
