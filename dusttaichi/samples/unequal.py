"""Growth of samples from grains that are not all alike, one grain or cluster after another.

The rules are those of the generators of equal grains (pca, bcca, rbd, random_packing); what two
grains touch at is their own equilibrium distance. Grains are taken in the order they were drawn.
"""

from __future__ import annotations

import numpy as np
import scipy

from dusttaichi.samples.ballistic import (
    across,
    arrival,
    random_directions,
    random_in_disc,
    random_rotations,
)
from dusttaichi.samples.mixture import Grains
from dusttaichi.samples.sample import ROUNDING

SHOTS = 8  # of one grain at once; the first that hits counts


def aggregate(grains: Grains, rng) -> np.ndarray:
    """Centres (N, 3) [m] of particle-cluster aggregation, the first grain at the origin."""
    x = np.zeros((len(grains), 3))
    reach = grains.radii[0]
    for k in range(1, len(grains)):
        earlier = np.arange(k)
        touch = grains.distance(k, earlier)
        cover = reach + grains.radii[k]
        x[k] = _shot(x[:k], touch, cover, rng)
        reach = max(reach, float(np.linalg.norm(x[k])) + grains.radii[k])
    return x


def _shot(targets, touch, cover, rng):
    """Where a grain that is shot from afar comes to rest; misses are shot again."""
    while True:
        directions = random_directions(rng, SHOTS)
        off = random_in_disc(rng, SHOTS) * cover
        u, v = across(directions)
        starts = off[:, :1] * u + off[:, 1:] * v - 2.0 * cover * directions
        apart = targets[None] - starts[:, None]
        along = np.einsum("skc,sc->sk", apart, directions)
        square = (apart**2).sum(axis=2) - along**2
        hits = arrival(along, square, touch).min(axis=1)
        hit = np.flatnonzero(np.isfinite(hits))
        if len(hit):
            return starts[hit[0]] + hits[hit[0]] * directions[hit[0]]


def clusters(grains: Grains, rng) -> np.ndarray:
    """Centres (N, 3) [m] of cluster-cluster aggregation about their mean: halves that have grown on
    their own, of any number of grains."""
    count = len(grains)
    if count == 1:
        return np.zeros((1, 3))
    half = np.arange(count) < (count + 1) // 2
    one, other = (clusters(grains.taken(part), rng) for part in (half, ~half))
    joined = np.concatenate(_collided(one, other, grains, rng))
    return joined - joined.mean(axis=0)


def _collided(one, other, grains: Grains, rng):
    """Two bodies about their means, turned at random; the second flies at the first along -z."""
    first = np.arange(len(one))
    touch = grains.distance(np.arange(len(one), len(grains))[:, None], first[None])
    reach = sum(np.sqrt((body**2).sum(axis=1)).max() for body in (one, other)) + touch.max()
    while True:
        still, flying = (
            body @ turn.T for body, turn in zip((one, other), random_rotations(rng, 2), strict=True)
        )
        flying[:, :2] += random_in_disc(rng, 1)[0] * reach
        apart = flying[:, None] - still[None]
        flight = arrival(apart[..., 2], (apart[..., :2] ** 2).sum(axis=2), touch).min()
        if np.isfinite(flight):
            flying[:, 2] -= flight
            return still, flying


class Deposit:
    """A laterally periodic deposit on the floor z = 0 that grows drop by drop (samples.rbd).

    period: edge of the square [m]. grains: those dropped so far, positions (M, 3) [m].
    """

    def __init__(self, period: float, widest: float):
        self.period = period
        self.cells = max(1, int(period / widest))
        self.members = [[] for _ in range(self.cells**2)]
        self.positions, self.grains = np.empty((0, 3)), None

    def drop(self, grains: Grains, rng) -> None:
        """Let more grains fall, in their order."""
        before = len(self.positions)
        self.grains = grains if self.grains is None else _joined(self.grains, grains)
        x = np.empty((len(self.grains), 3))
        x[:before] = self.positions
        x[before:, :2] = rng.random((len(grains), 2)) * self.period
        for k in range(before, len(x)):
            x[k, 2] = self._height(x, k)
            self.members[self._cell(x[k])].append(k)
        self.positions = x

    def _cell(self, place) -> int:
        i, j = (np.minimum(place[:2] / self.period * self.cells, self.cells - 1)).astype(int)
        return int(i * self.cells + j)

    def _near(self, place) -> np.ndarray:
        """Numbers of the grains in the cells around a place."""
        i, j = divmod(self._cell(place), self.cells)
        n = self.cells
        around = {((i + a) % n) * n + (j + b) % n for a in (-1, 0, 1) for b in (-1, 0, 1)}
        return np.array([g for cell in sorted(around) for g in self.members[cell]], dtype=np.int64)

    def _height(self, x, k) -> float:
        """Height at which grain k comes to rest: on the floor, or on the highest that it meets."""
        near = self._near(x[k])
        floor = self.grains.radii[k]
        if not len(near):
            return floor
        apart = x[near, :2] - x[k, :2]
        apart -= self.period * np.round(apart / self.period)
        left = self.grains.distance(k, near) ** 2 - (apart**2).sum(axis=1)
        below = left > 0.0
        return max(floor, np.max(x[near[below], 2] + np.sqrt(left[below]), initial=floor))

    def surface(self, quantile: float) -> float:
        """Height [m] that this share of the tops of the cells lies below."""
        tops = [max((self.positions[g, 2] for g in cell), default=0.0) for cell in self.members]
        return float(np.quantile(tops, quantile))


def _joined(one: Grains, other: Grains) -> Grains:
    radii = np.concatenate([one.radii, other.radii])
    return Grains(radii, np.concatenate([one.numbers, other.numbers]), one.touch)


def pushed_apart(points, period, grains: Grains, *, rounds: int, evaluations: int):
    """Points (N, 3) [m] in a periodic cell moved until all stand at their distances or farther.

    None if that does not come about.
    """
    unit = 2.0 * float(grains.radii.mean())
    widest = 2.0 * float(grains.radii.max())
    x, box = points / unit, period / unit

    def energy(flat):
        """Sum of (1 - distance/touch)^2/2 over pairs that are too near, and its gradient."""
        at = np.mod(flat.reshape(-1, 3), box)
        tree = scipy.spatial.cKDTree(at, boxsize=box)
        i, j = tree.query_pairs(widest / unit, output_type="ndarray").T
        apart = at[i] - at[j]
        apart -= box * np.round(apart / box)
        length = np.sqrt((apart**2).sum(axis=1))
        # a little farther than needed, so that the springs leave no overlap in the end
        wanted = grains.distance(i, j) / unit * (1.0 + 1e-5)
        over = np.maximum(1.0 - length / wanted, 0.0)
        pull = (-over / (wanted * np.maximum(length, 1e-12)))[:, None] * apart
        gradient = np.zeros_like(at)
        np.add.at(gradient, i, pull)
        np.add.at(gradient, j, -pull)
        worst = np.max(1.0 + 1e-5 - length / wanted * (1.0 + 1e-5), initial=0.0)
        return 0.5 * float(np.sum(over**2)), gradient.reshape(-1), worst

    for _ in range(rounds):
        if energy(x.reshape(-1))[2] <= ROUNDING:
            return np.mod(x, box) * unit
        found = scipy.optimize.minimize(
            lambda flat: energy(flat)[:2],
            x.reshape(-1),
            jac=True,
            method="L-BFGS-B",
            options={"maxfun": evaluations, "maxiter": evaluations, "ftol": 0.0, "gtol": 0.0},
        )
        x = np.mod(found.x.reshape(-1, 3), box)
    return None
