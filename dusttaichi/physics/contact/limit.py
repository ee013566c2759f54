"""Elastic limits without branches: how far a displacement exceeds its limit."""

from dusttaichi.compute.engine import ti


@ti.func
def limit_displacement(x, critical, k):
    """Excess of the displacement x of a linear spring k over the limit |x| = critical.

    Returns a struct: `over`, the fraction of x beyond the limit, 1 - critical/|x| where positive,
    else 0; `lost`, the energy k x_after (x_before - x_after) that putting x back dissipates.
    """
    square = x.dot(x) + 1e-36
    over = ti.max(1.0 - critical / ti.sqrt(square), 0.0)
    return ti.Struct(over=over, lost=(k * square) * (over - over * over))
