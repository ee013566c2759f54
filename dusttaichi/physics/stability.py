"""The stiffest period of a scene, and the largest stable time step.

The springs of a contact couple displacements and rotations, so a grain with many contacts rings
faster than a pair: sliding with both grains turning has w^2 = 7 k_s/m for a pair, 13 for a
triangle, 27 for a close-packed 13. The largest eigenvalue of M^-1 K is computed here for the
densest cluster that the scene's grains can form, free and standing on a wall.
"""

from itertools import combinations
from math import pi, sqrt

import numpy as np

from dusttaichi.physics import constants


def close_packed(n):
    """Unit-diameter centres of the n <= 13 most connected grains of a close-packed cluster."""
    height, side = sqrt(2.0 / 3.0), sqrt(1.0 / 3.0)
    ring = [(np.cos(a), np.sin(a), 0.0) for a in np.arange(6) * pi / 3.0]
    upper = [
        (side * np.cos(a), side * np.sin(a), height) for a in pi / 6 + np.arange(3) * 2 * pi / 3
    ]
    lower = [
        (side * np.cos(a), side * np.sin(a), -height) for a in pi / 2 + np.arange(3) * 2 * pi / 3
    ]
    sites = np.array([(0.0, 0.0, 0.0), *ring, *upper, *lower])
    chosen = [0]
    while len(chosen) < min(n, 13):
        rest = [k for k in range(13) if k not in chosen]
        links = [np.sum(np.linalg.norm(sites[chosen] - sites[k], axis=1) < 1.01) for k in rest]
        chosen.append(rest[int(np.argmax(links))])
    return sites[chosen]


def on_a_wall(n):
    """Unit-diameter centres of up to ten close-packed grains: a layer of seven, three above it.

    The grains of the layer (z = 0) touch the wall.
    """
    sites = close_packed(13)
    sites = sites[sites[:, 2] > -0.1]
    order = np.argsort(np.linalg.norm(sites, axis=1), kind="stable")
    return sites[order[: min(n, 10)]]


def stiffness_matrix(centres, pair, wall=None):
    """Stiffness matrix (6n, 6n) of touching grains, coordinates (x, r theta), SI.

    Rows of the springs, from the definitions of the displacements (S12 eqs 8-10, 24) about a
    contact just formed: n.(dx1 - dx2); [dx1 - dx2]_t - r (th1 + th2) x n; R (th2 - th1) x n;
    (th1 - th2).n. With `wall`, grains at z = 0 touch it.
    """
    n = len(centres)
    K = np.zeros((6 * n, 6 * n))
    r = pair.r
    for i, j in combinations(range(n), 2):
        d = centres[i] - centres[j]
        if np.linalg.norm(d) < 1.01:
            _add_springs(K, pair, d / np.linalg.norm(d), r, i, j, pair.R)
    if wall is not None:
        for i in np.flatnonzero(np.abs(centres[:, 2]) < 0.1):
            _add_springs(K, wall, np.array([0.0, 0.0, 1.0]), r, i, None, r)
    return K


def _add_springs(K, contact, n, r, i, j, R):
    across = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])  # theta -> -theta x n
    tangential = np.eye(3) - np.outer(n, n)
    rows = []
    for k, dx, turn1, turn2 in (
        (contact.k_n, n[None, :], np.zeros((1, 3)), np.zeros((1, 3))),
        (contact.k_s, tangential, across, across),
        (contact.k_r, np.zeros((3, 3)), across * R / r, -across * R / r),
        (contact.k_t / r**2, np.zeros((1, 3)), n[None, :], -n[None, :]),
    ):
        row = np.zeros((len(dx), K.shape[0]))
        row[:, 6 * i : 6 * i + 3] = dx
        row[:, 6 * i + 3 : 6 * i + 6] = turn1
        if j is not None:
            row[:, 6 * j : 6 * j + 3] = -dx
            row[:, 6 * j + 3 : 6 * j + 6] = turn2
        rows.append(sqrt(k) * row)
    B = np.concatenate(rows)
    K += B.T @ B


def highest_frequency(K, mass):
    """Largest angular frequency [rad/s]; a rotation r theta has the mass 2/5 m."""
    scale = np.tile(np.r_[np.ones(3), np.full(3, sqrt(2.5))], len(K) // 6) / sqrt(mass)
    return sqrt(np.linalg.eigvalsh(K * np.outer(scale, scale))[-1])


def stiffest_period(material, interaction, grains, walls):
    """Shortest period [s] of `grains` grains that may pack densely, with or without walls."""
    pair = constants.pair_constants(material, interaction)
    mass = constants.grain_mass(material)
    clusters = [stiffness_matrix(close_packed(grains), pair)] if grains > 1 else []
    if walls:
        wall = constants.wall_constants(material, interaction)
        clusters.append(stiffness_matrix(on_a_wall(grains), pair, wall))
    if not clusters:
        return float("inf")
    return 2.0 * pi / max(highest_frequency(K, mass) for K in clusters)


def largest_stable_step(period):
    """Limit of the leapfrog: dt < 2/omega = T/pi [s]."""
    return period / pi
