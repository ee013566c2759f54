"""Loading and letting go: how stiff a pressed cake is where it is let go, and what it springs back.

A stage that lets go begins under pressure and ends under no tension: the height between the walls
(or the cell) grows, and the pressure falls. Its first part is elastic, and its slope is the
unloading modulus, M = dP/d ln h at constant cross section (for a cell pressed from all sides the
bulk modulus, dP/d ln V).
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi.errors import DustError

SHARE = 0.5
"""Part of the pressure at which a stage begins that the slope is taken over."""
FEWEST = 4
"""Points of the series that a slope is fitted to, at least."""


@dataclass(frozen=True)
class Release:
    """One stage that lets go.

    stage: its name. pressure [Pa], filling_factor: where it begins. modulus, modulus_sigma [Pa]:
    slope of the pressure against the logarithm of the volume over the first SHARE of the pressure,
    and its 1-sigma uncertainty by the scatter about the line; nan with fewer than FEWEST points.
    recovered: ln V after over before, at its end. ln_volume, path [Pa]: all its points, (times,).
    """

    stage: str
    pressure: float
    filling_factor: float
    modulus: float
    modulus_sigma: float
    recovered: float
    ln_volume: np.ndarray
    path: np.ndarray


def releases(run):
    """The Release of every stage of a Run that lets go, in their order.

    Raises DustError where there is none.
    """
    found = [_release(part) for part in run.parts if part.unloads]
    if not found:
        raise DustError(f"{run.path}: no stage lets go of a pressed sample.")
    return found


def _release(part):
    start, series = part.start, part.series
    phi0, p0 = float(start.filling_factor), float(pressure_of(start))
    ln_volume = np.log(phi0 / series.filling_factor.values)
    path = pressure_of(series)
    # a record's pressure is the mean since the one before it
    middle = ln_volume - 0.5 * np.diff(ln_volume, prepend=0.0)
    first = path[0] if len(path) else p0
    used = np.cumprod(path > (1.0 - SHARE) * first).astype(bool)
    slope, sigma = np.nan, np.nan
    if used.sum() >= FEWEST:
        (slope, _), covariance = np.polyfit(middle[used], path[used], 1, cov=True)
        slope, sigma = -slope, np.sqrt(covariance[0, 0])
    return Release(
        stage=part.stage_name,
        pressure=p0,
        filling_factor=phi0,
        modulus=float(slope),
        modulus_sigma=float(sigma),
        recovered=float(ln_volume[-1]),
        ln_volume=middle,
        path=path,
    )


def pressure_of(series):
    """Pressure [Pa] of a series, (times,), or of one record of it: on the top wall, else the mean
    one of the cell."""
    top = series.pressure.sel(wall="top").values if "pressure" in series else np.nan
    if "stress" not in series:
        return top
    stress = series.stress.transpose(..., "xyz", "axis").values
    return np.where(np.isfinite(top), top, -np.trace(stress, axis1=-2, axis2=-1) / 3.0)
