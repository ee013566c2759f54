"""The relative motion of the bodies of a contact, gathered from the fields of the grains.

A block of contacts is gathered into a local array first, whose loop has the scattered reads, and
computed in a second loop, which reads rows and that array alone: so the compiler turns it into
vectors. Differences of large numbers (distances, overlaps) are formed in the precision of
positions.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.cell_kinematics import make_cell
from dusttaichi.grains.kernels.contact_numbers import CURVED, WALL
from dusttaichi.grains.kernels.store import FIRST_WALL, PLANES
from dusttaichi.grains.kernels.surface_kinematics import CurvedSurfaces
from dusttaichi.physics.contact.kinematics import pair_motion, surface_motion, wall_motion
from dusttaichi.physics.surfaces import plane

plane_distance = ti.func(plane.distance)

Walls = ti.types.struct(
    normal=ti.types.matrix(6, 3, ti.f64),  # unit normals, into the sample
    offset=ti.types.vector(6, ti.f64),  # plane: x.n = offset + speed t
    speed=ti.types.vector(6, ti.f64),  # along the normal
    strength=ti.types.vector(6, ti.f64),  # of rolling, sliding, twisting
    along=ti.types.vector(6, ti.f64),  # speed along x
)


@ti.data_oriented
class Gatherer:
    """Base class of gatherers: columns of a local array, a number of each for every lane."""

    flat = False  # the second body is a wall

    def __init__(self, fields, layout, mechanics, numbers):
        self.width, self.dtype = layout.width, layout.law
        self.x, self.v, self.w = fields["x"], fields["v"], fields["w"]
        self.Motion, self.numbers = mechanics.Motion, numbers
        self.vec3 = ti.types.vector(3, layout.law)

    @ti.func
    def put(self, gathered: ti.template(), first: ti.template(), lane, vector):
        for c in ti.static(range(3)):
            gathered[(first + c) * self.width + lane] = ti.cast(vector[c], self.dtype)

    @ti.func
    def get(self, gathered: ti.template(), first: ti.template(), lane):
        width = ti.static(self.width)
        return self.vec3(
            gathered[first * width + lane],
            gathered[(first + 1) * width + lane],
            gathered[(first + 2) * width + lane],
        )


@ti.data_oriented
class PairGatherer(Gatherer):
    """Gatherer of two grains, or of a grain and the sphere.

    place: the frame of a periodic cell (kernels.cell_kinematics); not used in a scene without one.
    """

    def __init__(self, fields, layout, mechanics, numbers, contact_kind):
        super().__init__(fields, layout, mechanics, numbers)
        self.contact_kind, self.pair_i, self.pair_j = (
            contact_kind,
            fields["pair_i"],
            fields["pair_j"],
        )
        self.axes = layout.periodic
        self.shift = fields.get("shift")
        self.frame, self.across_faces, self.power = make_cell(fields, layout)
        self.columns = 13 + len(layout.periodic)

    @ti.func
    def outside(self, step, dt, box: ti.template()):
        """Frame of the cell at a step, common to all blocks."""
        return self.frame(step, dt)

    @ti.func
    def place(self, block, frame: ti.template(), time):
        """The frame of the cell, common to all blocks."""
        return frame

    @ti.func
    def place_at_step(self, block, step, dt, box: ti.template()):
        """`place` at a step, for loops of a device: what they copy from `box` is misaligned."""
        return self.frame(step, dt)

    @ti.func
    def gather(self, gathered: ti.template(), block, lane, boundary):
        i, j = self.pair_i[block, lane], self.pair_j[block, lane]
        separation, velocity = self.x[i] - self.x[j], self.v[i] - self.v[j]
        if ti.static(len(self.axes) > 0):
            separation = self.across_faces(block, lane, separation, 0, boundary)
            velocity = self.across_faces(block, lane, velocity, 1, boundary)
            for n in ti.static(range(len(self.axes))):
                gathered[(13 + n) * self.width + lane] = ti.cast(
                    self.shift[block, n, lane], self.dtype
                )
        touch = self.numbers.touch_of(self.contact_kind, block, lane)
        # both terms are some 1e4 times the gap of grains that touch
        gathered[3 * self.width + lane] = ti.cast(
            touch * touch - separation.dot(separation), self.dtype
        )
        self.put(gathered, 0, lane, separation)
        self.put(gathered, 4, lane, velocity)
        self.put(gathered, 7, lane, self.w[i])
        self.put(gathered, 10, lane, self.w[j])

    @ti.func
    def motion(self, gathered: ti.template(), lane, dt, constants, boundary):
        gap = gathered[3 * self.width + lane]
        separation, velocity = self.get(gathered, 0, lane), self.get(gathered, 4, lane)
        spin_i, spin_j = self.get(gathered, 7, lane), self.get(gathered, 10, lane)
        return pair_motion(self.Motion, separation, gap, velocity, spin_i, spin_j, dt, constants)

    @ti.func
    def power_of_faces(self, gathered: ti.template(), lane, force, boundary):
        """Power of the moving faces of the cell on a contact between images."""
        out = 0.0 * force[0]
        if ti.static(len(self.axes) > 0):
            for n in ti.static(range(len(self.axes))):
                out += self.power(n, gathered[(13 + n) * self.width + lane], force, boundary)
        return out

    @ti.func
    def strength(self, boundary):
        return ti.cast(1.0, self.dtype)


@ti.data_oriented
class WallGatherer(Gatherer):
    """Relative motion of a grain and a wall. place: of a block, see `place`."""

    flat, contact_kind, columns = True, WALL, 10

    def __init__(self, fields, layout, mechanics, numbers):
        super().__init__(fields, layout, mechanics, numbers)
        self.counts, self.geometry = fields["counts"], layout.geometry
        self.grain, self.gap, self.of = fields["wall_grain"], fields["wall_gap"], fields["wall_of"]
        self.place3 = ti.types.vector(3, layout.geometry)

    @ti.func
    def wall_block(self, block):
        """Number of a block among those of walls."""
        return block - self.counts[FIRST_WALL]

    @ti.func
    def outside(self, step, dt, box: ti.template()):
        """Walls, common to all blocks."""
        return box

    @ti.func
    def place(self, block, box: ti.template(), time):
        """Wall of a block: unit normal, offset at `time`, velocity, strength.

        box: Walls, or fields of the same names and shapes.
        """
        plane = self.of[self.wall_block(block)]
        normal = self.place3(box.normal[plane, 0], box.normal[plane, 1], box.normal[plane, 2])
        velocity = normal * ti.cast(box.speed[plane], self.geometry)
        velocity[0] += ti.cast(box.along[plane], self.geometry)
        return ti.Struct(
            normal=normal, offset=box.offset[plane] + box.speed[plane] * time, velocity=velocity,
            strength=ti.cast(box.strength[plane], self.dtype),
        )  # fmt: skip

    @ti.func
    def place_at_step(self, block, step, dt, box: ti.template()):
        """`place` at a step, without a copy of `box`."""
        return self.place(block, box, dt * step)

    @ti.func
    def gather(self, gathered: ti.template(), block, lane, boundary):
        wall_block = self.wall_block(block)
        i = self.grain[wall_block, lane]
        distance = plane_distance(self.x[i], boundary) + self.gap[wall_block, lane]
        touch = self.numbers.touch_of(self.contact_kind, block, lane)
        gathered[lane] = ti.cast(touch - distance, self.dtype)
        self.put(gathered, 1, lane, self.v[i] - boundary.velocity)
        self.put(gathered, 4, lane, self.w[i])
        # the same for all lanes: a shorter loop would be unrolled, and its array not seen through
        self.put(gathered, 7, lane, boundary.normal)

    @ti.func
    def motion(self, gathered: ti.template(), lane, dt, constants, boundary):
        velocity, spin, normal = (
            self.get(gathered, 1, lane),
            self.get(gathered, 4, lane),
            self.get(gathered, 7, lane),
        )
        return wall_motion(self.Motion, gathered[lane], normal, velocity, spin, dt)

    @ti.func
    def power_of_faces(self, gathered: ti.template(), lane, force, boundary):
        return 0.0 * force[0]

    @ti.func
    def strength(self, boundary):
        return boundary.strength


@ti.data_oriented
class SurfaceGatherer(WallGatherer):
    """Relative motion of a grain and a wall, where there are surfaces behind the six planes."""

    columns = 17

    def __init__(self, fields, layout, mechanics, numbers):
        super().__init__(fields, layout, mechanics, numbers)
        self.surfaces = CurvedSurfaces(layout.curved, fields["surfaces"])
        self.load = fields["load"]

    @ti.func
    def place(self, block, box: ti.template(), time):
        """Wall of a block: a plane as of WallGatherer, with the number of the wall and the time."""
        wall = self.of[self.wall_block(block)]
        plane, strength = ti.min(wall, PLANES - 1), ti.cast(0.0, ti.f64)
        normal = self.place3(box.normal[plane, 0], box.normal[plane, 1], box.normal[plane, 2])
        velocity = normal * ti.cast(box.speed[plane], self.geometry)
        velocity[0] += ti.cast(box.along[plane], self.geometry)
        strength = box.strength[plane]
        for n in ti.static(range(self.surfaces.count)):
            if wall == PLANES + n:
                strength = self.surfaces.strength(n)
        return ti.Struct(
            normal=normal, offset=box.offset[plane] + box.speed[plane] * time, velocity=velocity,
            strength=ti.cast(strength, self.dtype), wall=wall, time=ti.cast(time, ti.f64),
        )  # fmt: skip

    @ti.func
    def row(self, boundary):
        """Row of `numbers` of the contacts with the wall of a block."""
        return ti.select(boundary.wall < PLANES, WALL, CURVED + boundary.wall - PLANES)

    @ti.func
    def gather(self, gathered: ti.template(), block, lane, boundary):
        wall_block = self.wall_block(block)
        i = self.grain[wall_block, lane]
        x, v, normal = self.x[i], self.v[i], ti.cast(boundary.normal, ti.f64)
        distance = ti.cast(plane_distance(x, boundary), ti.f64)
        velocity, turning = ti.cast(boundary.velocity, ti.f64), 0.0 * normal
        spin, speed = 0.0 * normal, normal.dot(ti.cast(v - boundary.velocity, ti.f64))
        for n in ti.static(range(self.surfaces.count)):
            if boundary.wall == PLANES + n:
                touch = self.surfaces.touch(n, x, v, boundary.time)
                distance, speed, normal = touch.distance, touch.speed, touch.normal
                turning, velocity, spin = touch.turning, touch.velocity, touch.spin
        first_touch = self.numbers.touch_of(self.row(boundary), block, lane)
        gathered[lane] = ti.cast(first_touch - distance - self.gap[wall_block, lane], self.dtype)
        self.put(gathered, 1, lane, ti.cast(v, ti.f64) - velocity)
        self.put(gathered, 4, lane, self.w[i])
        self.put(gathered, 7, lane, normal)
        self.put(gathered, 10, lane, turning)
        gathered[13 * self.width + lane] = ti.cast(speed, self.dtype)
        self.put(gathered, 14, lane, spin)

    @ti.func
    def motion(self, gathered: ti.template(), lane, dt, constants, boundary):
        dv, normal, turning = (
            self.get(gathered, 1, lane),
            self.get(gathered, 7, lane),
            self.get(gathered, 10, lane),
        )
        spins = self.get(gathered, 4, lane), self.get(gathered, 14, lane)
        speed = gathered[13 * self.width + lane]
        return surface_motion(
            self.Motion, gathered[lane], normal, turning * dt, speed, dv, spins[0], spins[1], dt
        )

    @ti.func
    def load_of(self, block, lane, boundary):
        """Force of a surface on a grain, its component along the normal, and its power."""
        force = ti.Vector([ti.cast(self.load[block, k, lane], ti.f64) for k in ti.static(range(3))])
        torque = ti.Vector(
            [ti.cast(self.load[block, 6 + k, lane], ti.f64) for k in ti.static(range(3))]
        )
        pressing, power = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        i = self.grain[self.wall_block(block), lane]
        for n in ti.static(range(self.surfaces.count)):
            if boundary.wall == PLANES + n:
                touch = self.surfaces.touch(n, self.x[i], self.v[i], boundary.time)
                pressing = force.dot(touch.normal)
                power = force.dot(touch.velocity) - torque.dot(touch.spin)
        return ti.Vector([force[0], force[1], force[2], pressing, power])

    @ti.func
    def load_of_block(self, block, boundary):
        """Sum of `load_of` over the lanes of a block."""
        total = ti.Vector.zero(ti.f64, 5)
        for lane in range(self.width):
            total += self.load_of(block, lane, boundary)
        return total
