"""Dynamic compression (S12 section 5.2.2): plateau of the pressure, fits and compaction front.

A wall that outruns the cake piles up a dense layer like a snow plough. Dust at rest of filling
factor phi0 joins a layer of filling factor phi_l that moves with the wall at v. The balance of
momentum gives a pressure rho phi0 v^2 / (1 - phi0/phi_l), that of mass a front at
v / (1 - phi0/phi_l).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.compression import measure_compression_curve
from dusttaichi.analysis.compression_fit import fit_compression
from dusttaichi.analysis.kind import SLOWEST, is_dynamic, measure_wall_speed
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import S12_STATIC
from dusttaichi.results.datasets import read_at

if TYPE_CHECKING:
    from dusttaichi.analysis.compression import Curve
    from dusttaichi.analysis.compression_fit import Fit
    from dusttaichi.analysis.run import Run


PLATEAU = (0.2, 0.4)
"""Filling factors of the box between which the layer has formed and not reached the bottom."""
FITS = (("plateau", "bins"), ("whole", "bins"), ("whole", "decades"))
"""Fits as (bins of the curve, weights): see Dynamic."""
DENSER = 0.2
"""Growth of the filling factor that defines the front: half of that from 0.15 to 0.58."""


@dataclass(frozen=True)
class Dynamic:
    """Results of a compression at constant wall speed, SI; nan where there is none.

    speed: of the top wall [m/s]. plateau, plateau_sigma [Pa]: mean pressure on the top wall between
    the filling factors PLATEAU of the box, and its standard error. momentum [Pa]: pressure by the
    balance of momentum for a layer as dense as the law's phi2. front, front_sigma [m/s]: speed of
    the compaction front. layer: mean filling factor between it and the wall.
    fits: of FITS, (range, weights) -> compression.Fit or None; range "plateau" (bins up to
    PLATEAU[1]) or "whole"; weights "bins" (equal for every bin of the filling factor) or "decades"
    (equal for every decade of pressure).
    """

    speed: float
    plateau: float
    plateau_sigma: float
    momentum: float
    front: float
    front_sigma: float
    layer: float
    fits: dict[tuple[str, str], Fit | None]


def measure_dynamic_compression(run: Run, fits: Iterable[tuple[str, str]] = FITS) -> Dynamic:
    """The Dynamic of a Run that is pressed at a constant speed (`is_dynamic`), with these of FITS.

    Raises DustError for any other run, or one without a material.
    """
    if not is_dynamic(run) or run.material is None:
        raise DustError(
            f"{run.path} is no dynamic compression, which needs a closed box whose top wall moves "
            f"down at a constant speed of {SLOWEST:g} m/s or more."
        )
    speed, phi0 = measure_wall_speed(run), float(run.start.filling_factor)
    plateau, sigma = _measure_plateau(run)
    front, front_sigma, layer = fit_compaction_front(run)
    momentum = run.material.density * phi0 * speed**2 / (1.0 - phi0 / S12_STATIC.phi2)
    curve = measure_compression_curve(run)
    fits = {which: _fit(curve, *which) for which in fits}
    return Dynamic(speed, plateau, sigma, momentum, front, front_sigma, layer, fits)


def _measure_plateau(run: Run) -> tuple[float, float]:
    """Mean pressure on the top wall over the plateau [Pa], and its standard error; nan without."""
    phi = run.series.filling_factor.values
    pressure = read_at(run.series.pressure, wall="top")
    plateau = pressure[(phi >= PLATEAU[0]) & (phi <= PLATEAU[1]) & np.isfinite(pressure)]
    if len(plateau) < 3 or not plateau.any():  # nothing has reached the wall
        return np.nan, np.nan
    return float(plateau.mean()), float(plateau.std(ddof=1) / np.sqrt(len(plateau)))


def _fit(curve: Curve, extent: str, weights: str) -> Fit | None:
    """A compression.Fit, None where the curve does not determine its numbers."""
    phi_high = PLATEAU[1] if extent == "plateau" else np.inf
    try:
        fit = fit_compression(curve, phi_high=phi_high, weights=weights)
    except DustError:
        return None
    return fit if fit.p_m_sigma <= fit.p_m and fit.delta_sigma <= fit.delta else None


def fit_compaction_front(run: Run) -> tuple[float, float, float]:
    """(speed, its 1-sigma [m/s], filling factor behind it) of the compaction front.

    The front of a profile is where the filling factor, from the wall downwards, falls to less than
    DENSER above that of the first profile (S12 section 5.2.2: where both part), linear between the
    middles of bins. Its speed is the slope of a straight line through the fronts; the filling
    factor behind it follows from the mass between front and wall. nan for fewer than three profiles
    on the plateau.
    """
    if run.profiles is None:
        return np.nan, np.nan, np.nan
    profiles = run.profiles
    phi = profiles.filling_factor.transpose("profile", "bin").values
    box = profiles.box_filling_factor.values
    start, middle = phi[0], profiles.bin_height.values
    lower, upper = profiles.bin_lower.values, profiles.bin_upper.values
    heights, times, layers = [], [], []
    for number in np.flatnonzero((box >= PLATEAU[0]) & (box <= PLATEAU[1])):
        top = float(profiles.height.values[number])
        z = _find_front(phi[number] - start, middle, upper <= top)
        if z is None:
            continue
        thick = np.clip(np.minimum(upper, top) - lower, 0.0, None)
        above = np.clip(np.minimum(upper, top) - np.maximum(lower, z), 0.0, None)
        if above.sum() > 0.0:
            mass = np.nan_to_num(phi[number]) * thick
            fraction_above = np.divide(above, thick, out=np.zeros_like(thick), where=thick > 0.0)
            heights.append(z)
            times.append(float(profiles.profile_time.values[number]))
            layers.append(float((mass * fraction_above).sum() / above.sum()))
    if len(heights) < 3:
        return np.nan, np.nan, np.nan
    (slope, _), covariance = np.polyfit(times, heights, 1, cov=True)
    return float(-slope), float(np.sqrt(covariance[0, 0])), float(np.median(layers))


def _find_front(
    denser: NDArray[np.float64], middle: NDArray[np.float64], is_uncut: NDArray[np.bool_]
) -> float | None:
    """Height [m] where `denser` (bins,) falls below DENSER from the top down; None without it.

    is_uncut: the bins that the wall does not cut.
    """
    dense = np.flatnonzero(is_uncut & (denser >= DENSER))
    if not len(dense):
        return None
    below = np.flatnonzero(~(denser[: dense[-1]] >= DENSER))
    if not len(below):
        return None
    n = below[-1] + 1
    fraction = (DENSER - denser[n - 1]) / (denser[n] - denser[n - 1])
    return float(middle[n - 1] + fraction * (middle[n] - middle[n - 1]))
