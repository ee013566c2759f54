"""What contacts keep from step to step, as pointers and feet and back.

Double precision keeps the pointers themselves, mixed precision by what they deviate from the line
of centres, and zeta in place of the foot (physics.contact.deviation). Results and samples have
pointers. state: rows of GrainState.lanes("state"); normals: unit vectors n_c, of walls n_w; all
vectors (rows, 3), lengths in um.
"""

import numpy as np


def unit(n):
    """The vectors (rows, 3) at unit length."""
    return n / np.linalg.norm(n, axis=1)[:, None]


def touching(layout, state):
    """Which rows are contacts that touch, (rows,) of bool."""
    if layout.deviations:
        return state[:, layout.touched] > 0.5
    return np.sum(_kept(layout, state)[0] ** 2, axis=1) > 0.5


def pointers(layout, state, normal):
    """Pointers n1, n2 of pairs that touch."""
    first, second = _kept(layout, state)
    if layout.deviations:
        return unit(first - normal), unit(second + normal)
    return first, second


def pointers_and_feet(layout, state, place, radius, normal):
    """Pointers n1 and feet of contacts with walls that touch; place, radius (rows, 1): of the
    grains."""
    first, second = _kept(layout, state)
    if layout.deviations:
        first = unit(first - normal)
        second = place + radius * first - second
    return first, second


def of_pairs(layout, n1, n2, normal):
    """The two vectors that pairs with these pointers keep."""
    return (n1 + normal, n2 - normal) if layout.deviations else (n1, n2)


def of_walls(layout, n1, foot, grain):
    """The same of contacts with walls. grain: (place, radius, normal), see pointers_and_feet."""
    if not layout.deviations:
        return n1, foot
    place, radius, normal = grain
    arm = place + radius * n1 - foot
    return n1 + normal, arm - np.sum(arm * normal, axis=1)[:, None] * normal


def _kept(layout, state):
    first, second = layout.first, layout.second
    return state[:, first : first + 3], state[:, second : second + 3]
