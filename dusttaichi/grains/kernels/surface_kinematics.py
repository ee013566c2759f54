"""Curved surfaces in the passes: distance, normal and velocity of each at a point.

The field `surfaces` has a row for each (physics.surfaces.surface_model); its law is plain
Python, compiled here. All is computed in double precision: how the distance and the normal have
changed in a step is the difference of two of them.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.physics.surfaces.surface_model import SHIFT, SPIN, STEP, STRENGTH, VELOCITY


@ti.data_oriented
class CurvedSurfaces:
    """Evaluation of a SurfaceModel; table: the field `surfaces`."""

    def __init__(self, model, table):
        self.table, self.width, self.first = table, model.width, model.motion
        self.numbers_of, self.count = model.columns, len(model)
        self.distances = tuple(ti.func(law.distance) for law in model.laws)
        self.normals = tuple(ti.func(law.normal) for law in model.laws)
        self.has_centre = tuple("centre" in law.NUMBERS for law in model.laws)
        self.vec3 = ti.types.vector(3, ti.f64)
        self.structs = tuple(
            ti.types.struct(**{name: self.vec3 if n == 3 else ti.f64 for name, _, n in columns})
            for columns in model.columns
        )
        self.Touch = ti.types.struct(
            distance=ti.f64, speed=ti.f64, normal=self.vec3, turning=self.vec3, velocity=self.vec3,
            spin=self.vec3,
        )  # fmt: skip

    @ti.func
    def number(self, n: ti.template(), column: ti.template(), time):
        return self.table[n, column] + self.table[n, self.width + column] * time

    @ti.func
    def read(self, n: ti.template(), entry: ti.template(), time):
        """A number of surface n at a time: a scalar or a vector."""
        if ti.static(entry[2] == 1):
            return self.number(n, entry[1], time)
        else:
            return self.vec3(*[self.number(n, entry[1] + k, time) for k in range(3)])

    @ti.func
    def numbers(self, n: ti.template(), time):
        """Struct of the numbers of surface n at a time."""
        return self.structs[n](*[self.read(n, entry, time) for entry in self.numbers_of[n]])

    @ti.func
    def vector(self, n: ti.template(), column: ti.template()):
        first = ti.static(self.first + column)
        return self.vec3(self.table[n, first], self.table[n, first + 1], self.table[n, first + 2])

    @ti.func
    def local(self, n: ti.template(), x, time):
        """A point as the surface sees it, which has gone its way."""
        return ti.cast(x, ti.f64) - self.vector(n, SHIFT) - self.vector(n, VELOCITY) * time

    @ti.func
    def distance(self, n: ti.template(), x, time):
        """Distance of a point from surface n."""
        return self.distances[n](self.local(n, x, time), self.numbers(n, time))

    @ti.func
    def normal(self, n: ti.template(), x, s: ti.template()):
        a, b, c = self.normals[n](x, s)
        return self.vec3(a, b, c)

    @ti.func
    def touch(self, n: ti.template(), x, v, time):
        """Motion of a point of velocity v against surface n.

        distance, and its rate over the last step; unit normal, and its rate; velocity of the point
        of the surface that is nearest, and its angular velocity.
        """
        dt, spin = self.table[n, ti.static(self.first + STEP)], self.vector(n, SPIN)
        place, now, before = (
            self.local(n, x, time),
            self.numbers(n, time),
            self.numbers(n, time - dt),
        )
        earlier = place - (ti.cast(v, ti.f64) - self.vector(n, VELOCITY)) * dt
        distance, normal = self.distances[n](place, now), self.normal(n, place, now)
        speed = (distance - self.distances[n](earlier, before)) / dt
        turning = (normal - self.normal(n, earlier, before)) / dt
        foot = place - normal * distance
        if ti.static(self.has_centre[n]):
            foot -= now.centre
        opening = (self.distances[n](place, before) - distance) / dt
        velocity = self.vector(n, VELOCITY) + spin.cross(foot) + normal * opening
        return self.Touch(
            distance=distance, speed=speed, normal=normal, turning=turning, velocity=velocity,
            spin=spin,
        )  # fmt: skip

    @ti.func
    def strength(self, n: ti.template()):
        """Factor on rolling, sliding and twisting at surface n."""
        return self.table[n, ti.static(self.first + STRENGTH)]
