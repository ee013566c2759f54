"""Compression curves: filling factor against pressure on the top wall, and their laws.

A run is driven by strain: its filling factor is known exactly and grows, its pressure fluctuates.
Therefore the curve is smoothed along the filling factor. Where a unique filling factor for each
pressure is needed, isotonic regression makes the pressure grow with the filling factor first.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.analysis.drive import is_dynamic, wall_speed
from dusttaichi.errors import DustError
from dusttaichi.physics import laws

BIN_WIDTH = 0.01
"""Width in filling factor of the bins of a curve; a fifth of it is the default output interval."""

FASTEST = 25.0
"""Wall speed [m/s] up to which S12 eqs 33 and 35 were fitted."""


@dataclass(frozen=True)
class Curve:
    """A compression curve, smoothed and as measured.

    filling_factor, pressure [Pa], count, each (bins,): mean filling factor, median pressure and
    number of points of every bin of filling factor that has a positive pressure.
    raw_filling_factor, raw_pressure [Pa], each (times,). bin_width: in filling factor.
    """

    filling_factor: np.ndarray
    pressure: np.ndarray
    count: np.ndarray
    raw_filling_factor: np.ndarray
    raw_pressure: np.ndarray
    bin_width: float

    def monotone(self):
        """(lg P, filling factor), each (bins,), with lg P strictly growing.

        lg P is the isotonic regression of the bins' lg P on the filling factor, weighted by
        their counts. Where that is flat (the sample gave way), the curve jumps in filling factor.
        """
        if not len(self.pressure):
            return np.zeros(0), np.zeros(0)
        rising = scipy.optimize.isotonic_regression(np.log10(self.pressure), weights=self.count).x
        return rising + 1e-9 * np.arange(len(rising)), self.filling_factor


def compression_curve(run, bin_width=BIN_WIDTH, stage=None, of="filling_factor", peaks=1):
    """The Curve of a Run: bins `bin_width` wide in filling factor, in each the median pressure.

    The median of P is also that of lg P, and single bursts do not shift it. stage: name or number
    (default: all that compress, each beyond the largest filling factor reached before, where an
    unloaded cake returns to the curve of its first loading). of: `filling_factor`, or
    `inner_filling_factor`, that of PD08's inner cylinder between plates. peaks: number of
    successive records whose largest pressure is taken; PD08 (section 3.1.2) took ten, of the
    instantaneous force (a small output.window). Raises DustError where the run has no such filling
    factor or no pressure on the top wall.
    """
    parts = [run.stage(stage)] if stage is not None else _loading(run)
    phi, pressure = np.concatenate([_points(part.series, of, run) for part in parts], axis=1)
    whole = len(phi) // peaks * peaks
    phi = phi[:whole].reshape(-1, peaks).mean(axis=1)
    pressure = pressure[:whole].reshape(-1, peaks).max(axis=1)
    mean, median, count = binned(np.floor(phi / bin_width + 1e-9), phi, pressure)
    up = median > 0
    return Curve(mean[up], median[up], count[up], phi, pressure, bin_width)


def _loading(run):
    """The stages that compress, each beyond the largest filling factor of those before it."""
    parts = [part for part in run.parts if part.compresses]
    if len(parts) < 2:
        return parts or [run]
    reached, loading = -np.inf, []
    for part in parts:
        beyond = part.beyond(reached) if loading else part
        if len(beyond.series.time):
            loading.append(beyond)
            reached = max(reached, float(np.nanmax(beyond.series.filling_factor)))
    return loading


def _points(series, of, run):
    """Filling factor and pressure on the top wall of the records that have both, (2, times)."""
    if of not in series or "pressure" not in series:
        raise DustError(
            f"{run.path} has no compression curve: it has no {of.replace('_', ' ')}, or no "
            "pressure on the top wall."
        )
    phi, pressure = series[of].values, series.pressure.sel(wall="top").values
    known = np.isfinite(phi) & np.isfinite(pressure)
    return np.array([phi[known], pressure[known]])


def binned(numbers, phi, values):
    """Mean of phi, median of values and count in each bin, by growing bin number: (bins,) each.

    numbers: of the bin of each point, (points,).
    """
    rows = [
        (phi[here].mean(), np.median(values[here]), here.sum())
        for here in (numbers == number for number in np.unique(numbers))
    ]
    return np.array(rows).reshape(-1, 3).T


def compression_law(run):
    """The CompressionLaw of the literature for a Run.

    The unidirectional law of the laboratory between plates, where the cake spreads sideways; under
    a wall of 1 to 25 m/s that of S12 for the speed (eq 33); else the static law of S12.
    """
    if run.boundary == "plates":
        return laws.UNIDIRECTIONAL
    speed = wall_speed(run)
    return laws.dynamic_law(speed) if is_dynamic(run) and speed <= FASTEST else laws.S12_STATIC


def onset(curve, rise=0.1):
    """Pressure [Pa] at which a cake starts to yield (PD08 section 3.1), nan if it does not.

    Where `Curve.monotone` crosses (1 + rise) times the filling factor of the curve's first point,
    by linear interpolation of lg P in the filling factor.
    """
    decades, phi = curve.monotone()
    start = curve.raw_filling_factor[0] if len(curve.raw_filling_factor) else np.nan
    crossed = (1.0 + rise) * start
    if not len(phi) or not phi[0] <= crossed <= phi[-1]:
        return np.nan
    return float(10 ** np.interp(crossed, phi, decades))


@dataclass(frozen=True)
class Fit:
    """S12 eq 31 fitted to a curve. `sigma`: name -> 1-sigma uncertainty, 0 of a fixed parameter."""

    law: laws.CompressionLaw
    sigma: dict
    rms: float
    points: int

    @property
    def p_m(self):
        """Pressure p_m [Pa]."""
        return self.law.p_m

    @property
    def delta(self):
        """Width Delta [dex]."""
        return self.law.delta

    @property
    def p_m_sigma(self):
        """1-sigma uncertainty of p_m [Pa]."""
        return self.sigma["p_m"]

    @property
    def delta_sigma(self):
        """1-sigma uncertainty of Delta [dex]."""
        return self.sigma["delta"]


def _decades_wide(curve, least=1e-3):
    """Width of the bins of a Curve in lg P on its monotone form, (bins,), `least` where flat."""
    decades, _ = curve.monotone()
    return np.maximum(np.gradient(decades), least)


def correlation_factor(residual):
    """Factor sqrt((1 + r)/(1 - r)) by which correlated neighbours widen an uncertainty."""
    centred = residual - residual.mean()
    scale = np.sum(centred**2)
    r = np.sum(centred[1:] * centred[:-1]) / scale if scale > 0 else 0.0
    r = min(max(r, 0.0), 0.95)
    return np.sqrt((1 + r) / (1 - r))


def fit_compression(
    curve,
    phi1=0.15,
    phi2=0.58,
    *,
    free=(),
    p_low=0.0,
    p_high=np.inf,
    phi_high=np.inf,
    weights="bins",
):
    """Fit S12 eq 31 to the bins of a Curve between `p_low` and `p_high` [Pa], up to the filling
    factor `phi_high`. Returns a Fit.

    Least squares in the filling factor. weights: "bins", equal for every bin, or "decades", equal
    for every decade of pressure, by the width in lg P of a bin on `Curve.monotone`. p_m (as lg p_m)
    and Delta are free, phi1 and phi2 fixed as in S12 unless `free` names them ("phi1", "phi2");
    between plates phi2 is that of `laws.UNIDIRECTIONAL`. The 1-sigma uncertainties are those of the
    least squares with the scatter of the residuals, times sqrt((1 + r)/(1 - r)) for a correlation
    r > 0 of neighbouring residuals, so that a curve of another form than the law has a wider
    uncertainty. They do not include the scatter between samples and sizes. Raises DustError for too
    few bins, or where no fit is found.
    """
    used = (curve.pressure >= p_low) & (curve.pressure <= p_high)
    used &= curve.filling_factor <= phi_high
    decades, phi = np.log10(curve.pressure[used]), curve.filling_factor[used]
    names = ["p_m", "delta", *free]
    if len(phi) < len(names) + 2:
        raise DustError(
            f"The compression curve has {len(phi)} points: too few to fit {', '.join(names)}. "
            "Compress further, or write the series more often."
        )
    fixed = {"phi1": phi1, "phi2": phi2}

    def values(parameters):
        return fixed | dict(zip(names, parameters, strict=True))

    def model(lg_pressure, *parameters):
        numbers = values(parameters)
        numbers["p_m"] = 10 ** numbers["p_m"]
        return laws.filling_factor(10**lg_pressure, **numbers)

    half = np.interp(0.5 * (phi1 + phi2), phi, decades)
    start = [half, 0.5, *(fixed[name] for name in free)]
    lowest = {"p_m": -2.0, "delta": 1e-3, "phi1": 0.0, "phi2": 0.0}
    highest = {"p_m": 12.0, "delta": 20.0, "phi1": 1.0, "phi2": 1.0}
    bounds = ([lowest[n] for n in names], [highest[n] for n in names])
    try:
        best, covariance = scipy.optimize.curve_fit(
            model,
            decades,
            phi,
            start,
            sigma=None if weights == "bins" else _decades_wide(curve)[used] ** -0.5,
            bounds=bounds,
            max_nfev=10_000,
        )
    except (RuntimeError, ValueError) as error:
        raise DustError(f"No fit of S12 eq 31 to the compression curve: {error}.") from error
    return _as_fit(names, values(best), covariance, phi - model(decades, *best))


def _as_fit(names, numbers, covariance, residual):
    """The Fit of the fitted numbers, `names` of which were free."""
    sigma = np.sqrt(np.diag(covariance)) * correlation_factor(residual)
    widths = {"phi1": 0.0, "phi2": 0.0} | dict(zip(names, sigma, strict=True))
    numbers["p_m"] = 10 ** numbers["p_m"]
    widths["p_m"] = numbers["p_m"] * np.log(10) * widths["p_m"]
    law = laws.CompressionLaw(**{k: float(v) for k, v in numbers.items()}, name="fit")
    rms = float(np.sqrt(np.mean(residual**2)))
    return Fit(law, {k: float(v) for k, v in widths.items()}, rms, len(residual))


@dataclass(frozen=True)
class Deviation:
    """Distance of a curve from a law, in filling factor, over the pressures that it reaches.

    rms, mean (curve less law), largest (of the absolute values); NaN where nothing is covered.
    p_low, p_high [Pa]: the range compared. covered: share of the requested range, in decades.
    """

    rms: float
    mean: float
    largest: float
    p_low: float
    p_high: float
    covered: float

    @property
    def complete(self):
        """True where the whole requested range is covered."""
        return self.covered > 0.999


def rms_from_law(curve, law, p_low=1e3, p_high=1e5, points=201):
    """Difference in filling factor between a Curve and a law, at equally spaced lg P.

    The curve is `Curve.monotone`, interpolated linearly in lg P; where it is flat in P it jumps in
    filling factor. Only pressures that it reaches are compared, without extrapolation: see
    `covered`. law: anything with filling_factor(P). Returns a Deviation.
    """
    first, last = np.log10(p_low), np.log10(p_high)
    decades, phi = curve.monotone()
    if not len(decades) or decades[0] > last or decades[-1] < first:
        return Deviation(*[np.nan] * 5, 0.0)
    low, high = max(first, decades[0]), min(last, decades[-1])
    covered = (high - low) / (last - first)
    grid = np.linspace(low, high, max(int(round(covered * (points - 1))) + 1, 2))
    difference = np.interp(grid, decades, phi) - law.filling_factor(10**grid)
    rms, largest = np.sqrt(np.mean(difference**2)), np.abs(difference).max()
    return Deviation(*map(float, (rms, difference.mean(), largest, 10**low, 10**high, covered)))
