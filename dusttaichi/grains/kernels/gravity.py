"""Gravity in the passes: the same acceleration everywhere, or one towards a point.

Numbers in the field `gravity`: constant: three of the acceleration; central: the three coordinates
of the centre, the strength k and the exponent n of g(d) = k d^n at the distance d.
"""

from dusttaichi.compute.engine import ti

NEAREST2 = 1e-12  # square of the distance below which the centre pulls no more [um^2]


def make_gravity(fields, layout, free=None):
    """Returns `falls(g)`: the acceleration of grain g, or of the sphere; None without gravity.

    free: field of 1, or 0 for a grain that does not fall.
    """
    x, table, real = fields["x"], fields.get("gravity"), layout.geometry
    vector = ti.types.vector(3, real)

    @ti.func
    def constant(g):
        return vector(table[0], table[1], table[2])

    @ti.func
    def central(g):
        way = vector(table[0], table[1], table[2]) - x[g]
        square = ti.max(ti.cast(way.dot(way), ti.f64), NEAREST2)
        return ti.cast(table[3] * square ** (0.5 * (table[4] - 1.0)), real) * way

    falls = {"constant": constant, "central": central}.get(layout.gravity)
    if free is None or falls is None:
        return falls

    @ti.func
    def falls_where_free(g):
        return free[g] * falls(g)

    return falls_where_free
