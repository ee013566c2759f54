"""The relative motion of the bodies of a contact, gathered from the fields of the grains.

A block of contacts is gathered into a local array first, whose loop has the scattered reads, and
computed in a second loop, which reads rows and that array alone: so the compiler turns it into
vectors. What cancels (distances, overlaps) is formed in the precision of positions.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.domain.walls import TUBE
from dusttaichi.grains.kernels.cell_kinematics import make_cell
from dusttaichi.grains.kernels.contact_numbers import WALL
from dusttaichi.grains.kernels.store import FIRST_WALL
from dusttaichi.physics.contact.kinematics import pair_motion, surface_motion, wall_motion
from dusttaichi.physics.surfaces import cylinder, plane

Walls = ti.types.struct(
    normal=ti.types.matrix(6, 3, ti.f64),  # unit normals, into the sample
    offset=ti.types.vector(6, ti.f64),  # plane: x.n = offset + speed t
    speed=ti.types.vector(6, ti.f64),  # along the normal
    strength=ti.types.vector(6, ti.f64),  # of rolling, sliding, twisting
    along=ti.types.vector(6, ti.f64),  # speed along x
    tube=ti.types.vector(4, ti.f64),  # radius, x and y of the axis, strength
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

    place: the frame of a periodic cell (kernels.cell_kinematics); anything in a scene without.
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
        k = self.of[self.wall_block(block)]
        normal = self.place3(box.normal[k, 0], box.normal[k, 1], box.normal[k, 2])
        velocity = normal * ti.cast(box.speed[k], self.geometry)
        velocity[0] += ti.cast(box.along[k], self.geometry)
        return ti.Struct(
            normal=normal, offset=box.offset[k] + box.speed[k] * time, velocity=velocity,
            strength=ti.cast(box.strength[k], self.dtype),
        )  # fmt: skip

    @ti.func
    def place_at_step(self, block, step, dt, box: ti.template()):
        """`place` at a step, without a copy of `box`."""
        return self.place(block, box, dt * step)

    @ti.func
    def gather(self, gathered: ti.template(), block, lane, boundary):
        wall_block = self.wall_block(block)
        i = self.grain[wall_block, lane]
        distance = plane.distance(self.x[i], boundary) + self.gap[wall_block, lane]
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
class TubeGatherer(WallGatherer):
    """Relative motion of a grain and a wall, of which the one behind the planes is a tube."""

    columns = 11

    @ti.func
    def place(self, block, box: ti.template(), time):
        """Wall of a block: a plane as WallGatherer has it, the numbers of the tube, which it is."""
        wall = self.of[self.wall_block(block)]
        k, tube = ti.min(wall, TUBE - 1), wall == TUBE
        normal = self.place3(box.normal[k, 0], box.normal[k, 1], box.normal[k, 2])
        velocity = normal * ti.cast(box.speed[k], self.geometry)
        velocity[0] += ti.cast(box.along[k], self.geometry)
        return ti.Struct(
            normal=normal, offset=box.offset[k] + box.speed[k] * time,
            velocity=ti.select(tube, 0.0 * velocity, velocity),
            strength=ti.cast(ti.select(tube, box.tube[3], box.strength[k]), self.dtype),
            radius=box.tube[0], x=box.tube[1], y=box.tube[2],
            is_tube=ti.select(tube, 1.0, 0.0),
        )  # fmt: skip

    @ti.func
    def normal_at(self, x, boundary):
        """Unit normal of the wall at a point."""
        n0, n1, n2 = cylinder.normal(x, boundary)
        curved = boundary.is_tube
        return curved * self.place3(n0, n1, n2) + (1.0 - curved) * boundary.normal

    @ti.func
    def gather(self, gathered: ti.template(), block, lane, boundary):
        wall_block = self.wall_block(block)
        i = self.grain[wall_block, lane]
        x, curved = self.x[i], boundary.is_tube
        flat = plane.distance(x, boundary)
        distance = (
            ti.select(curved > 0.5, cylinder.distance(x, boundary), flat)
            + self.gap[wall_block, lane]
        )
        touch = self.numbers.touch_of(self.contact_kind, block, lane)
        gathered[lane] = ti.cast(touch - distance, self.dtype)
        self.put(gathered, 1, lane, self.v[i] - boundary.velocity)
        self.put(gathered, 4, lane, self.w[i])
        self.put(gathered, 7, lane, self.normal_at(x, boundary))
        gathered[10 * self.width + lane] = ti.cast(curved * cylinder.bend(x, boundary), self.dtype)

    @ti.func
    def motion(self, gathered: ti.template(), lane, dt, constants, boundary):
        velocity, spin, normal = (
            self.get(gathered, 1, lane),
            self.get(gathered, 4, lane),
            self.get(gathered, 7, lane),
        )
        across = self.vec3(velocity[0], velocity[1], 0.0)
        bend = gathered[10 * self.width + lane]
        return surface_motion(self.Motion, gathered[lane], normal, velocity, across, bend, spin, dt)

    @ti.func
    def in_frame(self, b, lane, force, boundary):
        """Force of a wall on a grain: of the tube along its normal, around and along its axis."""
        normal = self.normal_at(self.x[self.grain[self.wall_block(b), lane]], boundary)
        tangential = normal[0] * force[1] - normal[1] * force[0]
        turned = ti.Vector([force.dot(normal), tangential, force[2]])
        return ti.select(boundary.is_tube > 0.5, turned, force)
