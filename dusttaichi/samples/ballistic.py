"""Straight flight until first contact: of grains shot at an aggregate, and of two bodies."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.physics.near import near
from dusttaichi.samples.mixture import Grains
from dusttaichi.samples.sample import ROUNDING
from dusttaichi.scene.making import report_progress


def random_directions(rng: np.random.Generator, n: int) -> np.ndarray:
    """Unit vectors (n, 3), uniform over the sphere."""
    vectors = rng.normal(size=(n, 3))
    values: NDArray[Any] = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return values


def random_rotations(rng: np.random.Generator, n: int) -> np.ndarray:
    """Rotation matrices (n, 3, 3), uniform over all orientations."""
    values: NDArray[Any] = scipy.spatial.transform.Rotation.from_quat(
        rng.normal(size=(n, 4))
    ).as_matrix()
    return values


def random_in_disc(rng: np.random.Generator, n: int) -> np.ndarray:
    """Points (n, 2), uniform over the unit disc."""
    angle, reach = 2 * np.pi * rng.random(n), np.sqrt(rng.random(n))
    return np.column_stack([reach * np.cos(angle), reach * np.sin(angle)])


def find_perpendicular(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (n, 3) each, perpendicular to the directions (n, 3) and to each other."""
    axis = np.zeros_like(directions)
    axis[np.arange(len(directions)), np.abs(directions).argmin(axis=1)] = 1.0
    first = np.cross(directions, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(directions, first)


def flight_length(
    along: NDArray[np.float64], across_squared: NDArray[np.float64], distance: Any
) -> np.ndarray:
    """Length of flight until two centres are `distance` apart; inf where they pass each other.

    along: component of the vector to the target's centre in the direction of flight [m];
    across_squared: square of the rest [m^2].
    """
    half_chord_squared = distance**2 - across_squared
    return np.where(
        half_chord_squared > 0, along - np.sqrt(np.maximum(half_chord_squared, 0.0)), np.inf
    )


Flights = Callable[[NDArray[Any], NDArray[Any], NDArray[Any]], NDArray[np.float64]]
"""Lengths of flight (P,) [m] of pairs: numbers of the flights, of the targets, and vectors (P, 3)
from the starts to the targets [m]."""


def first_hits(
    tree: "scipy.spatial.cKDTree",
    starts: NDArray[np.float64],
    directions: NDArray[np.float64],
    distance: float,
    longest: float | NDArray[np.float64],
    *,
    numbers: NDArray[np.integer] | None = None,
    measure: Flights | None = None,
) -> np.ndarray:
    """Length of flight (M,) [m] until each flying grain first touches a target; inf for a miss.

    tree: of the centres of the targets (N, 3); starts, directions: (M, 3), the starts out of reach
    of all targets. distance: between the centres of grains that touch; longest: largest length of a
    flight, one number or (M,). numbers: None, or for each target the number of the first flight
    that does not pass through it. measure: of unequal grains, the lengths of flights of pairs;
    distance is then their largest one. Exact to rounding.

    A flight advances as far as the nearest target allows, then a window of two distances ahead is
    searched for all targets that it could touch there. Their centres are around or ahead of the
    window: in a cylinder of radius distance about it with a hemisphere at its far end, and so in
    the sphere that is searched.
    """
    targets = tree.data
    window = 2 * distance
    far = window + distance
    middle = (far**2 - distance**2) / (2 * far)
    reach = (far - middle) * (1 + ROUNDING)
    flown = np.zeros(len(starts))
    hit = np.full(len(starts), np.inf)
    longest = np.broadcast_to(longest, len(starts))
    flying = np.arange(len(starts))
    while len(flying):
        start, direction = starts[flying], directions[flying]
        nearest = tree.query(start + flown[flying, None] * direction)[0]
        flown[flying] += np.maximum(nearest - distance, 0.0)
        search = start + (flown[flying, None] + middle) * direction
        ahead = scipy.spatial.cKDTree(search)
        near = ahead.sparse_distance_matrix(tree, reach, output_type="ndarray")
        if numbers is not None:
            near = near[numbers[near["j"]] <= flying[near["i"]]]
        i = near["i"]
        apart = targets[near["j"]] - start[i]
        if measure is not None:
            flights = measure(flying[i], near["j"], apart)
        else:
            along = (apart * direction[i]).sum(axis=1)
            off = apart - along[:, None] * direction[i]
            flights = flight_length(along, (off**2).sum(axis=1), distance)
        np.minimum.at(hit, flying[i], flights)
        flown[flying] += window
        # before a target beyond the window there may be one outside of the searched sphere
        flying = flying[(hit[flying] > flown[flying]) & (flown[flying] < longest[flying])]
    hit[hit > longest] = np.inf
    return hit


def first_touch(
    targets: NDArray[np.float64],
    projectiles: NDArray[np.float64],
    distance: float,
    radii: tuple[NDArray[Any], ...] | None = None,
) -> np.ndarray:
    """Length of flight along -z until each projectile touches its target, (C,) [m]; inf: never.

    targets: centres (C, N, 3); projectiles: (C, M, 3), one body each; distance: between the
    centres of grains that touch [m]; radii: None, or those of the targets (N,) and projectiles
    (M,), the sum of which is the distance of two, the largest such sum `distance`. A negative
    length means an earlier contact.
    """
    # seen along z, each collision has a site of its own, so that one search suffices for all
    flat = np.concatenate([targets, projectiles], axis=1)[..., :2]
    low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
    site = np.arange(len(flat)) * (high[0] - low[0] + 2 * distance)

    def seen(bodies: NDArray[np.float64]) -> scipy.spatial.cKDTree:
        points = bodies[..., :2].copy()
        points[..., 0] += site[:, None]
        return scipy.spatial.cKDTree(points.reshape(-1, 2))

    near = seen(projectiles).sparse_distance_matrix(
        seen(targets), distance * (1 + ROUNDING), output_type="ndarray"
    )
    apart = projectiles.reshape(-1, 3)[near["i"]] - targets.reshape(-1, 3)[near["j"]]
    if radii is not None:
        r1, r2 = radii
        distance = r2[near["i"] % len(r2)] + r1[near["j"] % len(r1)]
    flights = flight_length(apart[:, 2], (apart[:, :2] ** 2).sum(axis=1), distance)
    first = np.full(len(targets), np.inf)
    np.minimum.at(first, near["i"] // projectiles.shape[1], flights)
    return first


ALL_PAIRS = 10_000  # pairs of two bodies up to which they are faster than a search
SHOTS = 8  # simultaneous shots of one grain; the first hit is used


class Aggregate:
    """A cluster that grows by bodies that are shot at it from all sides and stick where they touch.

    positions: (N, 3) [m], the first grain at the origin. grains: Grains so far. impact_parameter:
    of every shot, over the sum of the outer radii about the centre of mass; None: uniform over the
    disc.
    """

    def __init__(self, first: Grains, impact_parameter: float | None = None) -> None:
        self.positions, self.grains = np.zeros((1, 3)), first
        self.impact = impact_parameter

    @property
    def reach(self) -> float:
        """Distance of the farthest centre from the first grain [m]."""
        return float(np.sqrt((self.positions**2).sum(axis=1)).max())

    def add(self, body: NDArray[np.float64], grains: Grains, rng: np.random.Generator) -> None:
        """Shoot a body (n, 3) of grains, about its centre, at the aggregate."""
        x, count = self.positions, len(self.positions)
        together = self.grains.join([grains])
        touch = together.distance(np.arange(count, len(together))[:, None], np.arange(count))
        # with uniform impact parameters any disc that covers the aggregate suffices
        centre = np.zeros(3) if self.impact is None else self._centre()
        outer = np.sqrt(((x - centre) ** 2).sum(axis=1)) + self.grains.radii
        cover = outer.max() + (np.sqrt((body**2).sum(axis=1)) + grains.radii).max()
        landed = _shoot(x, (body, touch), (centre, cover), self.impact, rng)
        self.positions, self.grains = np.concatenate([x, landed]), together

    def centre_positions(self) -> np.ndarray:
        """Centre the positions about the centre of the grains' volume, (N, 3) [m]."""
        return self.positions - self._centre()

    def _centre(self) -> NDArray[np.float64]:
        volume = self.grains.radii**3
        values: NDArray[np.float64] = volume @ self.positions / volume.sum()
        return values


def grow_aggregate(
    grains: Grains,
    rng: np.random.Generator,
    cluster: int = 1,
    impact_parameter: float | None = None,
) -> np.ndarray:
    """Grow centres (N, 3) [m] by particle-cluster aggregation, about the centre of their volume.

    cluster: grains of each projectile; if more than one, a cluster grown by `grow_clusters`.
    """
    first = grains.select(slice(0, cluster))
    out = Aggregate(first, impact_parameter)
    out.positions = grow_clusters(first, rng)
    for begin in range(cluster, len(grains), cluster):
        report_progress(begin, len(grains))
        projectile = grains.select(slice(begin, begin + cluster))
        out.add(grow_clusters(projectile, rng), projectile, rng)
    return out.centre_positions()


def _shoot(
    targets: NDArray[np.float64],
    flying: tuple[NDArray[np.float64], NDArray[np.float64]],
    about: tuple[NDArray[np.float64], float],
    impact: float | None,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Shoot a body from afar, again after a miss: its final positions (n, 3).

    flying: its centres about their mean (n, 3), and distances at contact with each target (n,
    targets). about: centre of the targets and the sum of the outer radii.
    """
    (body, touch), (centre, cover) = flying, about
    shots = SHOTS if len(body) == 1 else 1
    while True:
        directions = random_directions(rng, shots)
        off = random_in_disc(rng, shots)
        if impact is not None:
            off *= impact / np.linalg.norm(off, axis=1, keepdims=True)
        turned = body if len(body) == 1 else body @ random_rotations(rng, 1)[0].T
        u, v = find_perpendicular(directions)
        starts = centre + cover * (off[:, :1] * u + off[:, 1:] * v - 2.0 * directions)
        apart = targets - starts[:, None, None] - turned[:, None]
        along = np.einsum("sbtc,sc->sbt", apart, directions)
        square = (apart**2).sum(axis=3) - along**2
        hits = flight_length(along, square, touch).min(axis=(1, 2))
        hit = np.flatnonzero(np.isfinite(hits))
        if len(hit):
            values: NDArray[np.float64] = (
                starts[hit[0]] + turned + hits[hit[0]] * directions[hit[0]]
            )
            return values


def grow_clusters(
    grains: Grains,
    rng: np.random.Generator,
    mass_ratio: float = 1.0,
    report: Callable[[int, int], object] = lambda count, total: None,
) -> np.ndarray:
    """Grow centres (N, 3) [m] about their mean by cluster-cluster aggregation of any grains.

    Two bodies that have grown independently meet, the second with mass_ratio (up to 1) times as
    many grains as the first. report: called with the numbers of grains so far and of all.
    """
    finished, total = 0, len(grains)

    def grow(grains: Grains) -> NDArray[np.float64]:
        nonlocal finished
        count = len(grains)
        if count == 1:
            finished += 1
            report(finished, total)
            return np.zeros((1, 3))
        larger = min(max(round(count / (1.0 + mass_ratio) + 1e-9), 1), count - 1)
        first = np.arange(count) < max(larger, count - larger)
        first_body, second_body = (grow(grains.select(members)) for members in (first, ~first))
        joined = np.concatenate(_collide(first_body, second_body, grains, rng))
        values: NDArray[np.float64] = joined - joined.mean(axis=0)
        return values

    return grow(grains)


def _collide(
    target: NDArray[np.float64],
    projectile: NDArray[np.float64],
    grains: Grains,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Collide two bodies, rotated at random; the second flies at the first along -z."""
    widest = _widest_touch(len(target), grains)
    reach = sum(np.sqrt((body**2).sum(axis=1)).max() for body in (target, projectile)) + widest
    while True:
        still, flying = (
            body @ turn.T
            for body, turn in zip((target, projectile), random_rotations(rng, 2), strict=True)
        )
        flying[:, :2] += random_in_disc(rng, 1)[0] * reach
        i, j = _facing_pairs(flying, still, widest)
        apart = flying[i] - still[j]
        touch = grains.distance(i + len(target), j)
        flights = flight_length(apart[..., 2], (apart[..., :2] ** 2).sum(axis=-1), touch)
        flight = flights.min(initial=np.inf)
        if np.isfinite(flight):
            flying[:, 2] -= flight
            return still, flying


def _widest_touch(count: int, grains: Grains) -> float:
    """Largest distance at contact of one of the first `count` grains and another one [m]."""
    rows = np.arange(len(grains))

    def largest(body: NDArray[np.integer]) -> NDArray[np.integer]:
        """Largest grain of each material in a body: no other one reaches farther."""
        groups = (body[grains.numbers[body] == n] for n in np.unique(grains.numbers[body]))
        return np.array([group[grains.radii[group].argmax()] for group in groups])

    first, second = largest(rows[:count]), largest(rows[count:])
    return float(np.max(grains.distance(second[:, None], first[None])))


def _facing_pairs(
    flying: NDArray[np.float64], still: NDArray[np.float64], widest: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Pairs of grains of two bodies that can meet in a flight along z; all of small bodies."""
    if len(flying) * len(still) <= ALL_PAIRS:
        i, j = np.indices((len(flying), len(still)))
        return i, j
    i, j, _ = near(flying[:, :2], still[:, :2], widest * (1 + ROUNDING))
    return i, j
