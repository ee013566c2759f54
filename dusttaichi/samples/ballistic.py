"""Straight flight until first contact: of grains shot at an aggregate, and of two bodies."""

import numpy as np
import scipy

from dusttaichi.samples.sample import ROUNDING


def random_directions(rng, n: int) -> np.ndarray:
    """Unit vectors (n, 3), uniform over the sphere."""
    vectors = rng.normal(size=(n, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def random_rotations(rng, n: int) -> np.ndarray:
    """Rotation matrices (n, 3, 3), uniform over all orientations."""
    return scipy.spatial.transform.Rotation.from_quat(rng.normal(size=(n, 4))).as_matrix()


def random_in_disc(rng, n: int) -> np.ndarray:
    """Points (n, 2), uniform over the unit disc."""
    angle, reach = 2 * np.pi * rng.random(n), np.sqrt(rng.random(n))
    return np.column_stack([reach * np.cos(angle), reach * np.sin(angle)])


def across(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (n, 3) each, perpendicular to the directions (n, 3) and to each other."""
    axis = np.zeros_like(directions)
    axis[np.arange(len(directions)), np.abs(directions).argmin(axis=1)] = 1.0
    first = np.cross(directions, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(directions, first)


def arrival(along, across_squared, distance) -> np.ndarray:
    """Length of flight until two centres are `distance` apart; inf where they pass each other.

    along: component of the vector to the target's centre in the direction of flight [m];
    across_squared: square of the rest [m^2].
    """
    left = distance**2 - across_squared
    return np.where(left > 0, along - np.sqrt(np.maximum(left, 0.0)), np.inf)


def first_hits(targets, starts, directions, distance: float, longest: float) -> np.ndarray:
    """Length of flight (M,) [m] until each flying grain first touches a target; inf for a miss.

    targets: centres (N, 3); starts, directions: (M, 3), the starts out of reach of all targets.
    distance: between the centres of grains that touch; longest: largest length of a flight. Exact
    to rounding. A flight advances as far as the nearest target allows, then a window of two
    distances ahead is searched for all targets that it could touch there. Their centres are around
    or ahead of the window: in a cylinder of radius distance about it with a hemisphere at its far
    end, and so in the sphere that is searched.
    """
    tree = scipy.spatial.cKDTree(targets)
    window = 2 * distance
    far = window + distance
    middle = (far**2 - distance**2) / (2 * far)
    reach = (far - middle) * (1 + ROUNDING)
    flown = np.zeros(len(starts))
    hit = np.full(len(starts), np.inf)
    flying = np.arange(len(starts))
    while len(flying):
        start, direction = starts[flying], directions[flying]
        nearest = tree.query(start + flown[flying, None] * direction)[0]
        flown[flying] += np.maximum(nearest - distance, 0.0)
        search = start + (flown[flying, None] + middle) * direction
        ahead = scipy.spatial.cKDTree(search)
        near = ahead.sparse_distance_matrix(tree, reach, output_type="ndarray")
        i = near["i"]
        apart = targets[near["j"]] - start[i]
        along = (apart * direction[i]).sum(axis=1)
        off = apart - along[:, None] * direction[i]
        np.minimum.at(hit, flying[i], arrival(along, (off**2).sum(axis=1), distance))
        flown[flying] += window
        # before a target beyond the window there may be one outside of the searched sphere
        flying = flying[(hit[flying] > flown[flying]) & (flown[flying] < longest)]
    hit[hit > longest] = np.inf
    return hit


def first_touch(targets, projectiles, distance: float, radii=None) -> np.ndarray:
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

    def seen(bodies):
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
    flights = arrival(apart[:, 2], (apart[:, :2] ** 2).sum(axis=1), distance)
    first = np.full(len(targets), np.inf)
    np.minimum.at(first, near["i"] // projectiles.shape[1], flights)
    return first
