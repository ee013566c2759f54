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


class Aggregate:
    """A cluster that grows by what is shot at it, from all sides, and stays where it touches.

    positions: (N, 3) [m], the first grain at the origin. grains: Grains so far. impact_parameter:
    of every shot, over the sum of the outer radii about the centre of mass; None: any, even over
    the disc.
    """

    def __init__(self, first: Grains, impact_parameter=None):
        self.positions, self.grains = np.zeros((1, 3)), first
        self.impact = impact_parameter

    @property
    def reach(self) -> float:
        """Of the farthest centre from the first grain [m]."""
        return float(np.sqrt((self.positions**2).sum(axis=1)).max())

    def add(self, body, grains: Grains, rng) -> None:
        """Shoot a body (n, 3) of grains, about its centre, at the aggregate."""
        x, before = self.positions, len(self.positions)
        together = _joined(self.grains, grains)
        touch = together.distance(np.arange(before, len(together))[:, None], np.arange(before))
        # any disc that covers all does, where the impact parameter is even over it
        centre = np.zeros(3) if self.impact is None else self._centre()
        outer = np.sqrt(((x - centre) ** 2).sum(axis=1)) + self.grains.radii
        cover = outer.max() + (np.sqrt((body**2).sum(axis=1)) + grains.radii).max()
        landed = _shot(x, (body, touch), (centre, cover), self.impact, rng)
        self.positions, self.grains = np.concatenate([x, landed]), together

    def centred(self) -> np.ndarray:
        """Positions about the centre of the grains' volume, (N, 3) [m]."""
        return self.positions - self._centre()

    def _centre(self):
        volume = self.grains.radii**3
        return volume @ self.positions / volume.sum()


def aggregate(grains: Grains, rng, cluster: int = 1, impact_parameter=None) -> np.ndarray:
    """Centres (N, 3) [m] of particle-cluster aggregation about the centre of their volume.

    cluster: grains of what is shot; of more than one, a cluster that has grown by `clusters`.
    """
    first = grains.taken(slice(0, cluster))
    out = Aggregate(first, impact_parameter)
    out.positions = clusters(first, rng)
    for begin in range(cluster, len(grains), cluster):
        own = grains.taken(slice(begin, begin + cluster))
        out.add(clusters(own, rng), own, rng)
    return out.centred()


def _shot(targets, flying, about, impact, rng):
    """Where a body that is shot from afar comes to rest, (n, 3); misses are shot again.

    flying: its centres about their mean (n, 3), and where each touches each target (n, targets).
    about: centre of the targets and the sum of the outer radii.
    """
    (body, touch), (centre, cover) = flying, about
    shots = SHOTS if len(body) == 1 else 1
    while True:
        directions = random_directions(rng, shots)
        off = random_in_disc(rng, shots)
        if impact is not None:
            off *= impact / np.linalg.norm(off, axis=1, keepdims=True)
        turned = body if len(body) == 1 else body @ random_rotations(rng, 1)[0].T
        u, v = across(directions)
        starts = centre + cover * (off[:, :1] * u + off[:, 1:] * v - 2.0 * directions)
        apart = targets - starts[:, None, None] - turned[:, None]
        along = np.einsum("sbtc,sc->sbt", apart, directions)
        square = (apart**2).sum(axis=3) - along**2
        hits = arrival(along, square, touch).min(axis=(1, 2))
        hit = np.flatnonzero(np.isfinite(hits))
        if len(hit):
            return starts[hit[0]] + turned + hits[hit[0]] * directions[hit[0]]


def clusters(grains: Grains, rng, mass_ratio: float = 1.0) -> np.ndarray:
    """Centres (N, 3) [m] of cluster-cluster aggregation about their mean, of any number of grains:
    two parts that have grown on their own meet, the second with mass_ratio (up to 1) times as many
    grains as the first."""
    count = len(grains)
    if count == 1:
        return np.zeros((1, 3))
    larger = min(max(round(count / (1.0 + mass_ratio) + 1e-9), 1), count - 1)
    first = np.arange(count) < max(larger, count - larger)
    one, other = (clusters(grains.taken(part), rng, mass_ratio) for part in (first, ~first))
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
