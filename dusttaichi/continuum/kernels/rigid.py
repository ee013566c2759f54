"""Faces and rigid bodies in kernels: rows of `rigid`, the motion of their points, their surfaces.

A face is a plane across an axis, a rigid body a sphere or an upright cylinder (in two dimensions a
disc or a rectangle) in its own frame. Surfaces are signed distances with normals, positive outside.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels.store import COLUMN, FACES

LEAST = 1e-2  # of h: no particle counts as nearer to a surface, or beyond it
TINY = 1e-30  # [m], keeps the middle of a body from being divided by


@ti.data_oriented
class Rigid:
    """fields: see store.place; layout: store.Layout."""

    def __init__(self, fields, layout):
        self.f, self.n, self.bodies = fields, layout.dimension, layout.bodies

    @ti.func
    def vector(self, row, begin: ti.template()):
        """Three numbers of a row of `rigid`."""
        return ti.Vector([self.f.rigid[row, begin + a] for a in ti.static(range(3))])

    @ti.func
    def put(self, row, begin: ti.template(), values):
        for a in ti.static(range(3)):
            self.f.rigid[row, begin + a] = values[a]

    @ti.func
    def raise_to_space(self, r):
        """A vector of the kernels in three dimensions: (x, z) is (x, 0, z)."""
        out = ti.Vector.zero(ti.f64, 3)
        if ti.static(self.n == 2):
            out = ti.Vector([r[0], 0.0, r[1]])
        else:
            out = ti.Vector([r[0], r[1], r[2]])
        return out

    @ti.func
    def flat(self, r):
        """The reverse of `raise_to_space`."""
        out = ti.Vector.zero(ti.f64, self.n)
        for a in ti.static(range(self.n)):
            out[a] = r[2 if a == self.n - 1 else a]
        return out

    @ti.func
    def rotate(self, b, r, sense):
        """A vector of the frame of body b in that of the scene; sense: 1, or -1 for the reverse."""
        w, u = self.f.rigid[b, COLUMN.turn], sense * self.vector(b, COLUMN.turn + 1)
        t = 2.0 * u.cross(r)
        return r + w * t + u.cross(t)

    @ti.func
    def arm(self, row, x, numbers: ti.template()):
        """From the centre of a face or body to x, its nearest image where axes repeat, (3,)."""
        r = x - self.flat(self.vector(row, COLUMN.centre))
        for a in ti.static(range(self.n)):
            r[a] -= numbers.period[a] * ti.round(r[a] * numbers.inv_period[a])
        return self.raise_to_space(r)

    @ti.func
    def motion(self, row, arm):
        """Velocity of the point of a face or body at an arm (3,) of its centre, (dimension,)."""
        return self.flat(self.vector(row, COLUMN.speed) + self.vector(row, COLUMN.spin).cross(arm))

    @ti.func
    def surface(self, row, arm, smoothing_length):
        """Distance [m], no less than a little, and outward normal, (4,), of a point at an arm."""
        distance, normal = 0.0, ti.Vector.zero(ti.f64, 3)
        if row < FACES:
            inward = 1.0 - 2.0 * ti.cast(row % 2, ti.f64)
            for a in ti.static(range(3)):
                if row // 2 == a:
                    normal[a] = inward
                    distance = inward * arm[a]
        elif ti.static(self.bodies):
            if self.f.rigid[row, COLUMN.half_height] == 0.0:
                length = arm.norm() + TINY
                distance, normal = length - self.f.rigid[row, COLUMN.radius], arm / length
            else:
                distance, local_normal = self.cylinder(row, self.rotate(row, arm, -1.0))
                normal = self.rotate(row, local_normal, 1.0)
        return ti.Vector(
            [ti.max(distance, LEAST * smoothing_length), normal[0], normal[1], normal[2]]
        )

    @ti.func
    def cylinder(self, row, point):
        """Distance from a cylinder about z and its normal there, in the frame of the cylinder.

        Outside, its edges count as round.
        """
        across = ti.sqrt(point[0] * point[0] + point[1] * point[1]) + TINY
        up = ti.select(point[2] >= 0.0, 1.0, -1.0)
        beyond_side = across - self.f.rigid[row, COLUMN.radius]
        beyond_end = ti.abs(point[2]) - self.f.rigid[row, COLUMN.half_height]
        side, end = ti.max(beyond_side, 0.0), ti.max(beyond_end, 0.0)
        if side + end == 0.0:  # inside: the nearer of side and end
            side, end = (
                ti.select(beyond_side > beyond_end, 1.0, 0.0),
                ti.select(beyond_side > beyond_end, 0.0, 1.0),
            )
        length = ti.sqrt(side * side + end * end)
        normal = ti.Vector(
            [
                side * point[0] / across / length,
                side * point[1] / across / length,
                up * end / length,
            ]
        )
        return ti.select(
            ti.max(beyond_side, beyond_end) > 0.0, length, ti.max(beyond_side, beyond_end)
        ), normal

    @ti.func
    def share(self, row, distance):
        """Volume of the mirror image of a volume at a distance from a body, over its own.

        Below 1 in a sphere, which has less space.
        """
        out = 1.0
        if self.f.rigid[row, COLUMN.half_height] == 0.0:
            radius = self.f.rigid[row, COLUMN.radius]
            out = ti.max(radius - distance, 0.0) / (radius + distance)
            if ti.static(self.n == 3):
                out *= out
        return out
