"""Arrival times of a push at the grains, and the speed of sound (PD08 section 3.2)."""

from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.analysis.frame import count_frames, read_frame
from dusttaichi.errors import DustError
from dusttaichi.physics.contact import constants
from dusttaichi.physics.geometry import WALLS, nearest_image


@dataclass(frozen=True)
class Arrival:
    """Times at which N grains first moved by more than a threshold."""

    #: Since the first snapshot [s], (N,); NaN for a grain that has not moved that far.
    time: np.ndarray
    #: At the start, from the nearest pushed grain or from the plane of the pushed wall or face [m],
    #: (N,); 0 for pushed grains.
    distance: np.ndarray
    threshold: float  #: Displacement that counts [m].
    push: float  #: Displacement of which the threshold is a fraction [m].

    @property
    def reached(self):
        """(N,) bool: the signal came from elsewhere and has arrived."""
        return (self.distance > 0.0) & (self.time > 0.0)

    @property
    def speed(self):
        """Distance over time of each grain [m/s], (N,) (PD08 Fig 7); NaN where not reached."""
        out = np.full(len(self.time), np.nan)
        return np.divide(self.distance, self.time, out=out, where=self.reached)


def measure_arrival(
    run, pushed=None, *, fraction=0.1, threshold=None, push=None, first=0
) -> Arrival:
    """Arrival of a push at the grains of a run.

    A grain is reached once it is farther than the threshold from its position in snapshot `first`.
    The moment is interpolated linearly between snapshots, which must be closer in time than the
    signal is long. PD08 states no threshold; a smaller one gives a faster front, since waves in
    chains are dispersive.

    Parameters
    ----------
    run : Run
    pushed : int or str, optional
        Number of the pushed grain, or name of the wall, such as "bottom". Default: those of the
        first push of the scene; the position of a face is then the plane through its outermost
        centre.
    fraction : float
        Share of `push` that is the threshold.
    threshold : float, optional
        Absolute threshold [m], instead of `fraction`.
    push : float, optional
        Displacement [m] that `fraction` refers to. Default: the largest displacement of the pushed
        grain or wall; of the first push of the scene its displacement or, for a force, velocity or
        speed, the overlap delta0 of two grains at rest, since pushed grains never stop.
    first : int
        Snapshot at the start of the push.

    Raises
    ------
    DustError
        The grain or wall does not exist or has not moved.
    """
    start = read_frame(run, first, contacts=False)
    if pushed is None:
        pushed, distance, size = _first_push(run, start)
        push = size if push is None else push
    else:
        distance = _distance(start, pushed)
    times, displaced, moved = _motion(run, start)
    if push is None:
        by_wall = isinstance(pushed, str)
        push = (moved[:, WALLS.index(pushed)] if by_wall else displaced[:, pushed]).max()
    if threshold is None:
        threshold = fraction * push
    if not threshold > 0.0:
        raise DustError(
            f"{run.path}: {pushed} is not displaced after snapshot {start.number}, so there is no "
            "signal; allowed: the grain or wall that is pushed, or a threshold above 0."
        )
    time = _crossing(times, displaced, threshold)
    return Arrival(time, distance, float(threshold), float(push))


def _motion(run, start):
    """Times (T,) since the Frame `start`, displacements of grains (T, N) and walls (T, 6)."""
    snapshots, following = run.tree["snapshots"], slice(start.number, count_frames(run))
    times = snapshots.snapshot_time[following].values - start.time
    cells = np.tile(start.cell.ravel(), (len(times), 1))
    if "box" in snapshots:
        cells = snapshots.box[following].values
    displaced = np.empty((len(times), len(start.position)))
    for n, cell in enumerate(cells):  # one at a time: all positions may not fit into memory
        moved = snapshots.position[start.number + n].values - start.position
        period = np.where(start.periodic, cell.reshape(3, 2) @ (-1.0, 1.0), np.inf)
        tilt = float(snapshots.tilt[start.number + n]) if "tilt" in snapshots else 0.0
        displaced[n] = np.linalg.norm(nearest_image(moved, period, tilt), axis=1)
    return times, displaced, np.abs(cells - start.cell.ravel())


def _first_push(run, start):
    """Grains of the first push of a run, distances from it (N,) [m], and its size [m]."""
    if not run.pushes:
        raise DustError(f"{run.path}: its scene has no push; name the pushed grain or wall.")
    push = run.pushes[0]
    group = np.array(push["grains"])
    if "face" in push:
        along = start.position[:, WALLS.index(push["face"]) // 2]
        outermost = (np.min, np.max)[WALLS.index(push["face"]) % 2](along[group])
        distance = np.abs(along - outermost)
    else:
        distance = scipy.spatial.cKDTree(start.position[group]).query(start.position)[0]
    distance[group] = 0.0
    return group, distance, push["size"] if "size" in push else _overlap(run.material)


def _overlap(material):
    """delta0 of two grains at rest [m]."""
    R = constants.reduced_radius(material.radius, material.radius)
    E_star = constants.reduced_modulus(material)
    a0 = constants.equilibrium_contact_radius(material.surface_energy, R, E_star)
    return constants.equilibrium_overlap(a0, R)


def _distance(start, pushed):
    if isinstance(pushed, str):
        present = {w: x for w, x in zip(WALLS, start.cell.ravel(), strict=True) if not np.isnan(x)}
        if pushed not in present:
            allowed = ", ".join(present) or "none"
            raise DustError(f'There is no wall "{pushed}"; allowed: {allowed}.')
        return np.abs(start.position[:, WALLS.index(pushed) // 2] - present[pushed])
    if not 0 <= pushed < len(start.position):
        raise DustError(f"There is no grain {pushed}; allowed: 0 to {len(start.position) - 1}.")
    return np.linalg.norm(start.nearest(start.position - start.position[pushed]), axis=1)


def _crossing(times, values, level):
    """Times (N,) at which the columns of values (T, N) first exceed the level, interpolated."""
    over = values > level
    high_snapshot = np.argmax(over, axis=0)
    low_snapshot = np.maximum(high_snapshot - 1, 0)
    grain = np.arange(values.shape[1])
    low, high = values[low_snapshot, grain], values[high_snapshot, grain]
    fraction = np.divide(level - low, high - low, out=np.zeros(len(grain)), where=high > low)
    moment = times[low_snapshot] + fraction * (times[high_snapshot] - times[low_snapshot])
    return np.where(over.any(axis=0), moment, np.nan)


@dataclass(frozen=True)
class SoundSpeed:
    """Straight line through arrival times: time = delay + distance/speed."""

    speed: float  #: Slope [m/s].
    sigma: float  #: Standard error of the speed [m/s].
    delay: float  #: Time of the line at distance 0 [s].
    grains: int  #: Number of grains in the fit.


def fit_sound_speed(arrivals, beyond=0.0) -> SoundSpeed:
    """Fit of the speed of sound to the arrival times of all reached grains, by least squares.

    Parameters
    ----------
    arrivals : Arrival
    beyond : float
        Distance [m] below which grains are left out, since close to the push the speed is that of
        single chains (PD08 Fig 7).

    Raises
    ------
    DustError
        Fewer than three grains, or a signal that does not arrive later at greater distance.
    """
    used = arrivals.reached & (arrivals.distance >= beyond)
    distance, time = arrivals.distance[used], arrivals.time[used]
    if len(time) < 3 or np.ptp(distance) == 0.0:
        raise DustError(
            f"The signal has reached {len(time)} grains at distances of {beyond:g} m and more; a "
            "fit needs three. Try a smaller threshold or a longer run."
        )
    (slope, delay), covariance = np.polyfit(distance, time, 1, cov=True)
    if slope <= 0.0:
        raise DustError("The signal does not arrive later at greater distance: no speed of sound.")
    sigma = np.sqrt(covariance[0, 0]) / slope**2
    return SoundSpeed(float(1.0 / slope), float(sigma), float(delay), len(time))
