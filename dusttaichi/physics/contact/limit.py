"""Elastic limits without branches: how far a displacement is past its limit, and the way back."""

import taichi as ti


@ti.func
def limit(x, critical):
    """|x|, its inverse, and the part of x past the limit: 1 - x_crit/|x| where positive, else 0."""
    square = x.dot(x) + 1e-36
    inverse = 1.0 / ti.sqrt(square)
    return square * inverse, inverse, ti.max(1.0 - critical * inverse, 0.0)


@ti.func
def restoring(n, x, inverse):
    """alpha = 1/(1 - a^2), a = n.x/|x|: makes up for what renormalising n takes away.

    Three terms of the series: a is half the displacement over the radius (1e-3), so they are exact
    to rounding; at a = 0.3 they are 7e-4 short.
    """
    a = n.dot(x) * inverse
    a2 = a * a
    return 1.0 + a2 * (1.0 + a2 * (1.0 + a2))
