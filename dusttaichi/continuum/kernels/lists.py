"""Neighbour lists: every pair within reach, from particles and ghosts sorted into cells."""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import Scan
from dusttaichi.samples.continuum.particles import DUST, ELASTIC

FARTHEST = 1e10  # m; beyond, the place of a particle does not count as a number
MOST_CELLS, FURTHER_CELLS = 4.0, 16  # capacity in cells: for each particle, and in addition
WIDER = 1.3  # of the cells where they would be more


@ti.data_oriented
class Lists:
    """fields, lists: see store.place; dimension: 2 or 3."""

    def __init__(self, fields, lists, dimension):
        self.f, self.lists, self.n = fields, lists, dimension
        self.scan = Scan(lists.chunk_sum)
        self.counts = lists.counts

    @ti.func
    def yields(self, i):
        """1 where particle i is of dust or an elastic body that moves by itself."""
        role = self.f.role[i]
        return ti.cast(role == DUST or role == ELASTIC, ti.i32)

    @ti.func
    def own_cell(self, i, inv_width):
        """The cell of particle i along each axis; what is outside is in the outermost."""
        cell = ti.Vector.zero(ti.i32, self.n)
        for a in ti.static(range(self.n)):
            place = (self.f.x[i][a] - self.lists.grid_origin[a]) * inv_width
            cell[a] = ti.max(0, ti.min(ti.floor(place, ti.i32), self.lists.grid_cells[a] - 1))
        return cell

    @ti.func
    def neighbours(self, i, reach2, inv_width, write: ti.template()):
        """Number of neighbours of i, which are listed where `write` is set."""
        centre, x, found = self.own_cell(i, inv_width), self.f.x[i], 0
        start = self.lists.first[i]
        for offset in ti.static(ti.grouped(ti.ndrange(*((-1, 2),) * self.n))):
            cell = centre + offset
            inside, number = 1, 0
            for a in ti.static(range(self.n)):
                along = self.lists.grid_cells[a]
                inside *= ti.cast(0 <= cell[a] < along, ti.i32)
                number = number * along + cell[a]
            if inside == 1:
                for k in range(self.lists.cell_first[number], self.lists.cell_first[number + 1]):
                    j = self.lists.in_cell[k]
                    if j != i and (x - self.f.x[j]).norm_sqr() < reach2:
                        if ti.static(write):
                            self.lists.entry[start + found] = j
                        found += 1
        return found


def make_list(lists):
    """Two kernels: `count(n, reach2, inv_width)` neighbours and starts of lists; `write` them.

    inv_width: one over the width of a cell of the grid [1/m].
    """

    @ti.kernel
    def count(n: ti.i32, reach2: ti.f64, inv_width: ti.f64):
        for i in range(n):
            # rigid and fixed particles need none
            lists.counts[i] = 0
            if lists.yields(i) == 1:
                lists.counts[i] = lists.neighbours(i, reach2, inv_width, False)
        lists.scan.exclusive(lists.counts, lists.lists.first, n)
        for _ in range(1):
            lists.lists.first[n] = lists.lists.first[n - 1] + lists.counts[n - 1]

    @ti.kernel
    def write(n: ti.i32, reach2: ti.f64, inv_width: ti.f64):
        for i in range(n):
            if lists.yields(i) == 1:
                lists.neighbours(i, reach2, inv_width, True)

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
