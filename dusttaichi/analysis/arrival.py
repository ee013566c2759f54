"""Arrival times of a push at the grains, and the speed of sound (PD08 section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.analysis.frame import count_frames, read_frame, read_snapshots
from dusttaichi.errors import DustError
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.material_interface import reduced_modulus
from dusttaichi.physics.geometry import WALLS, nearest_image

if TYPE_CHECKING:
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


@dataclass(frozen=True)
class Arrival:
    """Times at which N grains first moved by more than a threshold."""

    #: Since the first snapshot [s], (N,); NaN for a grain that has not moved that far.
    time: NDArray[np.float64]
    #: At the start, from the nearest pushed grain or from the plane of the pushed wall or face [m],
    #: (N,); 0 for pushed grains.
    distance: NDArray[np.float64]
    threshold: float  #: Displacement that counts [m].
    push: float  #: Displacement of which the threshold is a fraction [m].

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(N,) bool: the signal came from elsewhere and has arrived."""
        return (self.distance > 0.0) & (self.time > 0.0)

    @property
    def speed(self) -> NDArray[np.float64]:
        """Distance over time of each grain [m/s], (N,) (PD08 Fig 7); NaN where not reached."""
        speed = np.full(len(self.time), np.nan)
        np.divide(self.distance, self.time, out=speed, where=self.reached)
        return speed


def measure_arrival(
    run: Run,
    pushed: int | str | None = None,
    *,
    fraction: float = 0.1,
    threshold: float | None = None,
    push: float | None = None,
    first: int = 0,
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
    source: int | str | NDArray[np.intp]
    if pushed is None:
        source, distance = _first_push(run, start)
        push = _measure_push(run) if push is None else push
    else:
        source, distance = pushed, _distance(start, pushed)
    times, displaced, moved = _motion(run, start)
    if push is None:
        path = moved[:, WALLS.index(source)] if isinstance(source, str) else displaced[:, source]
        push = float(path.max())
    if threshold is None:
        threshold = fraction * push
    if not threshold > 0.0:
        raise DustError(
            f"{run.path}: {source} is not displaced after snapshot {start.number}, so there is no "
            "signal; allowed: the grain or wall that is pushed, or a threshold above 0."
        )
    time = _crossing(times, displaced, threshold)
    return Arrival(time, distance, float(threshold), float(push))


def _motion(
    run: Run, start: Frame
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Times (T,) since the Frame `start`, displacements of grains (T, N) and walls (T, 6)."""
    snapshots, following = read_snapshots(run), slice(start.number, count_frames(run))
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


def _first_push(run: Run, start: Frame) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Grains of the first push of a run, and distances from it (N,) [m]."""
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
    return group, distance


def _measure_push(run: Run) -> float:
    """Size of the first push [m]: its displacement, or delta0 of two grains at rest.

    Raises DustError for several materials, or an unknown one.
    """
    if "size" in run.pushes[0]:
        return float(run.pushes[0]["size"])
    material = run.material
    if material is None:
        raise DustError(
            f"{run.path}: its push has no displacement, and its grains not one material whose "
            "overlap takes its place; allowed: push, the displacement in metres."
        )
    R = constants.reduced_radius(material.radius, material.radius)
    E_star = reduced_modulus(material)
    a0 = constants.equilibrium_contact_radius(material.surface_energy, R, E_star)
    return float(constants.equilibrium_overlap(a0, R))


def _distance(start: Frame, pushed: int | str) -> NDArray[np.float64]:
    positions = start.position
    if isinstance(pushed, str):
        faces: dict[str, float] = dict(zip(WALLS, start.cell.ravel().tolist(), strict=True))
        present = {wall: x for wall, x in faces.items() if not np.isnan(x)}
        if pushed not in present:
            allowed = ", ".join(present) or "none"
            raise DustError(f'There is no wall "{pushed}"; allowed: {allowed}.')
        along = positions[:, WALLS.index(pushed) // 2]
        return np.abs(along - present[pushed])
    if not 0 <= pushed < len(positions):
        raise DustError(f"There is no grain {pushed}; allowed: 0 to {len(positions) - 1}.")
    away = start.nearest(positions - positions[pushed])
    from_grain: NDArray[np.float64] = np.linalg.norm(away, axis=1)
    return from_grain


def _crossing(
    times: NDArray[np.float64], values: NDArray[np.float64], level: float
) -> NDArray[np.float64]:
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


def fit_sound_speed(arrivals: Arrival, beyond: float = 0.0) -> SoundSpeed:
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
