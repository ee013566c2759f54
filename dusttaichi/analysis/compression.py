"""Compression curves: filling factor against pressure on the top wall, and their laws.

A run is driven by strain: its filling factor is known exactly and grows, its pressure fluctuates.
Therefore the curve is smoothed along the filling factor. Where a unique filling factor for each
pressure is needed, isotonic regression makes the pressure grow with the filling factor first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.analysis.kind import is_dynamic, measure_wall_speed
from dusttaichi.analysis.profile import average_inner_filling_factor
from dusttaichi.errors import DustError
from dusttaichi.physics import laws
from dusttaichi.results.datasets import read_at

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


BIN_WIDTH = 0.01
"""Width in filling factor of the bins of a curve; a fifth of it is the default output interval."""

INNER = "inner_filling_factor"
FASTEST = 25.0  #: Wall speed [m/s] up to which S12 eqs 33 and 35 were fitted.


@dataclass(frozen=True)
class Curve:
    """A compression curve, smoothed and as measured."""

    #: Mean of every bin of filling factor that has a positive pressure, (bins,).
    filling_factor: NDArray[np.float64]
    pressure: NDArray[np.float64]  #: Median pressure of the bins [Pa], (bins,).
    count: NDArray[np.float64]  #: Number of points of the bins, (bins,).
    raw_filling_factor: NDArray[np.float64]  #: As recorded, (times,).
    raw_pressure: NDArray[np.float64]  #: As recorded [Pa], (times,).

    def monotone(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The curve as (lg P, filling factor), each (bins,), with lg P strictly growing.

        lg P is the isotonic regression of the bins' lg P on the filling factor, weighted by their
        counts. Where that is flat (the sample gave way), the curve jumps in filling factor.
        """
        if not len(self.pressure):
            return np.zeros(0), np.zeros(0)
        rising = np.log10(self.pressure)
        if (np.diff(rising) < 0.0).any():  # scipy.optimize takes 0.2 s to import
            rising = scipy.optimize.isotonic_regression(rising, weights=self.count).x
        return rising + 1e-9 * np.arange(len(rising)), self.filling_factor


def measure_compression_curve(
    run: Run, bin_width: float = BIN_WIDTH, quantity: str = "filling_factor", peaks: int = 1
) -> Curve:
    """Compression curve of a run: the median pressure in bins of filling factor.

    The median of P is also that of lg P, and single bursts do not shift it. All stages that
    compress count, each beyond the largest filling factor reached before, where an unloaded cake
    returns to the curve of its first loading.

    Parameters
    ----------
    run : Run
    bin_width : float
        Width of a bin in filling factor.
    quantity : str
        "filling_factor", or "inner_filling_factor": that of PD08's inner cylinder between plates,
        otherwise that of the profiles without their ends (`profile.average_inner_filling_factor`).
    peaks : int
        Number of successive records whose largest pressure is taken; PD08 (section 3.1.2) took ten,
        of the instantaneous force (a small output.window).

    Raises
    ------
    DustError
        The run has no such filling factor or no pressure on the top wall.
    """
    phi, pressure = np.concatenate(
        [_read_points(stage, quantity) for stage in _select_loading_stages(run)], axis=1
    )
    used_records = len(phi) // peaks * peaks
    phi = phi[:used_records].reshape(-1, peaks).mean(axis=1)
    pressure = pressure[:used_records].reshape(-1, peaks).max(axis=1)
    mean, median, count = bin_medians(np.floor(phi / bin_width + 1e-9), phi, pressure)
    up = median > 0
    return Curve(mean[up], median[up], count[up], phi, pressure)


def _select_loading_stages(run: Run) -> list[Run]:
    """The stages that compress, each beyond the largest filling factor of those before it."""
    stages = [stage for stage in run.parts if stage.compresses]
    if len(stages) < 2:
        return stages or [run]
    largest_phi: float = -np.inf
    loading: list[Run] = []
    for stage in stages:
        new_records = stage.beyond(largest_phi) if loading else stage
        if len(new_records.series.time):
            loading.append(new_records)
            largest_phi = max(
                largest_phi, float(np.nanmax(new_records.series.filling_factor.values))
            )
    return loading


def _read_points(stage: Run, quantity: str) -> NDArray[np.float64]:
    """Filling factor and pressure on the top wall of the records that have both, (2, times)."""
    series, phi = stage.series, None
    if quantity in series:
        phi = series[quantity].values
    elif quantity == INNER and stage.profiles is not None:
        profile_steps, inner_phi = (
            stage.profiles.step.values,
            average_inner_filling_factor(stage.profiles),
        )
        phi = np.interp(series.step.values, profile_steps, inner_phi, left=np.nan, right=np.nan)
    if phi is None or "pressure" not in series:
        raise DustError(
            f"{stage.path} has no compression curve: it has no {quantity.replace('_', ' ')}, or no "
            "pressure on the top wall."
        )
    pressure = read_at(series.pressure, wall="top")
    is_finite = np.isfinite(phi) & np.isfinite(pressure)
    return np.array([phi[is_finite], pressure[is_finite]])


def bin_medians(
    numbers: NDArray[np.float64], phi: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mean of phi, median of values and count in each bin, by growing bin number: (bins,) each.

    numbers: of the bin of each point, (points,).
    """
    rows = [
        (phi[in_bin].mean(), np.median(values[in_bin]), in_bin.sum())
        for in_bin in (numbers == number for number in np.unique(numbers))
    ]
    return np.array(rows).reshape(-1, 3).T


def choose_compression_law(run: Run) -> laws.CompressionLaw:
    """Compression law of the literature that applies to a run.

    Between plates, where the cake spreads sideways, the unidirectional law of the laboratory; under
    a wall of 1 to 25 m/s that of S12 for the speed (eq 33); otherwise the static law of S12.
    """
    if run.boundary == "plates":
        return laws.UNIDIRECTIONAL
    speed = measure_wall_speed(run)
    return laws.dynamic_law(speed) if is_dynamic(run) and speed <= FASTEST else laws.S12_STATIC


def find_onset(curve: Curve, rise: float = 0.1) -> float:
    """Pressure [Pa] at which a cake starts to yield (PD08 section 3.1).

    It is where `Curve.monotone` crosses (1 + rise) times the filling factor of the curve's first
    point, by linear interpolation of lg P in the filling factor.

    Parameters
    ----------
    curve : Curve
    rise : float
        Relative increase of the filling factor.

    Returns
    -------
    float
        NaN if the cake does not yield.
    """
    decades, phi = curve.monotone()
    start = curve.raw_filling_factor[0] if len(curve.raw_filling_factor) else np.nan
    crossed = (1.0 + rise) * start
    if not len(phi) or not phi[0] <= crossed <= phi[-1]:
        return np.nan
    return float(10 ** np.interp(crossed, phi, decades))
