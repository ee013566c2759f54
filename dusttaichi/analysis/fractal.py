"""Structure of a sample: number of grains within a distance of a grain (T19 Fig 10)."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import neighbours_within

CENTRES = 10_000  #: Random grains about which others are counted, where there are more.
SMALL_SCALE = 20.0
"""Number of grains up to which T19 section 4.1 finds the fractal dimension of the aggregates."""


@dataclass(frozen=True)
class Fractal:
    """Mean number of other grains nearer than r_in, in some snapshots."""

    radius_in: np.ndarray  #: Distances r_in [m], (radii,).
    number: np.ndarray  #: N(r < r_in) without the central grain, (snapshots, radii).
    slope: np.ndarray  #: d ln N / d ln r_in, (snapshots, radii); NaN where N is 0.
    #: Slope of a line through ln N over the radii beyond contact with N <= 20, (snapshots,); NaN
    #: for fewer than three of them.
    dimension: np.ndarray
    time: np.ndarray  #: [s], (snapshots,).
    filling_factor: np.ndarray  #: (snapshots,), or NaN.
    grain_radius: float  #: [m].


def measure_fractal(run, snapshots=None, radii=None) -> Fractal:
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
    frames = stage.snapshots
    if frames is None or not frames.sizes["snapshot"]:
        raise DustError(f"{run.path} has no snapshots: set output: snapshots in the scene.")
    if "tilt" in frames:
        raise DustError(f"{run.path}: its cell is sheared; allowed: cells without a tilt.")
    if snapshots is None:
        snapshots = np.unique(np.linspace(0, frames.sizes["snapshot"] - 1, 5).round().astype(int))
    r = float(frames.radius.max())
    frames = [(n, frames.isel(snapshot=n).load()) for n in snapshots]
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


def _fit_dimension(radii, number, grain_radius):
    used = (number > 0) & (number <= SMALL_SCALE) & (radii > 2.0 * grain_radius)
    if used.sum() < 3:
        return np.nan
    return float(np.polyfit(np.log(radii[used]), np.log(number[used]), 1)[0])
