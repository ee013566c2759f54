"""Neighbour lists: every pair within reach, from particles and ghosts sorted into cells.

Particles in memory one after another are a block, of `lanes` particles, with one list: all that is
within reach of one of them.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import Scan, whole
from dusttaichi.samples.continuum.particles import DUST, ELASTIC

FARTHEST = 1e10  # m; beyond, the place of a particle does not count as a number
MOST_CELLS, FURTHER_CELLS = 4.0, 16  # capacity in cells: for each particle, and in addition
FAR = 1e100  # m, farther than any particle
WIDER = 1.3  # of the cells where they would be more


@ti.data_oriented
class Lists:
    """fields, lists: see store.place; layout: store.Layout."""

    def __init__(self, fields, lists, layout):
        self.f, self.lists, self.n = fields, lists, layout.dimension
        self.lanes = layout.lanes
        self.scan = Scan(lists.chunk_sum)
        self.counts = lists.counts

    @ti.func
    def yields(self, i):
        """1 where particle i is of dust or an elastic body that moves by itself."""
        role = self.f.role[i]
        return ti.cast(role == DUST or role == ELASTIC, ti.i32)

    @ti.func
    def cell_of(self, x, inv_width):
        """The cell of a place along each axis; what is outside is in the outermost."""
        cell = ti.Vector.zero(ti.i32, self.n)
        for a in ti.static(range(self.n)):
            place = (x[a] - self.lists.grid_origin[a]) * inv_width
            cell[a] = ti.max(0, ti.min(ti.floor(place, ti.i32), self.lists.grid_cells[a] - 1))
        return cell

    @ti.func
    def place_lanes(self, block, n, x: ti.template()):
        """Write the places of those particles of a block, of n in all, that have neighbours.

        Lane l of axis a is x[a lanes + l]; lanes without one are out of reach of everything.
        Returns two corners of the box around them, and how many they are.
        """
        low, found = ti.Vector([FAR] * self.n, ti.f64), 0
        high = -low
        for lane in range(self.lanes):
            i, moves = block * self.lanes + lane, 0
            if i < n:
                moves = self.yields(i)
            found += moves
            for a in ti.static(range(self.n)):
                x[a * self.lanes + lane] = FAR
                if moves == 1:
                    place = self.f.x[i][a]
                    x[a * self.lanes + lane] = place
                    low[a], high[a] = ti.min(low[a], place), ti.max(high[a], place)
        return low, high, found

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
    def neighbours(self, block, n, reach2, inv_width, write: ti.template()):
        """Number of neighbours of a block, of n particles in all; listed where `write` is set."""
        x = ti.Vector.zero(ti.f64, ti.static(self.n * self.lanes))
        low, high, lanes = self.place_lanes(block, n, x)
        start, found = self.lists.first[block], 0
        if lanes > 0:
            begin, cells = self.cell_of(low, inv_width) - 1, self.cell_of(high, inv_width) + 2
            visits = 1
            for a in ti.static(range(self.n)):
                begin[a] = ti.max(begin[a], 0)
                cells[a] = ti.min(cells[a], self.lists.grid_cells[a]) - begin[a]
                visits *= cells[a]
            for visit in range(visits):
                cell = self.cell_in_box(begin, cells, visit)
                for k in range(self.lists.cell_first[cell], self.lists.cell_first[cell + 1]):
                    j = self.lists.in_cell[k]
                    if self.in_reach(x, j, reach2) > 0 and self.others(block, j):
                        if ti.static(write):
                            self.lists.entry[start + found] = j
                        found += 1
        return found

    @ti.func
    def cell_in_box(self, begin, cells, visit):
        """Number of a cell of the grid; visit: its number among `cells` along each axis."""
        rest, number, stride = visit, 0, 1
        for b in ti.static(range(self.n)):
            a = ti.static(self.n - 1 - b)
            number += stride * (begin[a] + rest % cells[a])
            rest //= cells[a]
            stride *= self.lists.grid_cells[a]
        return number

    @ti.func
    def others(self, block, j):
        """False where particle j is all of the block, and no neighbour of itself."""
        out = ti.cast(True, ti.u1)
        if ti.static(self.lanes == 1):
            out = j != block
        return out


def make_list(lists):
    """Two kernels: `count(n, reach2, inv_width)` neighbours and starts of lists; `write` them.

    Of blocks of n particles. inv_width: one over the width of a cell of the grid [1/m].
    """
    lanes = lists.lanes

    @ti.kernel
    def count(n: ti.i32, reach2: ti.f64, inv_width: ti.f64):
        blocks = whole(n, lanes)
        for block in range(blocks):
            lists.counts[block] = lists.neighbours(block, n, reach2, inv_width, False)
        lists.scan.exclusive(lists.counts, lists.lists.first, blocks)
        for _ in range(1):
            last = blocks - 1
            lists.lists.first[blocks] = lists.lists.first[last] + lists.counts[last]

    @ti.kernel
    def write(n: ti.i32, reach2: ti.f64, inv_width: ti.f64):
        for block in range(whole(n, lanes)):
            lists.neighbours(block, n, reach2, inv_width, True)

    return count, write


def make_measure(fields, lists, rigid, StepNumbers):
    """Kernel `measure(row, numbers)`: distance of all particles from a surface [m].

    It is that of a face or rigid body, and is written into `distance`.
    """

    @ti.kernel
    def measure(row: ti.i32, numbers: StepNumbers):
        for i in range(numbers.count):
            arm = rigid.arm(row, fields.x[i], numbers)
            lists.distance[i] = rigid.surface(row, arm, numbers.h)[0]

    return measure
