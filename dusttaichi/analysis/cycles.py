"""Loading and unloading: the modulus of a pressed cake on unloading, and its elastic recovery.

A stage that unloads begins under pressure and ends without tension: the height between the walls
(or the cell) grows, and the pressure falls. Its first part is elastic, and its slope is the
unloading modulus, M = dP/d ln h at constant cross section (for a cell pressed from all sides the
bulk modulus, dP/d ln V).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results.datasets import read_at

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.records import Records

SHARE = 0.5  #: Share of the initial pressure of a stage over whose fall the slope is fitted.
FEWEST = 4  #: Least number of records for a slope.


@dataclass(frozen=True)
class Unloading:
    """One stage that unloads."""

    stage: str  #: Name of the stage.
    pressure: float  #: At its start [Pa].
    filling_factor: float  #: At its start.
    #: Slope of the pressure against the logarithm of the volume over the first SHARE of the
    #: pressure [Pa]; NaN for fewer than FEWEST records.
    modulus: float
    modulus_sigma: float  #: 1-sigma uncertainty of the modulus by the scatter about the line [Pa].
    recovered: float  #: ln V after over before, at the end of the stage.
    path: NDArray[np.float64]  #: Pressure of all its records [Pa], (times,).


def measure_unloadings(run: Records) -> list[Unloading]:
    """Unloading of every stage of a run that unloads, in order.

    Raises
    ------
    DustError
        No stage unloads.
    """
    unloadings = [_measure_unloading(stage) for stage in run.parts if stage.unloads]
    if not unloadings:
        raise DustError(f"{run.path}: no stage unloads a pressed sample.")
    return unloadings


def _measure_unloading(stage: Records) -> Unloading:
    start, series = stage.start, stage.series
    phi0, p0 = float(start.filling_factor), float(compute_pressure(start))
    ln_volume = np.log(phi0 / series.filling_factor.values)
    path = compute_pressure(series)
    # a record's pressure is the mean since the one before it
    middle = ln_volume - 0.5 * np.diff(ln_volume, prepend=0.0)
    first = path[0] if len(path) else p0
    used = np.cumprod(path > (1.0 - SHARE) * first).astype(bool)
    slope, sigma = np.nan, np.nan
    if used.sum() >= FEWEST:
        (slope, _), covariance = np.polyfit(middle[used], path[used], 1, cov=True)
        slope, sigma = -slope, np.sqrt(covariance[0, 0])
    return Unloading(
        stage=stage.stage_name,
        pressure=p0,
        filling_factor=phi0,
        modulus=float(slope),
        modulus_sigma=float(sigma),
        recovered=float(ln_volume[-1]),
        path=path,
    )


def compute_pressure(series: xr.Dataset) -> NDArray[np.float64]:
    """Pressure [Pa] of a series, (times,), or of one record: on the top wall, else of the cell."""
    top = read_at(series.pressure, wall="top") if "pressure" in series else np.array(np.nan)
    if "stress" not in series:
        return top
    return np.where(np.isfinite(top), top, compute_cell_pressure(series))


def compute_cell_pressure(series: xr.Dataset) -> NDArray[np.float64]:
    """Mean pressure [Pa] -trace(stress)/3 of a series, (times,), or of one record."""
    stress = series.stress.transpose(..., "xyz", "axis").values
    trace: NDArray[np.float64] = np.trace(stress, axis1=-2, axis2=-1)
    return -trace / 3.0
