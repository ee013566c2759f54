"""Outcome of a collision, in the terms of the field (Güttler 2010, Wada 2013).

Target and projectile are the heavier and the lighter body, f = (M_largest - M_target)/M_projectile
the growth efficiency.

- sticking: one fragment is all there is.
- growth: one fragment holds more than half of both bodies and more mass than the target had, f > 0.
- bouncing: both bodies have kept 95 % of their grains at least, and are apart.
- mass transfer: they are apart, and the target has gained mass, f > 0.
- erosion: the largest fragment is lighter than the target, f <= 0, by less than half.
- fragmentation: it has less than half of the target's mass.
"""

import numpy as np

from dusttaichi.analysis.fragments import fragments, growth_efficiency
from dusttaichi.analysis.frame import grain_masses
from dusttaichi.analysis.restitution import together

WHOLE = 0.95
"""Share of the mass of a body from which it counts as whole."""


def outcome(run, parts, bodies):
    """Name of the outcome, of the Fragments of the last snapshot and two bodies (grain numbers)."""
    if len(parts) == 1:
        return "sticking"
    masses = grain_masses(run)
    target = max(masses[body].sum() for body in bodies)
    grown = growth_efficiency(run, bodies=bodies) > 0.0
    if together(parts, bodies):
        return "growth" if grown else _worn(parts, target)
    if all(_kept(parts, masses, body) for body in bodies):
        return "bouncing"
    return "mass transfer" if grown else _worn(parts, target)


def _worn(parts, target):
    return "erosion" if parts.mass[0] >= 0.5 * target else "fragmentation"


def _kept(parts, masses, body):
    """True where a body is a fragment of its own: it has lost and gained little."""
    own = np.bincount(parts.label[body], masses[body], minlength=len(parts))
    largest, mass = int(np.argmax(own)), masses[body].sum()
    return own[largest] >= WHOLE * mass and parts.mass[largest] <= mass / WHOLE


def settled(run):
    """True where the last two snapshots hold the same fragments, by number and largest mass."""
    if run.snapshots.sizes["snapshot"] < 3:  # with the first alone nothing can be told
        return True
    last, before = fragments(run, -1), fragments(run, -2)
    return len(last) == len(before) and bool(
        np.isclose(last.mass[0], before.mass[0], rtol=1e-6, atol=0.0)
    )
