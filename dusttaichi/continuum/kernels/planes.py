"""Images behind faces, for all particles of a block at once.

Behind a plane the image of a neighbour k (see images) is at the same place for every particle: the
mirror image of k, that moves with twice the velocity of the face less that of k. The loops over
images are thus those over neighbours, with other places and velocities. Faces do not turn, and
nothing asks for their torque.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels.rigid import LEAST
from dusttaichi.continuum.kernels.store import CENTRE, PARTS, SPEED

OUT_OF_REACH = 4.0  # of h: distance of a particle that has no images behind a face


@ti.data_oriented
class Planes:
    """fields, lists: see store.place; blocks: blocks.Blocks; rigid: kernels.rigid.Rigid."""

    def __init__(self, fields, lists, blocks, rigid):
        self.f, self.lists, self.blocks, self.rigid = fields, lists, blocks, rigid
        self.n, self.lanes = blocks.n, blocks.lanes

    @ti.func
    def frame(self, row, numbers: ti.template()):
        """A point of a face, its normal and its velocity, (dimension,) each."""
        touch = self.rigid.surface(row, ti.Vector.zero(ti.f64, 3), numbers.h)
        normal = self.rigid.flat(ti.Vector([touch[1], touch[2], touch[3]]))
        place = self.rigid.flat(self.rigid.vector(row, CENTRE))
        return place, normal, self.rigid.flat(self.rigid.vector(row, SPEED))

    @ti.func
    def touch(self, i, row):
        """The touch of particle i with a face, -1 without one."""
        found = -1
        for e in range(self.lists.touch_first[i], self.lists.touch_first[i + 1]):
            if self.lists.touch_row[e] == row:
                found = e
        return found

    @ti.func
    def near_any(self, block, numbers: ti.template()):
        """True where a particle of the block is near a surface."""
        behind = ti.min((block + 1) * self.lanes, numbers.count)
        return self.lists.touch_first[block * self.lanes] < self.lists.touch_first[behind]

    @ti.func
    def place_lanes(
        self, block, row, place, normal, x: ti.template(), v: ti.template(), numbers: ti.template()
    ):
        """Write places, no nearer to the face than any is, and velocities of those with images.

        Returns the least distance of one from the face; the others are out of reach.
        """
        nearest = OUT_OF_REACH * numbers.h
        for lane in range(self.lanes):
            i = self.blocks.particle(block, lane, numbers)
            away = normal.dot(self.f.x[i] - place)
            distance = OUT_OF_REACH * numbers.h
            if self.touch(i, row) >= 0:
                distance = ti.max(away, LEAST * numbers.h)
            nearest = ti.min(nearest, distance)
            for a in ti.static(range(self.n)):
                x[a * self.lanes + lane] = self.f.x[i][a] + (distance - away) * normal[a]
                v[a * self.lanes + lane] = self.f.v[i][a]
        return nearest

    @ti.func
    def last(self, first):
        """The entry behind the last one of the neighbours that have images, for `neighbour`."""
        # on a device a particle is no neighbour of itself, but it has an image
        return self.blocks.end(first) + ti.static(1 if self.lanes == 1 else 0)

    @ti.func
    def neighbour(self, k, first):
        """The particle of an entry."""
        j = first
        if ti.static(self.lanes > 1) or k < self.blocks.end(first):
            j = self.lists.near[k]
        return j

    @ti.func
    def distance(self, j, place, normal, numbers: ti.template()):
        """Distance of particle j from a face (rigid.surface) and from its image there."""
        away = normal.dot(self.f.x[j] - place)
        least = ti.max(away, LEAST * numbers.h)
        return least, least + away

    @ti.func
    def load(self, e, stress, viscous, grid):
        """Write what touch e does to its face: twice the reaction to each part of the force."""
        for c in ti.static(range(PARTS)):
            self.lists.touch[e, c] = 0.0
        for part, force in ti.static(enumerate((stress, viscous, grid))):
            raised = self.rigid.raised(force)
            for a in ti.static(range(3)):
                self.lists.touch[e, 6 * part + a] = -2.0 * raised[a]
