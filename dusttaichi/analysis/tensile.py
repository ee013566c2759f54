"""Stretching: stress against filling factor, and the tensile strength (T19 section 3.1).

The filling factor falls steadily and the stress fluctuates, so the stress is averaged over
windows of the filling factor; the tensile strength is the largest average.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.analysis.compression_fit import correlation_factor
from dusttaichi.analysis.tension import find_longest_axis, find_start_of_tension
from dusttaichi.errors import DustError
from dusttaichi.physics import laws
from dusttaichi.physics.geometry import AXES
from dusttaichi.results.datasets import read_at

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.run import Run


WIDEST = 0.1
"""Largest share by which the filling factor may change within a window (T19 section 3.1)."""

FEWEST = 4  #: Windows at least, also where the filling factor changes by little.

QUIET = 0.02  #: Largest relative uncertainty of the largest average for the default windows.

UNLOADING = 0.05
"""Share of the change of the filling factor up to which windows include the initial unloading."""


@dataclass(frozen=True)
class Tensile:
    """Stress along `axis` while a sample is stretched, in the order of time."""

    axis: str  #: x, y or z.
    filling_factor: NDArray[np.float64]  #: Means over the windows, (windows,).
    stress: NDArray[np.float64]  #: Means [Pa], (windows,).
    sigma: NDArray[np.float64]  #: Uncertainty of the mean stress [Pa], (windows,).
    count: NDArray[np.integer]  #: Number of records, (windows,).
    #: As recorded, in the middle of the averaging time, (times,).
    raw_filling_factor: NDArray[np.float64]
    raw_stress: NDArray[np.float64]  #: As recorded [Pa], (times,).
    window: float  #: Share by which the filling factor falls within a window.
    strength: float  #: Largest mean stress [Pa].
    strength_sigma: float  #: Its uncertainty [Pa].
    strength_phi: float  #: Filling factor there.
    strength_strain: float  #: Strain there, L/L0 - 1 of the cell.
    passed: bool  #: True if the stress has fallen since; otherwise `strength` is a lower limit.
    phi_init: float  #: Filling factor at the start.
    law: float  #: T19 eq 33 for phi_init [Pa], NaN for an unknown material.


def measure_tensile_strength(
    run: Run, axis: str | None = None, windows: int | None = None
) -> Tensile:
    """Tensile test of a run, in the first stage in which the filling factor falls.

    The stress is the virial stress (T19 eq 23), or, where the file has none, the pull on the top
    wall.

    Parameters
    ----------
    run : Run
    axis : str, optional
        x, y or z. Default: that along which the cell grows most; z between walls.
    windows : int, optional
        Number of averaging windows, each with the same relative change of the filling factor.
        Default: the largest number that the noise allows.

    Raises
    ------
    DustError
        Nothing is stretched.

    Notes
    -----
    The default number of windows gives an uncertainty of the maximum below 2 %, a change of the
    filling factor of at most 10 % in a window (T19 section 3.1), and at least FEWEST windows. They
    begin where the stress becomes tensile, if the unloading of a pressed sample takes more than
    UNLOADING of the change of the filling factor.

    The uncertainty of a mean is the scatter of the records around a straight line in the window,
    over sqrt(records), times sqrt((1 + r)/(1 - r)) for a correlation r of neighbouring records. It
    excludes the scatter between samples (T19: standard deviation of ten), and the largest of
    several noisy means is too large by about one of it.
    """
    stage = _find_stretching_stage(run)
    if axis is None:
        axis = AXES[find_longest_axis(stage)] if "box_length" in stage.series else "z"
    duration, raw_phi, raw_stress, edge = _read_records(stage, axis)
    log_phi = np.log(raw_phi)  # even steps of it are even relative changes
    start = _find_end_of_unloading(log_phi, raw_stress)
    duration, phi, stress, edge, log_phi = (
        a[start:] for a in (duration, raw_phi, raw_stress, edge, log_phi)
    )
    noise = _estimate_noise(log_phi, stress)
    if windows is None:
        windows = _choose_window_count(log_phi, stress, duration, noise)
    rows = _average_windows(_assign_windows(log_phi, windows), duration, noise, (phi, stress, edge))
    mean_phi, mean_stress, mean_edge, sigma, count = rows
    full = np.where(count >= 0.5 * np.median(count), mean_stress, -np.inf)
    top = int(np.argmax(full))
    phi_init = float(stage.start.filling_factor)
    start_edge = _read_edge(stage.start, axis)
    strain = mean_edge[top] / start_edge - 1.0 if start_edge else phi_init / mean_phi[top] - 1.0
    return Tensile(
        axis=axis,
        filling_factor=mean_phi,
        stress=mean_stress,
        sigma=sigma,
        count=count.astype(int),
        raw_filling_factor=raw_phi,
        raw_stress=raw_stress,
        window=1.0 - float(np.exp(-np.ptp(log_phi) / windows)),
        strength=float(mean_stress[top]),
        strength_sigma=float(sigma[top]),
        strength_phi=float(mean_phi[top]),
        strength_strain=float(strain),
        passed=top < len(mean_stress) - 1,
        phi_init=phi_init,
        law=compute_strength_law(stage, phi_init),
    )


def _find_stretching_stage(run: Run) -> Run:
    """The first stage that stretches. Raises DustError without one."""
    stage = run.part_that("stretches")
    if not stage.stretches:
        raise DustError(
            f"{stage.path} has no tensile strength: no filling factor that falls, or neither "
            "stress nor a pressure on the top wall."
        )
    return stage


def _find_end_of_unloading(log_phi: NDArray[np.float64], stress: NDArray[np.float64]) -> int:
    """Number of the record at which a long initial unloading ends; 0 without one."""
    start = find_start_of_tension(stress) or 0
    is_short = log_phi[0] - log_phi[start] <= UNLOADING * np.ptp(log_phi)
    return 0 if is_short else start


def compute_strength_law(run: Run, phi: float) -> float:
    """Tensile strength [Pa] of a Run's material at a filling factor (T19 eq 33), NaN without one.

    Parameters
    ----------
    run : Run
    phi : float
    """
    if (m := run.material) is None:
        return np.nan
    return float(laws.tensile_strength(phi, m.surface_energy, m.radius))


def _read_edge(records: xr.Dataset, axis: str) -> NDArray[np.float64] | None:
    """Length of the cell along `axis` [m], or None if unknown."""
    if "box_length" in records:
        return read_at(records.box_length, xyz=axis)
    return records["height"].values if "height" in records and axis == "z" else None


def _read_records(
    stage: Run, axis: str
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """(duration [s], filling factor, stress [Pa], edge [m]) of the records, each (times,).

    The stress of a record is the mean since the one before; filling factor and edge are those in
    the middle of this interval.
    """
    series, start = stage.series, stage.start
    if "stress" in series:
        stress = read_at(series.stress, xyz=axis, axis=axis)
    elif axis != "z":
        raise DustError(f"{stage.path} has no stress along {axis}: only that on the top wall, z.")
    else:
        stress = -read_at(series.pressure, wall="top")
    edge = _read_edge(series, axis)

    def halfway(values: NDArray[np.float64], first: ArrayLike) -> NDArray[np.float64]:
        previous = np.concatenate([[first], values[:-1]])
        return 0.5 * (previous + values)

    duration = np.diff(series.time.values, prepend=float(start.time))
    phi = halfway(series.filling_factor.values, float(start.filling_factor))
    first_edge = _read_edge(start, axis)
    edges = np.full(len(phi), np.nan)
    if edge is not None and first_edge is not None:
        edges = halfway(edge, first_edge)
    is_used = (duration > 0) & np.isfinite(stress) & (phi > 0)
    if not is_used.any():
        raise DustError(f"{stage.path} has no record of the stress along {axis}.")
    return duration[is_used], phi[is_used], stress[is_used], edges[is_used]


def _assign_windows(log_phi: NDArray[np.float64], windows: int) -> NDArray[np.integer]:
    """Number of the window of each record, from 0 in the order of falling filling factor."""
    width = np.ptp(log_phi) / windows or np.inf
    numbers: NDArray[np.integer] = ((log_phi.max() - log_phi) / width).astype(int)
    return numbers.clip(max=windows - 1)


def _estimate_noise(
    log_phi: NDArray[np.float64], stress: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Uncertainty of a single record [Pa], (times,): scatter around a line, with correlation.

    Lines are fitted in windows as wide as allowed, or wide enough for eight records.
    """
    windows = max(min(_count_fewest_windows(log_phi), len(log_phi) // 8), 1)
    window = _assign_windows(log_phi, windows)
    residual, scale = np.zeros(len(log_phi)), np.zeros(len(log_phi))
    for number in np.unique(window):
        in_window = window == number
        if in_window.sum() < 3:  # no scatter about a line
            scale[in_window] = np.nan
            continue
        line = np.polyfit(log_phi[in_window] - log_phi[in_window].mean(), stress[in_window], 1)
        residual[in_window] = stress[in_window] - np.polyval(
            line, log_phi[in_window] - log_phi[in_window].mean()
        )
        scale[in_window] = np.sqrt(np.sum(residual[in_window] ** 2) / (in_window.sum() - 2))
    has_scatter = np.isfinite(scale)
    if not has_scatter.any():
        return np.full(len(log_phi), np.nan)
    scale[~has_scatter] = np.median(scale[has_scatter])
    return scale * correlation_factor(residual)


def _count_fewest_windows(log_phi: NDArray[np.float64]) -> int:
    """Least number of windows: changes by WIDEST at most, and FEWEST for rise, maximum and fall."""
    return max(int(np.ceil(np.ptp(log_phi) / -np.log(1.0 - WIDEST) - 1e-9)), FEWEST)


def _choose_window_count(
    log_phi: NDArray[np.float64],
    stress: NDArray[np.float64],
    duration: NDArray[np.float64],
    noise: NDArray[np.float64],
) -> int:
    fewest = min(_count_fewest_windows(log_phi), len(log_phi))
    windows = len(log_phi)
    while windows > fewest:
        mean, sigma, _ = _average_windows(
            _assign_windows(log_phi, windows), duration, noise, (stress,)
        )
        top = np.argmax(mean)
        if sigma[top] <= QUIET * mean[top]:
            break
        windows = int(windows / 1.25)
    return max(windows, fewest)


def _average_windows(
    window: NDArray[np.integer],
    duration: NDArray[np.float64],
    noise: NDArray[np.float64],
    quantities: Sequence[NDArray[np.float64]],
) -> NDArray[np.float64]:
    """Means of the quantities over each window, then sigma and count: (quantities + 2, windows).

    The means are weighted with the duration of the records; windows without any are left out.
    """
    window = np.unique(window, return_inverse=True)[1]
    count, length = np.bincount(window), np.bincount(window, duration)
    means = [np.bincount(window, duration * values) / length for values in quantities]
    sigma = np.sqrt(np.bincount(window, noise**2)) / count
    return np.array([*means, sigma, count])


@dataclass(frozen=True)
class StrengthFit:
    """Tensile strength = factor * phi_init^exponent [Pa], fitted to several runs."""

    factor: float  #: [Pa].
    exponent: float  #: Exponent of the initial filling factor.
    exponent_sigma: float  #: 1-sigma uncertainty by the scatter of the runs, NaN for two of them.

    def strength(self, phi_init: ArrayLike) -> NDArray[np.float64]:
        """Tensile strength [Pa] at `phi_init`."""
        return self.factor * np.asarray(phi_init, dtype=float) ** self.exponent


def fit_strength(results: Sequence[Tensile]) -> StrengthFit | None:
    """Power law through several tensile tests: least squares in the logarithms, equal weights.

    None where phi_init differs by less than 5 %, or a run has no strength.
    """
    phi = np.array([t.phi_init for t in results])
    strength = np.array([t.strength for t in results])
    if len(phi) < 2 or np.any(strength <= 0) or phi.max() < 1.05 * phi.min():
        return None
    x, sigma = np.log(phi), np.nan
    if len(phi) > 2:
        sigma = np.sqrt(np.polyfit(x, np.log(strength), 1, cov=True)[1][0, 0])
    exponent, factor = np.polyfit(x, np.log(strength), 1)
    return StrengthFit(float(np.exp(factor)), float(exponent), float(sigma))
