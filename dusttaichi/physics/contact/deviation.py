"""Contact pointers by what they deviate from the line of centres: the form for single precision.

The contact pointers n1, n2 of S12 (sect. 2.1.3) point along -n_c and n_c but for the small angles
that springs are made of, some 1e-3. A unit vector in single precision is known to 6e-8; the
deviations

    e1 = n1 + n_c,  e2 = n2 - n_c

are known to 6e-8 of themselves. They and the pointers say the same: n1 + n2 = e1 + e2, and the arm
of sliding, r1 n1 - r2 n2, is r1 e1 - r2 e2 but for a part along n_c. So the laws take either.

What cancels is formed in double precision by the caller: the distance vector d of the centres and
the gap touch^2 - d.d. What is along n_c of a deviation follows from the unit length of its pointer,
so a limit scales the parts across n_c alone, and rolling and sliding do not see each other.

Vectors are structs of lanes (grains.kernels.lanes) or anything with their methods.
"""

from dusttaichi.compute.engine import ti


@ti.func
def separation(d, gap, dv, dt, touch):
    """Struct of the distance of two grains and its change in the last step.

    d, dv: distance vector now and its rate half a step ago, so that it was d - dv dt a step ago;
    gap: touch^2 - d.d, negative where the grains are apart. overlap; inv: one over the distance;
    nc: n_c; u: rate of the distance, its change over dt; turned: change of n_c; back: n_c half a
    step ago.
    """
    length = ti.sqrt(touch * touch - gap)
    both = length + touch
    inverse = 1.0 / (length * both)  # the one division
    inv = inverse * both
    nc = d.times(inv)
    slope = d.minus(dv.times(0.5 * dt)).dot(dv) * inv
    u = slope * (1.0 + 0.5 * dt * slope * inv)
    way = u * dt
    closer = way * inv  # 1/(distance a step ago) = inv/(1 - closer)
    turned = dv.times(dt).minus(nc.times(way)).times(inv * (1.0 + closer * (1.0 + closer)))
    return ti.Struct(
        overlap=gap * inverse * length,
        inv=inv,
        nc=nc,
        u=u,
        turned=turned,
        back=nc.minus(turned.times(0.5)),
    )


@ti.func
def rotation(n, angle):
    """What the rotation by the vector `angle` adds to n, to second order."""
    return angle.cross(n.plus(angle.cross(n).times(0.5)))


@ti.func
def across(e, nc):
    """The part of e across n_c."""
    return e.minus(nc.times(e.dot(nc)))


@ti.func
def shortfall(e, along):
    """What a pointer of unit length falls short of 1 along the line of centres, 1 - sqrt(1 - e.e)
    where e is the part of its deviation across that.

    along: what the deviation was along n_c before, which tells the half of the turn where nothing
    keeps pointers from turning away from the line of centres.
    """
    behind = ti.min(ti.max((along - 1.0) * 1e20, -1.0), 1.0)
    return 1.0 + behind * ti.sqrt(ti.max(1.0 - e.dot(e), 0.0))
