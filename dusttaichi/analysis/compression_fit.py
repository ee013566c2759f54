"""Fit of the compression law S12 eq 31 to a curve, and the distance of a curve from a law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics import laws

if TYPE_CHECKING:
    from dusttaichi.analysis.compression import Curve


# of the fitted numbers, p_m as lg p_m
BOUNDS = {"p_m": (-2.0, 12.0), "delta": (1e-3, 20.0), "phi1": (0.0, 1.0), "phi2": (0.0, 1.0)}


@dataclass(frozen=True)
class Fit:
    """S12 eq 31 fitted to a curve."""

    law: laws.CompressionLaw  #: CompressionLaw with the fitted parameters.
    sigma: dict[str, float]  #: Parameter -> 1-sigma uncertainty, 0 of a fixed parameter.
    rms: float
    points: int

    @property
    def p_m(self) -> float:
        """Pressure p_m [Pa]."""
        return self.law.p_m

    @property
    def delta(self) -> float:
        """Width Delta [dex]."""
        return self.law.delta

    @property
    def p_m_sigma(self) -> float:
        """1-sigma uncertainty of p_m [Pa]."""
        return self.sigma["p_m"]

    @property
    def delta_sigma(self) -> float:
        """1-sigma uncertainty of Delta [dex]."""
        return self.sigma["delta"]


def correlation_factor(residual: NDArray[np.float64]) -> float:
    """Factor sqrt((1 + r)/(1 - r)) by which correlated neighbours widen an uncertainty."""
    centred = residual - residual.mean()
    scale = np.sum(centred**2)
    r = np.sum(centred[1:] * centred[:-1]) / scale if scale > 0 else 0.0
    r = min(max(r, 0.0), 0.95)
    return float(np.sqrt((1 + r) / (1 - r)))


def fit_compression(
    curve: Curve,
    phi1: float = 0.15,
    phi2: float = 0.58,
    *,
    free: Sequence[str] = (),
    phi_high: float = np.inf,
    weights: str = "bins",
) -> Fit:
    """Fit of S12 eq 31 to the bins of a curve, by least squares in the filling factor.

    The 1-sigma uncertainties are those of the least squares with the scatter of the residuals,
    times sqrt((1 + r)/(1 - r)) for a correlation r > 0 of neighbouring residuals, so that a curve
    of another form than the law has a wider uncertainty. They do not include the scatter between
    samples and sizes.

    Parameters
    ----------
    curve : Curve
    phi1 : float
        Filling factor without load.
    phi2 : float
        Filling factor at infinite load; between plates that of `laws.UNIDIRECTIONAL`.
    free : sequence of str
        Fitted beside p_m (as lg p_m) and Delta: "phi1", "phi2".
    phi_high : float
        Upper end of the range of filling factor.
    weights : str
        "bins", equal for every bin, or "decades", equal for every decade of pressure, by the width
        in lg P of a bin on `Curve.monotone`.

    Raises
    ------
    DustError
        Too few bins, or no fit is found.
    """
    used = curve.filling_factor <= phi_high
    decades, phi = np.log10(curve.pressure[used]), curve.filling_factor[used]
    names = ["p_m", "delta", *free]
    if len(phi) < len(names) + 2:
        raise DustError(
            f"The compression curve has too few points ({len(phi)}) to fit {', '.join(names)}. "
            "Compress further, or write the series more often."
        )
    half = np.interp(0.5 * (phi1 + phi2), phi, decades)
    start = {"p_m": half, "delta": 0.5, "phi1": phi1, "phi2": phi2}

    spread = None
    if weights == "decades":  # where the monotone curve is flat a bin has a thousandth of one
        spread = np.maximum(np.gradient(curve.monotone()[0]), 1e-3)[used] ** -0.5
    fitted, deviations, residual = _fit_numbers(decades, phi, start, names, spread)
    deviations *= correlation_factor(residual)
    sigma = {"phi1": 0.0, "phi2": 0.0} | dict(zip(names, map(float, deviations), strict=True))
    sigma["p_m"] = float(fitted["p_m"] * np.log(10) * sigma["p_m"])
    law = laws.CompressionLaw(
        phi1=float(fitted["phi1"]),
        phi2=float(fitted["phi2"]),
        p_m=float(fitted["p_m"]),
        delta=float(fitted["delta"]),
        name="fit",
    )
    return Fit(law, sigma, float(np.sqrt(np.mean(residual**2))), len(residual))


def _fit_numbers(
    decades: NDArray[np.float64],
    phi: NDArray[np.float64],
    start: dict[str, float],
    names: Sequence[str],
    spread: NDArray[np.float64] | None,
) -> tuple[dict[str, float], NDArray[np.float64], NDArray[np.float64]]:
    """Numbers of the law by least squares, deviations of the fitted ones, and the residuals.

    decades: lg P [Pa], and phi: filling factors of the points. start: numbers to begin with, p_m as
    lg p_m as in the deviations; those in `names` are fitted. spread: uncertainties of the points
    over each other, None of equal ones. Raises DustError where no fit is found.
    """

    def complete_numbers(parameters: Sequence[float]) -> dict[str, float]:
        values = start | dict(zip(names, parameters, strict=True))
        return values | {"p_m": 10 ** values["p_m"]}

    def model(lg_pressure: NDArray[np.float64], *parameters: float) -> NDArray[np.float64]:
        return laws.filling_factor(10**lg_pressure, **complete_numbers(parameters))

    try:
        best, covariance = scipy.optimize.curve_fit(
            model,
            decades,
            phi,
            [start[name] for name in names],
            sigma=spread,
            bounds=np.transpose([BOUNDS[name] for name in names]),
            max_nfev=10_000,
        )
    except (RuntimeError, ValueError) as error:
        raise DustError(f"No fit of S12 eq 31 to the compression curve: {error}.") from error
    residual = phi - model(decades, *best)
    return complete_numbers(best), np.sqrt(np.diag(covariance)), residual


@dataclass(frozen=True)
class Deviation:
    """Distance of a curve from a law, in filling factor, over the pressures that it reaches."""

    rms: float  #: Root mean square; NaN where nothing is covered, as are the next two.
    mean: float  #: Mean of curve less law.
    largest: float  #: Largest absolute value.
    p_low: float  #: Lower end of the compared range [Pa].
    p_high: float  #: Upper end of the compared range [Pa].
    covered: float  #: Share of the requested range, in decades.

    @property
    def complete(self) -> bool:
        """True where the whole requested range is covered."""
        return self.covered > 0.999


class CompressionCurve(Protocol):
    """Any law of compression: a filling factor for each pressure [Pa]."""

    def filling_factor(self, pressure: NDArray[np.float64], /) -> NDArray[np.float64]: ...


def measure_deviation(
    curve: Curve, law: CompressionCurve, p_low: float = 1e3, p_high: float = 1e5
) -> Deviation:
    """Difference in filling factor between a curve and a law, at equally spaced lg P.

    The curve is `Curve.monotone`, interpolated linearly in lg P; where it is flat in P it jumps in
    filling factor. Only pressures that it reaches are compared, without extrapolation.

    Parameters
    ----------
    curve : Curve
    law : CompressionCurve
        Such as a CompressionLaw.
    p_low : float
        Lower end of the requested range [Pa].
    p_high : float
        Upper end of the requested range [Pa].
    """
    first, last = np.log10(p_low), np.log10(p_high)
    decades, phi = curve.monotone()
    if not len(decades) or decades[0] > last or decades[-1] < first:
        return Deviation(np.nan, np.nan, np.nan, np.nan, np.nan, covered=0.0)
    low, high = max(first, decades[0]), min(last, decades[-1])
    covered = (high - low) / (last - first)
    grid = np.linspace(low, high, max(int(round(covered * 200)) + 1, 2))
    difference = np.interp(grid, decades, phi) - law.filling_factor(10**grid)
    rms, largest = np.sqrt(np.mean(difference**2)), np.abs(difference).max()
    return Deviation(*map(float, (rms, difference.mean(), largest, 10**low, 10**high, covered)))
