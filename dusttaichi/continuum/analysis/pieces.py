"""Pieces of dust, and how fast they come back: fragments and restitution of the continuum."""

from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.continuum.analysis.particles import read_particles
from dusttaichi.physics.geometry import AXES, WALLS, connected, largest_first
from dusttaichi.results.roles import FIXED, WALL

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
        """Share of the mass in pieces that touch something that does not give way."""
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
    count, found = connected(pairs[near], len(x))
    label = largest_first(found, weight)
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
    moves, found = frame.flies, {}
    for n in np.unique(frame.body[moves]):
        own = moves & (frame.body == n)
        velocity = np.average(frame.velocity[own], axis=0, weights=frame.mass[own])
        fastest = np.linalg.norm(frame.velocity[own], axis=1).max()
        flies = np.linalg.norm(velocity) > STILL * fastest
        found[int(n)] = velocity if flies else np.zeros(3)
    return found


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

    The axis is that of the largest component of its velocity at the start.
    """
    parts = pieces(run)
    start = velocities_at_start(run)[0]
    axis = int(np.argmax(np.abs(start)))
    momentum = run.whole.series.momentum.isel(xyz=axis).values
    back = -momentum / (parts.mass.sum() * start[axis])
    fixed = parts.sticks[0] and _pushed_at_the_end(run)
    coefficient = 0.0 if fixed else -parts.velocity[0, axis] / start[axis]
    return Bounce(float(coefficient), float(back.max(initial=0.0)), parts, AXES[axis])


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
    frame, parts = read_particles(run), pieces(run)
    start = velocities_at_start(run)
    one, other = (start[n] for n in list(start)[:2])
    approach = float(np.linalg.norm(other - one))
    if approach == 0.0:
        return Rebound(None, "none: the bodies do not approach each other")
    found = [_piece_of(frame, parts, n) for n in list(start)[:2]]
    if None in found:
        return Rebound(None, "none: a body has broken up, and no piece has half of its mass")
    first, second = found
    if first == second:
        return Rebound(None, "none: the bodies stick together")
    apart = parts.centre[second] - parts.centre[first]
    opening = float((parts.velocity[second] - parts.velocity[first]) @ apart)
    opening /= float(np.linalg.norm(apart))
    if opening < 0.0:
        return Rebound(None, "none: the bodies still approach each other; let the run continue")
    return Rebound(opening / approach, None)


def _piece_of(frame, parts, body):
    """Number of the piece with more than half of the mass of a body; None where there is none."""
    own = frame.flies & (frame.body == body)
    shares = np.bincount(parts.number[own], frame.mass[own]) / frame.mass[own].sum()
    return int(shares.argmax()) if shares.max() > 0.5 else None
