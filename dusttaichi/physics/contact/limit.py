"""Elastic limits without branches: how far a displacement is past its limit, and the way back."""

import taichi as ti


@ti.func
def limited(x, critical, k):
    """The displacement x of a linear spring k, put back to |x| = critical where it is past that.

    over: the part of x past the limit, 1 - critical/|x| where positive, else 0; inverse: 1/|x|;
    lost: k x (displacement after) x (before - after), the energy that this costs.
    """
    square = x.dot(x) + 1e-36
    inverse = 1.0 / ti.sqrt(square)
    over = ti.max(1.0 - critical * inverse, 0.0)
    return ti.Struct(over=over, inverse=inverse, lost=(k * square) * (over - over * over))


@ti.func
def restoring(n, x, inverse):
    """alpha = 1/(1 - a^2), a = n.x/|x|: makes up for what renormalising n takes away.

    Three terms of the series: a is half the displacement over the radius (1e-3), so they are exact
    to rounding; at a = 0.3 they are 7e-4 short.
    """
    a = n.dot(x) * inverse
    a2 = a * a
    return 1.0 + a2 * (1.0 + a2 * (1.0 + a2))
