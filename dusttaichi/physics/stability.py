"""The stiffest period of a scene, and the largest stable time step.

The springs of a contact couple displacements and rotations, so a grain with many contacts rings
faster than a pair: sliding with both grains turning has w^2 = 7 k_s/m for a pair, 13 for a
triangle, 27 for a close-packed 13. The largest eigenvalue of M^-1 K is computed here for the
densest cluster that the scene's grains can form, free and standing on a wall.
"""

from functools import cache, lru_cache
from itertools import combinations
from math import inf, pi, sqrt

import numpy as np
import scipy

from dusttaichi.physics.contact.effect_registry import law_of


@cache
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
    selection = [0]
    while len(selection) < min(n, 13):
        candidates = [k for k in range(13) if k not in selection]
        links = [
            np.sum(np.linalg.norm(sites[selection] - sites[k], axis=1) < 1.01) for k in candidates
        ]
        selection.append(candidates[int(np.argmax(links))])
    centres = sites[selection]
    centres.setflags(write=False)  # every later caller gets the same array
    return centres


@cache
def on_a_wall(n):
    """Unit-diameter centres of up to ten close-packed grains: a layer of seven, three above it.

    The grains of the layer (z = 0) touch the wall.
    """
    sites = close_packed(13)
    sites = sites[sites[:, 2] > -0.1]
    order = np.argsort(np.linalg.norm(sites, axis=1), kind="stable")
    centres = sites[order[: min(n, 10)]]
    centres.setflags(write=False)
    return centres


def stiffness_matrix(centres, pair, walls=()):
    """Stiffness and damping matrix, (6n, 6n) each, SI, of touching grains in (x, r theta).

    Rows of the springs, from the definitions of the displacements (S12 eqs 8-10, 24) about a
    contact just formed: n.(dx1 - dx2); [dx1 - dx2]_t - r (th1 + th2) x n; R (th2 - th1) x n;
    (th1 - th2).n. walls: (ContactConstants, normal, strength of its springs but the normal one,
    numbers of the grains that touch it).
    """
    n = len(centres)
    K, C = np.zeros((6 * n, 6 * n)), np.zeros((6 * n, 6 * n))
    for i, j in combinations(range(n), 2):
        d = centres[i] - centres[j]
        if np.linalg.norm(d) < 1.01:
            _add_springs((K, C), pair, d / np.linalg.norm(d), (i, j))
    for wall, normal, strength, grains in walls:
        for i in grains:
            _add_springs((K, C), wall, np.array(normal, float), (i, None), strength)
    return K, C


def _add_springs(matrices, contact, n, grains, strength=1.0):
    """Add the springs of a contact to (K, C). n: its normal; grains: (i, j), j None for a wall."""
    (K, C), (i, j), rows = matrices, grains, []
    four = springs(contact, n, strength)
    for k, dx, turn1, turn2 in four:
        row = np.zeros((len(dx), K.shape[0]))
        row[:, 6 * i : 6 * i + 3] = dx
        row[:, 6 * i + 3 : 6 * i + 6] = turn1
        if j is not None:
            row[:, 6 * j : 6 * j + 3] = -dx
            row[:, 6 * j + 3 : 6 * j + 6] = turn2
        rows.append(np.sqrt(k) * row)
    B = np.concatenate(rows)
    K += B.T @ B
    C += contact.kappa / four[0][0] * np.outer(B[0], B[0])


def stiffness(contact, name):
    """Stiffness k_n, k_s, k_r or k_t of a contact.

    With the part that its further effects add (`STIFFNESS`: kind of spring -> their number).
    """
    base_stiffness, effects = getattr(contact, name), getattr(contact, "interaction", None)
    effects = () if effects is None else effects.effects
    added = [getattr(law_of("effects", effect), "STIFFNESS", {}) for effect in effects]
    return base_stiffness + sum(contact.numbers[number[name]] for number in added if name in number)


def springs(contact, n, strength=1.0, ratio=1.0):
    """(stiffness, dx, turn1, turn2) of the four springs of contacts with the normals n.

    contact: its numbers r, R, k_n, k_s, k_r, k_t; all may be arrays (..., 1, 1) for n (..., 3).
    strength: factor on all but the normal one. ratio: r1/r2, for r2 theta2 in turn2. A spring is
    stretched by dx (x1 - x2) + turn1 (r1 theta1) + turn2 (r2 theta2), (..., m, 3) each.
    """
    r, R = contact.r, contact.R
    row = n[..., None, :]
    across = np.cross(np.eye(3), row)  # theta -> -theta x n
    tangential = np.eye(3) - n[..., :, None] * row
    return (
        (stiffness(contact, "k_n"), row, 0.0 * row, 0.0 * row),
        (strength * stiffness(contact, "k_s"), tangential, across, across),
        (
            strength * stiffness(contact, "k_r"),
            0.0 * across,
            across * R / r,
            -across * R / r * ratio,
        ),
        (strength * stiffness(contact, "k_t") / r**2, 0.0 * row, row, -row * ratio),
    )


def highest(matrix, mass):
    """Largest eigenvalue of M^-1 times the matrix; a rotation r theta has the mass 2/5 m."""
    scale = np.tile(np.r_[np.ones(3), np.full(3, sqrt(2.5))], len(matrix) // 6) / sqrt(mass)
    return max(0.0, np.linalg.eigvalsh(matrix * np.outer(scale, scale))[-1])


def highest_frequency(K, mass):
    """Largest angular frequency [rad/s]."""
    return sqrt(highest(K, mass))


AXES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
FEW = 8  # grains that may all touch every wall of a box made for them


def clusters(pair, wall, grains, strengths):
    """Matrices of the stiffest arrangements of `grains` grains.

    strengths: of the six walls, 0 for one that is not there, or None without walls.
    """
    out = [stiffness_matrix(close_packed(grains), pair)] if grains > 1 else []
    if strengths is None:
        return out
    present_walls = [(axis, s) for axis, s in zip(AXES, strengths, strict=True) if s is not None]
    if grains <= FEW:
        sites = close_packed(grains)
        walls = [(wall, axis, s, range(len(sites))) for axis, s in present_walls]
        return [*out, stiffness_matrix(sites, pair, walls)]
    sites = on_a_wall(grains)
    layer = np.flatnonzero(np.abs(sites[:, 2]) < 0.1)
    strongest = max(s for _, s in present_walls)
    out.append(stiffness_matrix(sites, pair, [(wall, (0, 0, 1), strongest, layer)]))
    # a corner: the walls of three axes, and the neighbours along them
    corner = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    walls = []
    for k in range(3):
        strengths_of_axis = [s for axis, s in present_walls if axis[k]]
        if strengths_of_axis:
            walls.append(
                (wall, np.eye(3)[k], max(strengths_of_axis), np.flatnonzero(corner[:, k] < 0.5))
            )
    return [*out, stiffness_matrix(corner, pair, walls)]


@lru_cache(maxsize=64)  # the runs of a study mostly have the same
def stiffest(mass, pair, wall, grains, strengths=None):
    """(shortest period [s], highest damping rate [1/s]) of `grains` grains that may pack densely.

    pair, wall: ContactConstants. strengths: factor on the springs (but the normal one) of the six
    walls, None for one left out.
    """
    matrices = clusters(pair, wall, grains, strengths)
    if not matrices:
        return float("inf"), 0.0
    omega = max(highest_frequency(K, mass) for K, _ in matrices)
    return 2.0 * pi / omega, max(highest(C, mass) for _, C in matrices)


def damped_limit(mass, pair, wall, grains, strengths=None):
    """Largest stable step [s] of the arrangements of `stiffest`, each with its own modes.

    The sum of `largest_stable_step` takes the stiffest mode for the most damped one; here it is the
    largest eigenvalue of dt^2/4 M^-1 K + dt M^-1 C that must stay below 1 (physics.network).
    """

    def limit(K, C):
        period = 2.0 * pi / max(highest_frequency(K, mass), 1e-300)
        low = largest_stable_step(period, highest(C, mass))
        # between the sum of both, which is too much, and each alone, which is too little
        return scipy.optimize.brentq(
            lambda dt: highest(0.25 * dt**2 * K + dt * C, mass) - 1.0,
            0.999 * low,
            4.0 * low,
            rtol=1e-6,
        )

    return min((limit(K, C) for K, C in clusters(pair, wall, grains, strengths)), default=inf)


def largest_stable_step(period, rate=0.0):
    """Largest stable step [s] of the leapfrog: (omega dt/2)^2 + rate dt < 1.

    Without damping it is T/pi. The damping force is carried forward from the last two half steps
    (Adams-Bashforth), which alone is stable for rate dt < 1; the sum is on the safe side.
    """
    a = (pi / period) ** 2
    return 2.0 / (rate + sqrt(rate**2 + 4.0 * a)) if a + rate > 0.0 else float("inf")
