"""Structure of a sample: number of grains within a distance of a grain (T19 Fig 10)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import neighbours_within

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


CENTRES = 10_000  #: Random grains about which others are counted, where there are more.
SMALL_SCALE = 20.0
"""Number of grains up to which T19 section 4.1 finds the fractal dimension of the aggregates."""


@dataclass(frozen=True)
class Fractal:
    """Mean number of other grains nearer than r_in, in some snapshots."""

    radius_in: NDArray[np.float64]  #: Distances r_in [m], (radii,).
    number: NDArray[np.float64]  #: N(r < r_in) without the central grain, (snapshots, radii).
    slope: NDArray[np.float64]  #: d ln N / d ln r_in, (snapshots, radii); NaN where N is 0.
    #: Slope of a line through ln N over the radii beyond contact with N <= 20, (snapshots,); NaN
    #: for fewer than three of them.
    dimension: NDArray[np.float64]
    time: NDArray[np.float64]  #: [s], (snapshots,).
    filling_factor: NDArray[np.float64]  #: (snapshots,), or NaN.
    grain_radius: float  #: [m].


def measure_fractal(
    run: Run, snapshots: Sequence[int] | None = None, radii: ArrayLike | None = None
) -> Fractal:
    """Number of grains within a distance of a grain, images of periodic cells included.

    The mean is over all grains, over CENTRES random ones where there are more. The stage is the
    first that stretches, if any.

    Parameters
    ----------
    run : Run
    snapshots : sequence of int, optional
        Numbers in the run or stage. Default: five at most, from the first to the last.
    radii : array, optional
        Growing radii [m], (radii,). Default: 30 from 2.1 grain radii to half of the largest extent.

    Raises
    ------
    DustError
        There are no snapshots.
    """
    stage = run.part_that("stretches")
    stored = stage.snapshots
    if stored is None or not stored.sizes["snapshot"]:
        raise DustError(f"{run.path} has no snapshots: set output: snapshots in the scene.")
    if "tilt" in stored:
        raise DustError(f"{run.path}: its cell is sheared; allowed: cells without a tilt.")
    if snapshots is None:
        evenly = np.linspace(0, stored.sizes["snapshot"] - 1, 5).round().astype(int)
        snapshots = np.unique(evenly).tolist()
    r = float(stored.radius.max())
    frames = [(n, stored.isel(snapshot=n).load()) for n in snapshots]
    if radii is None:
        extent = max(float(np.ptp(f.position.values, axis=0).max()) for _, f in frames)
        radii = np.geomspace(2.1 * r, max(0.5 * extent, 4.0 * r), 30)
    radii = np.asarray(radii, dtype=float)
    counts = [
        neighbours_within(f.position.values, radii, stage.period(n), CENTRES) for n, f in frames
    ]
    number = np.array(counts)
    time = np.array([float(f.snapshot_time) for _, f in frames])
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.gradient(np.log(number), np.log(radii), axis=1)
    slope[~np.isfinite(slope)] = np.nan
    dimension = np.array([_fit_dimension(radii, n, r) for n in number])
    series, phi = run.whole.series, np.full(len(time), np.nan)
    if "filling_factor" in series:
        phi = np.interp(time, series.time.values, series.filling_factor.values)
    return Fractal(radii, number, slope, dimension, time, phi, r)


def _fit_dimension(
    radii: NDArray[np.float64], number: NDArray[np.float64], grain_radius: float
) -> float:
    used = (number > 0) & (number <= SMALL_SCALE) & (radii > 2.0 * grain_radius)
    if used.sum() < 3:
        return np.nan
    return float(np.polyfit(np.log(radii[used]), np.log(number[used]), 1)[0])
