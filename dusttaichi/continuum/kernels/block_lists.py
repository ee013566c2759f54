"""Lists of the continuum: neighbours of blocks, images of particles, the surfaces near them.

Particles in memory one after another are a block, of `lanes` particles, with one list: all that is
within reach of one of them.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import count_blocks
from dusttaichi.results.roles import DUST, ELASTIC

PARTICLES, SEEN = range(2)  # in `known`: particles, and with images
REACH, TOUCH, H = range(3)  # in `reaches`: of lists, of surfaces, smoothing length [m]
# columns of `axes`, a row for each: low end, length, one over that; planes that images are beyond
LOW, PERIOD, INV_PERIOD, PLANES = range(4)
ORDER, COUNT, LIST = range(3)  # in `phase` of a search (kernels.search_kernels.make_search)
FAR = 1e100  # m, farther than any particle


@ti.data_oriented
class Neighbours:
    """Lists of blocks (particles.lists). fields, lists: see store.place; layout: store.Layout."""

    def __init__(self, fields, lists, layout):
        self.f, self.lists, self.n = fields, lists, layout.dimension
        self.lanes, self.first, self.room = layout.lanes, lists.first, lists.entry.shape[0]

    @ti.func
    def yields(self, i):
        """1 where particle i is of dust or an elastic body that moves by itself."""
        role = self.f.role[i]
        return ti.cast(role == DUST or role == ELASTIC, ti.i32)

    @ti.func
    def place_lanes(self, block, n, x: ti.template()):
        """Write the places of those particles of a block, of n in all, that have neighbours.

        Lane l of axis a is x[a lanes + l]; lanes without one are out of reach of everything.
        Returns two corners of the box around them, and how many they are.
        """
        low, count = ti.Vector([FAR] * self.n, ti.f64), 0
        high = -low
        for lane in range(self.lanes):
            i, moves = block * self.lanes + lane, 0
            if i < n:
                moves = self.yields(i)
            count += moves
            for a in ti.static(range(self.n)):
                x[a * self.lanes + lane] = FAR
                if moves == 1:
                    coordinate = self.f.x[i][a]
                    x[a * self.lanes + lane] = coordinate
                    low[a], high[a] = ti.min(low[a], coordinate), ti.max(high[a], coordinate)
        return low, high, count

    @ti.func
    def in_reach(self, x: ti.template(), j, reach2):
        """Number of lanes at the places x that have particle j within reach."""
        x_j, out = self.f.x[j], 0
        for lane in range(self.lanes):
            r2 = 0.0
            for a in ti.static(range(self.n)):
                d = x[a * self.lanes + lane] - x_j[a]
                r2 += d * d
            out += ti.cast(r2 < reach2, ti.i32)
        return out

    @ti.func
    def count(self):
        """Number of blocks."""
        return count_blocks(self.lists.known[PARTICLES], self.lanes)

    @ti.func
    def entries(self, block, cells: ti.template(), grid: ti.template(), listing):
        """Number of neighbours of a block; listed if `listing`. cells: particles.cells.Cells."""
        x = ti.Vector.zero(ti.f64, ti.static(self.n * self.lanes))
        low, high, lanes = self.place_lanes(block, self.lists.known[PARTICLES], x)
        start, count, reach = self.first[block], 0, self.lists.reaches[REACH]
        if lanes > 0:
            begin = cells.find_cell(low, grid) - 1
            size = cells.find_cell(high, grid) + 2 - begin
            for cut in range(size[0]):
                for run in range(cells.runs(size)):
                    first_cell, behind, _ = cells.run(begin, size, cut, run, grid)
                    for k in range(
                        self.lists.cell_first[first_cell], self.lists.cell_first[behind]
                    ):
                        j = self.lists.in_cell[k]
                        if self.in_reach(x, j, reach * reach) > 0:
                            if listing:
                                self.lists.entry[start + count] = j
                            count += 1
        return count


@ti.data_oriented
class NearThings:
    """Lists of the things near a particle, of a few in a table (particles.lists).

    near: Neighbours; first: first entries; room: capacity in entries.
    """

    def __init__(self, near, first, room):
        self.f, self.lists, self.near, self.n = near.f, near.lists, near, near.n
        self.first, self.room = first, room

    @ti.func
    def count(self):
        return self.lists.known[PARTICLES]

    @ti.func
    def is_full(self):
        return self.first[self.count()] > self.room

    @ti.func
    def entries(self, i, listing: ti.template()):
        """Number of the things near particle i; listed if `listing`."""
        count, m = 0, 0
        # a compiler that knows the length of this loop makes it eight times as long
        while self.is_there(m):
            if self.is_near(i, m) and self.near.yields(i) == 1:
                if ti.static(listing):
                    if self.first[i] + count < self.room:
                        self.put(i, m, self.first[i] + count)
                count += 1
            m += 1
        return count


@ti.data_oriented
class Ghosts(NearThings):
    """Images of particles beyond mirrors and periodic faces. motion: motion.Motion."""

    def __init__(self, motion, near):
        lists = motion.lists
        super().__init__(near, lists.ghost_first, lists.ghost_sign.shape[0])
        self.motion, self.sides = motion, motion.layout.sides

    @ti.func
    def is_there(self, m):
        return self.lists.images[m, 0] != 0.0

    @ti.func
    def is_near(self, i, m):
        """True if image number m of particle i is within reach of the space of the originals."""
        out = ti.cast(True, ti.u1)
        for a in ti.static(range(self.n)):
            x = self.f.x[i][a] * self.lists.images[m, a] + self.lists.images[m, self.n + a]
            reach = self.lists.reaches[REACH]
            out &= self.lists.axes[a, PLANES] - x < reach
            out &= x - self.lists.axes[a, PLANES + 1] < reach
        return out

    @ti.func
    def put(self, i, m, g):
        """Sign and shift of an image of particle i, and what neighbours read in the first pass."""
        for a in ti.static(range(self.n)):
            self.lists.ghost_sign[g, a] = self.lists.images[m, a]
            self.lists.ghost_shift[g, a] = self.lists.images[m, self.n + a]
        if ti.static(self.sides):
            self.f.side[self.count() + g] = self.f.side[i]
        self.motion.move_ghost(i, g, self.count() + g)


@ti.data_oriented
class Touches(NearThings):
    """Pairs of particle and rigid surface that may touch before the next search.

    rigid: kernels.rigid.Rigid.
    """

    def __init__(self, rigid, near):
        lists = near.lists
        super().__init__(near, lists.touch_first, lists.touch_row.shape[0])
        self.rigid = rigid

    @ti.func
    def is_there(self, m):
        return self.lists.surfaces[m, 0] != 0

    @ti.func
    def is_near(self, i, m):
        n, axes = ti.static(self.n, self.lists.axes)
        row = self.lists.surfaces[m, 1]
        periods = ti.Struct(
            period=ti.Vector([axes[a, PERIOD] for a in ti.static(range(n))]),
            inv_period=ti.Vector([axes[a, INV_PERIOD] for a in ti.static(range(n))]),
        )
        arm = self.rigid.arm(row, self.f.x[i], periods)
        distance = self.rigid.surface(row, arm, self.lists.reaches[H])[0]
        return distance < self.lists.reaches[TOUCH]

    @ti.func
    def put(self, i, m, e):
        self.lists.touch_row[e] = self.lists.surfaces[m, 1]
