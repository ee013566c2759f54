"""Two colliding bodies, or one and a wall: motion, angular momenta, coefficient of restitution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.fragments import find_fragments, find_two_fragments
from dusttaichi.analysis.frame import count_frames, read_frame, read_grain_masses
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import WALLS, are_in_same_fragment

if TYPE_CHECKING:
    from dusttaichi.analysis.fragments import Bodies, Body
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


UNTOUCHED = 1e-5
"""Relative change of the relative velocity below which two bodies have not touched: above the
rounding of single precision, and below the effect of the first contact on thousands of grains."""


@dataclass(frozen=True)
class Restitution:
    """A collision along its normal."""

    approach_speed: float  #: Speed of approach of the centres of mass along the normal [m/s].
    separation_speed: float  #: Speed of separation afterwards [m/s]; negative: still approaching.
    sticks: bool  #: True if the two stay together.
    #: Unit vector from the second body, or the wall, to the first, (3,).
    normal: NDArray[np.float64]

    @property
    def coefficient(self) -> float:
        """e = after over before; 0 where the two stick."""
        return 0.0 if self.sticks else self.separation_speed / self.approach_speed


def measure_restitution(
    run: Run, first: int = 0, last: int = -1, bodies: Bodies | None = None
) -> Restitution:
    """Restitution of two bodies between two snapshots of a run.

    A body consists of the same grains before and after the collision. The normal is the line
    between the centres of mass at the snapshot where these are closest. The bodies stick where one
    fragment of snapshot `last` has more than half of the mass of each.

    Parameters
    ----------
    run : Run
    first : int
        Snapshot before.
    last : int
        Snapshot after.
    bodies : pair of lists, optional
        Grain numbers. Default: the two fragments of snapshot `first`.

    Raises
    ------
    DustError
        There are not two bodies, or they do not approach each other, or have not touched.
    """
    masses = read_grain_masses(run)
    if bodies is None:
        label = find_two_fragments(run, first).label
        bodies = [np.flatnonzero(label == k) for k in (0, 1)]
    first_body, second_body = (np.asarray(body, dtype=np.int64) for body in bodies)
    start, end = read_frame(run, first, False), read_frame(run, last, False)
    frames = (read_frame(run, n, False) for n in range(start.number, end.number + 1))
    separation = min(
        (_compute_separation(f, first_body, second_body, masses) for f in frames),
        key=np.linalg.norm,
    )
    normal = separation / np.linalg.norm(separation)

    first_velocity, last_velocity = (
        _compute_velocity(frame, first_body, masses) - _compute_velocity(frame, second_body, masses)
        for frame in (start, end)
    )
    label = find_fragments(run, last).label
    sticks = are_in_same_fragment(label, masses, (first_body, second_body))
    result = _check_approach(
        run, -float(first_velocity @ normal), float(last_velocity @ normal), sticks, normal
    )
    change = np.linalg.norm(last_velocity - first_velocity)
    if not sticks and change <= UNTOUCHED * np.linalg.norm(first_velocity):
        raise DustError(f"{run.path}: the bodies have not touched, so there is no restitution.")
    return result


def compute_relative_motion(
    run: Run, snapshot: int, bodies: Bodies, masses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Relative position [m] and velocity [m/s] of the centres of mass of two bodies, (2, 3).

    bodies: grain numbers. masses: of the grains [kg], (N,).
    """
    frame, (first_body, second_body) = read_frame(run, snapshot, False), bodies
    velocity = _compute_velocity(frame, first_body, masses) - _compute_velocity(
        frame, second_body, masses
    )
    return np.stack([_compute_separation(frame, first_body, second_body, masses), velocity])


def measure_wall_restitution(
    run: Run, wall: str = "bottom", first: int = 0, last: int = -1
) -> Restitution:
    """Restitution of all grains on a wall between two snapshots of a run.

    Speeds are relative to the wall, which may move. The grains stick where one of them is in
    contact with the wall in snapshot `last`.

    Parameters
    ----------
    run : Run
    wall : str
        Name of the wall.
    first : int
        Snapshot before.
    last : int
        Snapshot after.

    Raises
    ------
    DustError
        There is no such wall, or the grains do not approach it, or have not touched it.
    """
    start, end = read_frame(run, first, False), read_frame(run, last, False)
    side = WALLS.index(wall) if wall in WALLS else None
    if side is None or np.isnan(start.cell.ravel()[side]):
        raise DustError(
            f'{run.path} has no wall "{wall}"; allowed: {", ".join(WALLS)}, if present.'
        )
    masses = read_grain_masses(run)
    body = np.arange(len(masses))
    axis, sign = side // 2, 1.0 if side % 2 == 0 else -1.0
    touching = run.contacts(end.number, "wall_contacts")
    sticks = (touching.wall.values == side).any()

    def separation(snapshot: Frame) -> float:
        velocity = _compute_velocity(snapshot, body, masses)[axis]
        return float(sign * (velocity - _compute_wall_velocity(run, snapshot, side)))

    normal = sign * np.eye(3)[axis]
    result = _check_approach(run, -separation(start), separation(end), bool(sticks), normal)
    change = abs(result.separation_speed + result.approach_speed)
    if not sticks and change <= UNTOUCHED * result.approach_speed:
        raise DustError(f"{run.path}: the grains have not touched the wall {wall}.")
    return result


def _check_approach(
    run: Run,
    approach_speed: float,
    separation_speed: float,
    sticks: bool,
    normal: NDArray[np.float64],
) -> Restitution:
    if not approach_speed > 0.0:
        raise DustError(
            f"{run.path}: the bodies do not approach each other in the first snapshot taken "
            f"(relative speed {approach_speed:.3g} m/s); allowed: a snapshot before the collision."
        )
    return Restitution(approach_speed, separation_speed, sticks, normal)


def _compute_separation(
    frame: Frame, first_body: Body, second_body: Body, masses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Vector from the centre of mass of the second body to the first [m], (3,), nearest image."""
    return frame.nearest(
        _compute_centre(frame, first_body, masses) - _compute_centre(frame, second_body, masses)
    )


def _compute_centre(frame: Frame, body: Body, masses: NDArray[np.float64]) -> NDArray[np.float64]:
    origin = frame.position[body[0]]  # a body is smaller than half a periodic cell
    offset = frame.nearest(frame.position[body] - origin)
    centre: NDArray[np.float64] = origin + np.average(offset, axis=0, weights=masses[body])
    return centre


def _compute_velocity(frame: Frame, body: Body, masses: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.average(frame.velocity[body], axis=0, weights=masses[body])


def _compute_wall_velocity(run: Run, frame: Frame, side: int) -> float:
    """Speed of the wall along its axis [m/s], from the snapshots before and after this one."""
    low = read_frame(run, max(frame.number - 1, 0), False)
    high = read_frame(run, min(frame.number + 1, count_frames(run) - 1), False)
    if high.time == low.time:
        return 0.0
    shift = high.cell.ravel()[side] - low.cell.ravel()[side]
    return float(shift / (high.time - low.time))


def compute_orbital_momentum(run: Run) -> NDArray[np.float64]:
    """Angular momentum of the centres of two bodies about the common one [kg m^2/s], (times, 3).

    Raises
    ------
    DustError
        The time series has no bodies.
    """
    series = run.whole.series
    if "body_angular_momentum" not in series:
        raise DustError(f"{run.path} has no two colliding bodies: sample.kind pair or collision.")
    masses = read_grain_masses(run)
    mass = np.array([masses[grains].sum() for grains in run.bodies()])
    x, v = series.body_position.values, series.body_velocity.values
    moment = np.cross(x[:, 0] - x[:, 1], v[:, 0] - v[:, 1])
    momentum: NDArray[np.float64] = mass.prod() / mass.sum() * moment
    return momentum
