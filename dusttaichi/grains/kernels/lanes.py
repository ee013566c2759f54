"""Portable vectorisation: W contacts an iteration.

Taichi's CPU back end does not vectorise loops, but arithmetic on `ti.types.vector(W, ...)` becomes
SIMD code. A scalar of the physics is such a vector, a 3-vector a struct of three of them.
"""

from functools import cache

import taichi as ti


@cache
def vec3(width, real=ti.f64):
    """The struct of three lane vectors of `width` contacts, of float type `real`.

    An expression has the type of what it is made of, whatever the struct says: a scene in mixed
    precision has lanes of both, and says where one becomes the other.
    """
    lane = ti.types.vector(width, real)

    @ti.dataclass
    class Vec3:
        x: lane
        y: lane
        z: lane

        @ti.func
        def dot(self, o):
            return self.x * o.x + self.y * o.y + self.z * o.z

        @ti.func
        def plus(self, o):
            return Vec3(self.x + o.x, self.y + o.y, self.z + o.z)

        @ti.func
        def minus(self, o):
            return Vec3(self.x - o.x, self.y - o.y, self.z - o.z)

        @ti.func
        def times(self, s):
            return Vec3(self.x * s, self.y * s, self.z * s)

        @ti.func
        def cross(self, o):
            return Vec3(
                self.y * o.z - self.z * o.y,
                self.z * o.x - self.x * o.z,
                self.x * o.y - self.y * o.x,
            )

        @ti.func
        def unit(self):
            """Unit vector for a length already near 1 (two Newton steps; zero stays zero)."""
            a = 1.5 - 0.5 * self.dot(self)
            b = 1.5 - 0.5 * a * a * self.dot(self)
            return self.times(a * b)

        @ti.func
        def turned(self, angle):
            """Rotated by the vector `angle`, to second order; the length grows by angle^4/8."""
            return self.plus(angle.cross(self.plus(angle.cross(self).times(0.5))))

    return Vec3
