"""Numerical fracture: particles of a body that pair although nothing has yielded.

An elastic body has no strength that it could exceed, and dust that has not yielded is strained by
a few per cent at most. Where neighbours of such a body are far nearer than at the start, the method
has broken it, by hourglass modes or the tensile instability, and not its material.
"""

import numpy as np
import scipy

from dusttaichi.continuum.dust_measure import compute_intact_fraction, elastic_of_particles
from dusttaichi.continuum.physics import strength
from dusttaichi.errors import GuardStop
from dusttaichi.method import moment
from dusttaichi.results.roles import DUST, ELASTIC

PAIRED = 0.5
"""Distance of a pair over that of nearest neighbours at the start, scaled with the volumes: whole
bodies stay above 0.85 (docs/continuum.md), those that break reach 0.02 to 0.3."""
BEYOND = 1.01
"""Distance that is examined over that of pairs, for rounding."""
LEAST, SHARE = 4, 0.02
"""Number and share of the particles of a body that pair before it counts as broken."""
YIELDED = 0.05
"""Plastic strain, of volume or shear, up to which dust counts as not yielded."""
APART = 1.1
"""Ratio of the steps of two looks: searching all neighbours at each record would take long."""


class Pairing:
    """Watch over the bodies of a DustState, from its step 0.

    state: DustState. environment: Environment. sample: its Particles. threads: that search. looked:
    step of the last look.
    """

    def __init__(self, state, environment, sample, threads=1):
        self._state, self._environment, self.looked = state, environment, 0
        self.names = [body.name for body in sample.bodies] or ["the dust"]
        gives = np.isin(sample.role, (DUST, ELASTIC))
        self.bodies = [np.flatnonzero(gives & (sample.body == k)) for k in range(len(self.names))]
        self.elastic, self.volume = sample.role == ELASTIC, sample.mass / sample.density
        self.reference = state.in_order(state.of_particles("reference"))
        self.apart, self._threads = np.full(len(sample), np.inf), threads
        for rows_of_body in self.bodies:
            x = sample.position[rows_of_body]
            self.apart[rows_of_body] = _nearest(x, np.inf, threads)

    def check(self):
        """Raise GuardStop if a body has broken by pairing; looks now and then."""
        step = self._environment.step
        if step < APART * self.looked or step == self.looked:
            return
        self.looked = step
        cracked = self._state.in_order(compute_intact_fraction(self._state)) < 1.0
        for name, body in zip(self.names, self.bodies, strict=True):
            if cracked[body].any():
                continue  # its material has broken it, and parts of it meet again
            near = self.distances(body, BEYOND * PAIRED)
            paired = near < PAIRED
            if paired.sum() >= max(LEAST, SHARE * len(body)):
                raise GuardStop(self._text(name, body, near[paired], paired.sum() / len(body)))

    def distances(self, body, farthest=np.inf):
        """Distance to the nearest neighbour of particles that have not yielded, (n,).

        Over that at the start, scaled with the volumes. body: numbers of particles of a body.
        farthest: ratio beyond which some are infinite, since fewer neighbours are examined.
        """
        state = self._state
        body = body[self._whole()[body]]
        x = state.in_order(state.of_particles("x"))[body]
        volume = state.in_order(state.of_particles("mass") / state.of_particles("density"))[body]
        grown = (volume / self.volume[body]) ** (1.0 / state.dimension)
        at_start = self.apart[body] * grown
        nearest = _nearest(x, farthest * at_start.max(initial=0.0), self._threads)
        return nearest / at_start

    def _whole(self):
        """True for particles that have not yielded, (N,) bool, in the order of the sample."""
        if self.elastic.all():
            return self.elastic
        state = self._state
        volume = state.of_particles("mass") / state.of_particles("density")
        elastic = elastic_of_particles(state)[:, 2]
        lost = state.of_particles("work")[:, 2] - elastic
        m = state.material_of()
        limit = strength.shear(state.of_particles("density") / m.rho_s, m) * volume
        solid = lost < YIELDED * limit
        moved = np.abs(state.in_order(state.of_particles("reference")) / self.reference - 1.0)
        return self.elastic | (state.in_order(solid) & (moved < YIELDED))

    def _text(self, name, body, near, fraction):
        elastic = self.elastic[body[0]]
        state_text = "has no strength" if elastic else "has not yielded there"
        cure = "numerics.hourglass: 1" if elastic else "numerics.artificial_stress: on"
        return (
            f"{moment(self._environment)} {name} has broken by the method, not by its material "
            f"(numerical fracture): {fraction:.0%} of its particles have paired, the nearest at "
            f"{near.min():.2g} of their spacing, and it {state_text}. Try {cure}, a smaller "
            "numerics.spacing, or a lower speed."
        )


def _nearest(x, farthest, threads):
    """Distance of each of the points (n, 3) or (n, 2) to the nearest other one, (n,).

    Infinite where that is not nearer than `farthest`.
    """
    if len(x) < 2:
        return np.full(len(x), np.inf)
    # points of a lattice: a tree of medians takes longer, and is no better
    tree = scipy.spatial.cKDTree(x, balanced_tree=False, compact_nodes=False)
    return tree.query(x, k=2, distance_upper_bound=farthest, workers=threads)[0][:, 1]
