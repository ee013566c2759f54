"""Images behind faces, for all particles of a block at once.

Behind a plane the image of a neighbour k (see images) is at the same place for every particle: the
mirror image of k, which moves with twice the velocity of the face less that of k. The loops over
images are thus those over neighbours, with other places and velocities. Faces do not turn, and
nothing asks for their torque.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels.rigid import LEAST
from dusttaichi.continuum.kernels.store import COLUMN

OUT_OF_REACH = 4.0  # of h: distance of a particle that has no images behind a face


@ti.data_oriented
class Planes:
    """fields, lists: see store.place; blocks: blocks.Blocks; images: images.Images."""

    def __init__(self, fields, lists, blocks, images):
        self.f, self.lists, self.blocks = fields, lists, blocks
        self.rigid, self.is_closed, self.clear = images.rigid, images.is_closed, images.clear
        self.n, self.lanes = blocks.n, blocks.lanes

    @ti.func
    def near_any(self, block, numbers: ti.template()):
        """True where a particle of the block may touch a surface."""
        behind = ti.min((block + 1) * self.lanes, numbers.count)
        return self.lists.touch_first[block * self.lanes] < self.lists.touch_first[behind]

    @ti.func
    def touch(self, i, row):
        """The touch of particle i with a face, -1 without one."""
        plane_row = -1
        for e in range(self.lists.touch_first[i], self.lists.touch_first[i + 1]):
            if self.lists.touch_row[e] == row:
                plane_row = e
        return plane_row

    @ti.func
    def plane(self, row, numbers: ti.template()):
        """Row of a face, a point of it (`point`), its normal and velocity, (dimension,) each."""
        touch = self.rigid.surface(row, ti.Vector.zero(ti.f64, 3), numbers.h)
        normal = self.rigid.flat(ti.Vector([touch[1], touch[2], touch[3]]))
        point = self.rigid.flat(self.rigid.vector(row, COLUMN.centre))
        speed = self.rigid.flat(self.rigid.vector(row, COLUMN.speed))
        return ti.Struct(row=row, place=point, normal=normal, speed=speed)

    @ti.func
    def place_lanes(self, block, plane, block_lanes: ti.template(), numbers: ti.template()):
        """Write places and velocities of a block to `own.motion`, and to `own.face` two rows.

        These are 1 of closed contacts, and heights above the face. No place is nearer to the face
        than a surface lets it be, and those of particles that have no images there are out of
        reach. Returns the least distance of one from the face.
        """
        n, lanes = ti.static(self.n, self.lanes)
        nearest = OUT_OF_REACH * numbers.h
        for lane in range(lanes):
            i = self.blocks.particle(block, lane, numbers)
            height = plane.normal.dot(self.f.x[i] - plane.place)
            distance = OUT_OF_REACH * numbers.h
            if self.touch(i, plane.row) >= 0:
                distance = ti.max(height, LEAST * numbers.h)
            nearest = ti.min(nearest, distance)
            block_lanes.face[lane], block_lanes.face[lanes + lane] = (
                self.is_closed(i, plane.row),
                height,
            )
            for a in ti.static(range(n)):
                nearer = self.f.x[i][a] + (distance - height) * plane.normal[a]
                block_lanes.motion[a * lanes + lane] = nearer
                block_lanes.motion[(n + a) * lanes + lane] = self.f.v[i][a]
        return nearest

    @ti.func
    def image(self, j, plane, numbers: ti.template()):
        """Distance and height of particle j from a face, place x and velocity v of its image."""
        height = plane.normal.dot(self.f.x[j] - plane.place)
        distance = ti.max(height, LEAST * numbers.h)
        x = self.f.x[j] - (distance + height) * plane.normal
        return ti.Struct(distance=distance, height=height, x=x, v=2.0 * plane.speed - self.f.v[j])

    @ti.func
    def in_reach(self, lane, d, image, normal, face: ti.template(), numbers: ti.template()):
        """1 where a lane and the neighbour of that image are in reach of each other.

        d: from the image to the lane. Beyond the face an image may be nearer than the neighbour
        itself, whose list may lack this particle.
        """
        along, apart = normal.dot(d), face[self.lanes + lane] - image.height
        far = d.norm_sqr() - along * along + apart * apart
        return ti.select(far < 4.0 * numbers.h * numbers.h, 1.0, 0.0)

    @ti.func
    def load(self, e, stress, viscous, grid):
        """Write what touch e does to its face: twice the reaction to each part of the force."""
        self.clear(e)
        for component, force in ti.static(enumerate((stress, viscous, grid))):
            raised = self.rigid.raise_to_space(force)
            for a in ti.static(range(3)):
                self.lists.touch[e, 6 * component + a] = -2.0 * raised[a]
