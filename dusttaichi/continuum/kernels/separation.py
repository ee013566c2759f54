"""A contact that opens.

A body leaves what is not of its kind where it would be pulled, and comes back. Dust may leave what
is rigid or elastic, an elastic body all others.

One number for each particle decides in both passes, so that no work appears from nothing: `gap` is
-1 where the contact is closed, and else the gap at which it has opened. It opens where the stress
of the particle along the normal is tensile and the gap grows, and closes when the gap is as small
again.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels.store import COLUMN

CLOSED = -1.0


@ti.data_oriented
class Separation:
    """Contacts of particles that open.

    fields, lists: see store.place; blocks: blocks.Blocks; slope: that of the smoothing kernel;
    images: images.Images or None.
    """

    def __init__(self, fields, lists, blocks, *, slope, images):
        self.f, self.lists, self.blocks, self.slope = fields, lists, blocks, slope
        self.n = blocks.n
        self.images, self.surfaces = images, images is not None

    @ti.func
    def follow(self, i, stress: ti.template(), numbers: ti.template()):
        """Open or close the contact of particle i; stress: the present one [Pa].

        At a surface the normal and the gap are its own. Elsewhere the normal is the gradient of the
        foreign volume around it, gap and its rate are means over the foreign particles, weighted as
        in the normal.
        """
        x, v = self.f.x[i], self.f.v[i]
        normal = ti.Vector.zero(ti.f64, self.n)
        separation, motion = normal, normal
        total = 0.0
        for k in range(self.blocks.begin(i), self.blocks.end(i)):
            j = self.lists.near[k]
            if self.f.side[j] != self.f.side[i]:
                d = x - self.f.x[j]
                weight = -self.f.volume[j] * self.slope(d.norm_sqr(), numbers.inv_h, numbers.scale)
                total += weight
                normal += weight * d
                separation += weight * d
                motion += weight * (v - self.f.v[j])
        if ti.static(self.surfaces):
            nearest = 2.0 * numbers.h
            for e in range(self.lists.touch_first[i], self.lists.touch_first[i + 1]):
                row = self.lists.touch_row[e]
                touch = self.images.touch(i, row, numbers)
                if touch[0] < nearest and self.f.rigid[row, COLUMN.layer] == 0.0:
                    # a surface goes before what else there is
                    nearest, total = touch[0], 1.0
                    normal = self.images.rigid.flat(ti.Vector([touch[1], touch[2], touch[3]]))
                    separation = nearest * normal
                    motion = self.images.relative_motion(i, row, numbers)
        gap = self.f.gap[i]
        length = normal.norm()
        if total > 0.0 and length > 0.0:
            normal /= length
            strain, rate = separation.dot(normal) / total, motion.dot(normal) / total
            pull = normal.dot(stress @ normal)
            if gap < 0.0 and pull > 0.0 and rate > 0.0:
                gap = strain
            elif gap >= 0.0 and strain < gap:
                gap = CLOSED
        else:
            # out of reach: what comes back touches where it has touched first
            gap = ti.max(gap, CLOSED)
        self.f.gap[i] = gap
