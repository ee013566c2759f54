"""Contact pointers and foot points of S12 (sect. 2.1.3) from the history of contacts, and back.

A contact keeps its rolling and sliding displacement (physics.contact.kinematics); results and
samples have the pointers n1, n2 of the two grains, and of a wall contact n1 and the foot point.
history: rows of GrainState.rows("history"); normals: unit vectors n_c, of walls n_w; all vectors
(rows, 3), lengths in um, radii (rows, 1).
"""

from dusttaichi.physics.geometry import dot_rows, measure_rows


def unit(n):
    """The vectors (rows, 3) at unit length."""
    return n / measure_rows(n)[:, None]


def touching(layout, history):
    """True for rows that are contacts that touch, (rows,) of bool."""
    return history[:, layout.rows["touched"][0]] > 0.5


def pair_pointers(layout, history, normal, radii):
    """Pointers n1, n2 of pairs that touch; radii: of both."""
    xi, zeta = _displacements(layout, history)
    r1, r2 = radii
    slid = zeta / (r1 + r2)
    return unit(xi / r1 + slid - normal), unit(xi / r2 - slid + normal)


def pair_displacements(n1, n2, normal, radii):
    """xi and zeta of pairs with these pointers."""
    (e1, e2), (r1, r2) = (n1 + normal, n2 - normal), radii
    return r1 * r2 / (r1 + r2) * (e1 + e2), r1 * e1 - r2 * e2


def wall_pointers(layout, history, grain):
    """Pointers n1 and foot points of contacts with walls that touch.

    grain: (place, radius, normal, reduced radius) of each.
    """
    position, radius, normal, reduced = grain
    xi, zeta = _displacements(layout, history)
    # of a flat wall R = r, and zeta is of the foot alone
    n1 = unit(xi / radius + zeta * (1.0 - reduced / radius) / radius - normal)
    return n1, position + radius * n1 - zeta


def wall_displacements(n1, foot, grain):
    """xi and zeta of contacts with walls with these pointers and foot points."""
    position, radius, normal, reduced = grain
    arm = position + radius * n1 - foot
    zeta = arm - dot_rows(arm, normal)[:, None] * normal
    return radius * (n1 + normal) - zeta * (1.0 - reduced / radius), zeta


def _displacements(layout, history):
    return (history[:, first : first + 3] for first, _ in (layout.rows[n] for n in ("xi", "zeta")))
