"""Aggregates grown shot after shot: of unequal grains, of clusters, or at an impact parameter.

The rules are those of pca and bcca, which shoot many equal grains at once; each pair of grains
touches at its own equilibrium distance. Grains are used in the order in which they were drawn.
"""

import numpy as np

from dusttaichi.samples.ballistic import (
    across,
    arrival,
    random_directions,
    random_in_disc,
    random_rotations,
)
from dusttaichi.samples.mixture import Grains

SHOTS = 8  # simultaneous shots of one grain; the first hit is used


class Aggregate:
    """A cluster that grows by bodies that are shot at it from all sides and stick where they touch.

    positions: (N, 3) [m], the first grain at the origin. grains: Grains so far. impact_parameter:
    of every shot, over the sum of the outer radii about the centre of mass; None: uniform over the
    disc.
    """

    def __init__(self, first: Grains, impact_parameter=None):
        self.positions, self.grains = np.zeros((1, 3)), first
        self.impact = impact_parameter

    @property
    def reach(self) -> float:
        """Distance of the farthest centre from the first grain [m]."""
        return float(np.sqrt((self.positions**2).sum(axis=1)).max())

    def add(self, body, grains: Grains, rng) -> None:
        """Shoot a body (n, 3) of grains, about its centre, at the aggregate."""
        x, before = self.positions, len(self.positions)
        together = self.grains.joined([grains])
        touch = together.distance(np.arange(before, len(together))[:, None], np.arange(before))
        # with uniform impact parameters any disc that covers the aggregate suffices
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

    cluster: grains of each projectile; if more than one, a cluster grown by `clusters`.
    """
    first = grains.taken(slice(0, cluster))
    out = Aggregate(first, impact_parameter)
    out.positions = clusters(first, rng)
    for begin in range(cluster, len(grains), cluster):
        own = grains.taken(slice(begin, begin + cluster))
        out.add(clusters(own, rng), own, rng)
    return out.centred()


def _shot(targets, flying, about, impact, rng):
    """Final positions (n, 3) of a body that is shot from afar; misses are shot again.

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
    """Centres (N, 3) [m] of cluster-cluster aggregation about their mean, for any number of grains.

    Two parts that have grown independently meet, the second with mass_ratio (up to 1) times as many
    grains as the first.
    """
    count = len(grains)
    if count == 1:
        return np.zeros((1, 3))
    larger = min(max(round(count / (1.0 + mass_ratio) + 1e-9), 1), count - 1)
    first = np.arange(count) < max(larger, count - larger)
    one, other = (clusters(grains.taken(part), rng, mass_ratio) for part in (first, ~first))
    joined = np.concatenate(_collided(one, other, grains, rng))
    return joined - joined.mean(axis=0)


def _collided(one, other, grains: Grains, rng):
    """Two bodies at contact, rotated at random; the second flies at the first along -z."""
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
