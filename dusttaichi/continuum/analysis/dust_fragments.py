"""Pieces of dust, and how fast they come back: fragments and restitution of the continuum."""

from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.analysis.restitution import UNTOUCHED
from dusttaichi.continuum.analysis.particle_snapshot import read_particles
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES, WALLS, label_components, largest_first
from dusttaichi.results.roles import FIXED, WALL
from dusttaichi.scene.quantities import parse

STILL = 1e-6  #: Speed of a body, over that of its fastest particle, up to which it does not fly.
APART = 1.6  # spacings, of the present volumes, from which two particles are of two pieces


@dataclass(frozen=True)
class Pieces:
    """Pieces of one snapshot, the heaviest first; SI.

    number (N,): of the piece of each particle, -1 of what is not dust that moves. mass (pieces,);
    centre, velocity (pieces, 3). sticks (pieces,) bool: it touches a wall, fixed dust or a
    mirror. walled: there is any of these.
    """

    number: np.ndarray
    mass: np.ndarray
    centre: np.ndarray
    velocity: np.ndarray
    sticks: np.ndarray
    walled: bool

    @property
    def largest_share(self):
        """Share of the mass that is in the largest piece."""
        return float(self.mass[0] / self.mass.sum())

    @property
    def sticking_share(self):
        """Share of the mass in pieces that touch something rigid or fixed."""
        return float(self.mass[self.sticks].sum() / self.mass.sum())


def pieces(run, snapshot=-1):
    """The Pieces of a snapshot of a Run of the continuum.

    Particles are of one piece where they are nearer than 1.6 spacings, the spacing scaled with
    (rho_0 / rho)^(1/d) of the particles.
    """
    frame = read_particles(run, snapshot)
    planes = _planes(run, snapshot)
    return pieces_of(frame, planes)


def _planes(run, snapshot):
    """(axis, coordinate [m]) of each mirror and each rigid face of a run."""
    boundary = run.scene.get("boundary", {})
    planes = [wall for wall in WALLS if boundary.get(wall) in ("mirror", "rigid")]
    group = run.tree["snapshots"]
    if not planes or "box" not in group:
        return []
    box = group.box.isel(snapshot=snapshot)
    return [(WALLS.index(wall) // 2, float(box.sel(wall=wall))) for wall in planes]


def pieces_of(frame, planes=()):
    """The Pieces of a ParticleFrame. planes: (axis, coordinate [m]) of mirrors and rigid faces."""
    moves = np.flatnonzero(frame.flies)
    x, size = frame.position[moves], frame.size[moves]
    pairs = scipy.spatial.cKDTree(x).query_pairs(APART * size.max(), output_type="ndarray")
    i, j = pairs.T
    near = np.linalg.norm(x[i] - x[j], axis=1) < APART * 0.5 * (size[i] + size[j])
    weight = frame.mass[moves]
    count, component = label_components(pairs[near], len(x))
    label = largest_first(component, weight)
    mass = np.bincount(label, weight, minlength=count)

    def mean(vectors):
        sums = [np.bincount(label, weight * vectors[:, n], minlength=count) for n in range(3)]
        return np.stack(sums, axis=1) / mass[:, None]

    fixed = frame.position[np.isin(frame.role, (FIXED, WALL))]
    touching = _touching(fixed, x, size, planes)
    number = np.full(len(frame.position), -1)
    number[moves] = label
    return Pieces(
        number=number,
        mass=mass,
        centre=mean(x),
        velocity=mean(frame.velocity[moves]),
        sticks=np.bincount(label[touching], minlength=count) > 0,
        walled=bool(planes) or len(fixed) > 0,
    )


def _touching(fixed, x, size, planes):
    """True for moving particles near something rigid, (M,) bool; fixed: (F, 3) [m]."""
    touching = np.zeros(len(x), bool)
    for axis, plane in planes:
        # a mirror image is twice as far as the plane
        touching |= 2.0 * np.abs(x[:, axis] - plane) < APART * size
    if len(fixed):
        distance, _ = scipy.spatial.cKDTree(fixed).query(x)
        touching |= distance < APART * size
    return touching


def velocities_at_start(run):
    """Number of each moving body of dust -> initial velocity [m/s], (3,).

    It is 0 for a body whose particles move without it.
    """
    frame = read_particles(run, 0)
    moves, velocities = frame.flies, {}
    for n in np.unique(frame.body[moves]):
        members = moves & (frame.body == n)
        velocity = np.average(frame.velocity[members], axis=0, weights=frame.mass[members])
        fastest = np.linalg.norm(frame.velocity[members], axis=1).max()
        flies = np.linalg.norm(velocity) > STILL * fastest
        velocities[int(n)] = velocity if flies else np.zeros(3)
    return velocities


def is_pushed(run):
    """True where a wall or fixed dust has acted on the dust of a Run.

    Some face has had a force, or the momentum has changed otherwise than by uniform gravity. The
    momentum says nothing where a central body attracts.
    """
    series = run.whole.series
    if "wall_force" in series and np.any(series.wall_force.values != 0.0):
        return True
    expected, frame = _falls(run), read_particles(run, 0)
    if expected is None:
        return False
    mass = frame.mass[frame.flies]
    time, momentum = series.time.values, series.momentum.values
    change = momentum - momentum[0] - mass.sum() * np.outer(time - time[0], expected)
    scale = (mass * np.linalg.norm(frame.velocity[frame.flies], axis=1)).sum()
    return bool(np.abs(change).max(initial=0.0) > UNTOUCHED * scale)


def _falls(run):
    """Uniform acceleration by gravity [m/s^2], (3,); None where a central body attracts."""
    gravity = run.scene.get("gravity") or {}
    if gravity.get("central"):
        return None
    texts = gravity.get("acceleration") or ("0 m/s^2",) * 3
    return np.array([parse(text, "acceleration", "gravity.acceleration") for text in texts])


def _is_deflected(run):
    """True where the mean velocity of the dust has changed otherwise than by uniform gravity."""
    start, end = read_particles(run, 0), read_particles(run, -1)
    first, last = (
        np.average(frame.velocity[frame.flies], axis=0, weights=frame.mass[frame.flies])
        for frame in (start, end)
    )
    expected = _falls(run)
    if expected is None:
        return False
    change = last - first - (end.time - start.time) * expected
    return bool(np.linalg.norm(change) > UNTOUCHED * np.linalg.norm(first))


def _have_touched(run, bodies):
    """True where the two bodies (numbers) of a Run have acted on each other.

    Their relative velocity has changed; where gravity changes it too, they are of one piece in some
    snapshot.
    """
    gravity = run.scene.get("gravity") or {}
    if gravity.get("central") or gravity.get("self_gravity"):
        frames = (read_particles(run, n) for n in range(run.snapshots.sizes["snapshot"]))
        return any(_are_near(frame, bodies) for frame in frames)
    start, end = (_relative_velocity(read_particles(run, n), bodies) for n in (0, -1))
    return bool(np.linalg.norm(end - start) > UNTOUCHED * np.linalg.norm(start))


def _relative_velocity(frame, bodies):
    """Velocity of the second body less that of the first [m/s], (3,)."""
    of_body = (frame.flies & (frame.body == n) for n in bodies)
    first, second = (
        np.average(frame.velocity[particles], axis=0, weights=frame.mass[particles])
        for particles in of_body
    )
    return second - first


def _are_near(frame, bodies):
    """True where particles of the two bodies are nearer than those of one piece."""
    first, second = (frame.flies & (frame.body == n) for n in bodies)
    distance, nearest = scipy.spatial.cKDTree(frame.position[first]).query(frame.position[second])
    sizes = frame.size[first][nearest] + frame.size[second]
    return bool(np.any(distance < APART * 0.5 * sizes))


@dataclass(frozen=True)
class Bounce:
    """Rebound of a body of dust from a wall along an axis.

    coefficient: of restitution, speed of the largest piece away from the wall at the end over that
    of the body towards it at the start; 0 where that piece is near a wall that still acts with a
    force, in the last tenth of the run. rebound: the largest speed back of the centre of mass over
    the start's, at any time. parts: the Pieces of the end. axis: "z" ...
    """

    coefficient: float
    rebound: float
    parts: Pieces
    axis: str


def bounce(run):
    """The Bounce of the one body of dust of a Run, which flies at a wall.

    The axis is that of the largest component of its velocity at the start. Raises DustError where
    it has met nothing, or moves on.
    """
    if not (is_pushed(run) or _is_deflected(run)):
        raise DustError("the body has met nothing")
    end_pieces = pieces(run)
    start = velocities_at_start(run)[0]
    axis = int(np.argmax(np.abs(start)))
    momentum = run.whole.series.momentum.isel(xyz=axis).values
    back = -momentum / (end_pieces.mass.sum() * start[axis])
    fixed = end_pieces.sticks[0] and _pushed_at_the_end(run)
    coefficient = 0.0 if fixed else -end_pieces.velocity[0, axis] / start[axis]
    if coefficient < 0.0:
        raise DustError("the body still moves on; let the run continue")
    return Bounce(float(coefficient), float(back.max(initial=0.0)), end_pieces, AXES[axis])


def _pushed_at_the_end(run):
    """True where some face acts with a force in the last tenth of a run, or none is known."""
    series = run.whole.series
    if "wall_force" not in series:
        return True
    force = series.wall_force.values
    return bool(np.any(force[-max(1, len(force) // 10) :]))


@dataclass(frozen=True)
class Rebound:
    """Rebound of two bodies of dust from each other.

    coefficient: of restitution; None where there is none, and `problem` says why.
    """

    coefficient: float | None
    problem: str | None


def collide(run):
    """The Rebound of the first two bodies of a run that fly at each other.

    A body is the piece with more than half of its mass. The restitution is the speed at which the
    pieces of both leave each other, along the line between them, over the relative speed at the
    start.
    """
    frame, end_pieces = read_particles(run), pieces(run)
    start = velocities_at_start(run)
    bodies = list(start)[:2]
    approach = float(np.linalg.norm(start[bodies[1]] - start[bodies[0]]))
    if approach == 0.0:
        return Rebound(None, "none: the bodies do not approach each other")
    if is_pushed(run):
        return Rebound(None, "none: a wall or fixed dust has acted on a body")
    first, second = (_piece_of(frame, end_pieces, n) for n in bodies)
    if None in (first, second):
        return Rebound(None, "none: a body has broken up, and no piece has half of its mass")
    if first == second:
        return Rebound(None, "none: the bodies stick together")
    if not _have_touched(run, bodies):
        return Rebound(None, f"none: {_untouched_reason(frame, bodies)}")
    apart = end_pieces.centre[second] - end_pieces.centre[first]
    opening = float((end_pieces.velocity[second] - end_pieces.velocity[first]) @ apart)
    opening /= float(np.linalg.norm(apart))
    if opening < 0.0:
        return Rebound(None, "none: the bodies still approach each other; let the run continue")
    return Rebound(opening / approach, None)


def _untouched_reason(frame, bodies):
    """Reason of two bodies that have not touched: before they meet, or after they passed."""
    first, second = (frame.flies & (frame.body == n) for n in bodies)
    between = frame.position[second].mean(axis=0) - frame.position[first].mean(axis=0)
    if between @ _relative_velocity(frame, bodies) < 0.0:
        return "the bodies have not met yet; let the run continue"
    return "the bodies passed each other without touching"


def _piece_of(frame, end_pieces, body):
    """Number of the piece with more than half of the mass of a body; None where there is none."""
    members = frame.flies & (frame.body == body)
    mass_fractions = (
        np.bincount(end_pieces.number[members], frame.mass[members]) / frame.mass[members].sum()
    )
    return int(mass_fractions.argmax()) if mass_fractions.max() > 0.5 else None
