"""The largest stable step of a given network of contacts (NumPy and SciPy, SI).

The leapfrog, with the damping force carried forward from the last two half steps, first fails in
the mode that flips sign every step: there dt^2/4 A q + dt C q = q, with A = M^-1/2 K M^-1/2 and C
the damping matrix scaled likewise. So the limit is where the largest eigenvalue of dt^2/4 A + dt C
reaches 1; without damping that is dt = 2/omega = T/pi. (For a single mode a = (omega dt)^2,
c = rate dt the multipliers solve z^3 + (a + 1.5 c - 2) z^2 + (1 - 2 c) z + c/2 = 0, of which the
Jury conditions leave a/4 + c < 1 as the first to fail.)
"""

from dataclasses import dataclass
from math import inf, pi, sqrt
from types import SimpleNamespace

import numpy as np
import scipy

from dusttaichi.physics.stability import springs

DENSE = 400  # rows of a matrix up to which computing all eigenvalues is fastest


@dataclass(frozen=True)
class Contacts:
    """The C contacts of a network, SI: arrays (C,), the normal (C, 3).

    grain_i, grain_j: the two grains, by number; grain_j is -1 at a wall. normal: unit vector.
    strength: factor on the springs of rolling, sliding and twisting, as of a weak side wall.
    ratio: r1/r2. r: radius of the first grain, R: reduced radius [m]. k_n: slope of the normal
    force at the current overlap, k_s, k_r: stiffness of sliding and rolling [N/m]; k_t: of twisting
    [N m]. kappa: damping of the normal motion at that overlap [kg/s].
    """

    grain_i: np.ndarray
    grain_j: np.ndarray
    normal: np.ndarray
    strength: np.ndarray
    ratio: np.ndarray
    r: np.ndarray
    R: np.ndarray
    k_n: np.ndarray
    k_s: np.ndarray
    k_r: np.ndarray
    k_t: np.ndarray
    kappa: np.ndarray


def matrices(contacts, mass):
    """A and C (see above), sparse (6N, 6N), in sqrt(m) x and sqrt(2/5 m) r theta. mass: (N,)."""
    size, sqrt_mass = len(contacts.r), np.sqrt(mass)
    constants = {name: getattr(contacts, name)[:, None, None] for name in ("r", "R")}
    constants |= {
        k: np.maximum(getattr(contacts, k), 0.0)[:, None, None]
        for k in ("k_n", "k_s", "k_r", "k_t")
    }
    spring_blocks = springs(
        SimpleNamespace(**constants),
        contacts.normal,
        contacts.strength[:, None, None],
        contacts.ratio[:, None, None],
    )
    i, j = contacts.grain_i, np.maximum(contacts.grain_j, 0)
    is_grain = (contacts.grain_j >= 0).astype(float)
    scale = (
        1.0 / sqrt_mass[i],
        sqrt(2.5) / sqrt_mass[i],
        is_grain / sqrt_mass[j],
        is_grain * sqrt(2.5) / sqrt_mass[j],
    )
    first = (6 * i, 6 * i + 3, 6 * j, 6 * j + 3)

    def rows(root, dx, turn1, turn2):
        m = dx.shape[-2]
        number = np.arange(size * m).reshape(size, m, 1)
        row, column, value = [], [], []
        for block, factor, start in zip((dx, turn1, -dx, turn2), scale, first, strict=True):
            filled = root * np.broadcast_to(block, (size, m, 3)) * factor[:, None, None]
            row.append(np.broadcast_to(number, filled.shape).ravel())
            column.append((start[:, None, None] + np.arange(3) + 0 * number).ravel())
            value.append(filled.ravel())
        indices = (np.concatenate(row), np.concatenate(column))
        return scipy.sparse.csr_array(
            (np.concatenate(value), indices), shape=(size * m, 6 * len(mass))
        )

    A = scipy.sparse.csr_array((6 * len(mass), 6 * len(mass)))
    for k, *blocks in spring_blocks:
        B = rows(np.sqrt(k), *blocks)
        A = A + B.T @ B
    B = rows(np.ones((size, 1, 1)), *spring_blocks[0][1:])
    return A.tocsr(), (B.T @ scipy.sparse.diags_array(contacts.kappa) @ B).tocsr()


def largest(matrix):
    """Largest eigenvalue of a symmetric sparse matrix without negative ones, to 1e-4."""
    if matrix.nnz == 0:
        return 0.0
    if matrix.shape[0] <= DENSE:
        return max(0.0, float(np.linalg.eigvalsh(matrix.toarray())[-1]))
    start = np.random.default_rng(1).normal(size=matrix.shape[0])
    eigenvalues = scipy.sparse.linalg.eigsh(
        matrix, k=1, which="LA", tol=1e-4, v0=start, return_eigenvectors=False
    )
    return max(0.0, float(eigenvalues[0]))


def limit(contacts, mass):
    """(shortest period [s], largest stable step [s]) of a network; infinite without contacts."""
    if len(contacts.r) == 0:
        return inf, inf
    A, C = matrices(contacts, mass)
    square, rate = largest(A), largest(C)
    period = 2.0 * pi / sqrt(square) if square > 0.0 else inf
    if rate == 0.0 or square == 0.0:
        return period, 2.0 / sqrt(square) if square > 0.0 else inf
    # each alone is an upper bound, their sum a lower one
    high = min(2.0 / sqrt(square), 1.0 / rate)
    low = 2.0 / (rate + sqrt(rate**2 + square))

    def beyond(dt):
        return largest(0.25 * dt**2 * A + dt * C) - 1.0

    low, high = 0.99 * low, 1.01 * high
    return period, scipy.optimize.brentq(beyond, low, high, rtol=1e-4)
