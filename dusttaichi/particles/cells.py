"""Particles sorted into the cells of a grid, and the cells around a place.

The search of every method, on a CPU and on a device: kernels find the extent of the particles
(Bounds), the host lays a grid over it (lay_grid), kernels sort the particles into its cells (Sort)
and examine for each particle or block those in the cells around it (Cells.run). What is listed, and
in which layout, is a matter of the method. Cells must be no narrower than the reach of its lists.
"""

from math import floor, prod

from dusttaichi.compute.device_blocks import is_idle, loop_length
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Largest, Scan, count_blocks, is_short, scan_capacity

NOWHERE = 1e300  # farther than any place


def grid_length(dimension):
    """Numbers of a grid in the field `grid`; those of the method are behind them."""
    return 4 * dimension + 2


def place_cells(dimension, capacity, cells, method_numbers=0):
    """Scratch fields, by name, of cells of at most `capacity` particles; not valid after use.

    cells: largest number of cells. method_numbers: further numbers of the method in `grid`.
    """
    shapes = {
        "cell_first": (ti.i32, (cells + 1,)),
        "in_cell": (ti.i32, (capacity,)),
        "cell_of": (ti.i32, (capacity,)),
        # what a cell has that has no place in its list yet; 0 between two sorts
        "placeless": (ti.i32, (cells + 1,)),
        "cell_chunk": (ti.i32, (scan_capacity(cells + 1),)),
        "bounds": (ti.f64, (1 + scan_capacity(capacity), 2 * dimension + 2)),
        "grid": (ti.f64, (grid_length(dimension) + method_numbers,)),
    }
    return {name: ti.field(dtype, shape=shape) for name, (dtype, shape) in shapes.items()}


def lay_grid(low, extent, width, room, *, edges, growth, tilt=0.0):
    """The numbers of a grid in the field `grid`, of at most `room` cells in all.

    low, extent: of the particles. width: of a cell along each axis, multiplied by `growth` while
    the cells are too many. edges: of a periodic cell, which whole numbers of cells fill, 0 along
    other axes: there an empty cell is on each side. tilt: see Cells.
    """
    # in Python's own numbers: NumPy takes as long for three as for a hundred
    while True:
        across = zip(extent, width, edges, strict=True)
        cells = [max(1, floor(a / w) + (edge == 0.0)) + 2 * (edge == 0.0) for a, w, edge in across]
        if prod(cells) <= room:
            break
        width = [growth * w for w in width]
    along = zip(edges, cells, width, strict=True)
    inverse = [n / edge if edge > 0.0 else 1.0 / w for edge, n, w in along]
    return [*low, *inverse, *cells, *edges, tilt, prod(cells)]


@ti.data_oriented
class Bounds:
    """Extent of the particles: row 0 of the table `bounds`.

    Largest coordinates, largest ones with the opposite sign, 1 if the place of any is `farthest`
    away or not a number, largest speed (0 without v). x, v: fields; table: see place_cells;
    count(): function, number of particles, at most `capacity`. preparations: called first, of each
    particle.
    """

    def __init__(self, x, table, count, farthest, *, capacity, v=None, preparations=()):
        self.x, self.v, self.moves, self.preparations = x, v, v is not None, preparations
        self.table, self.count, self.farthest = table, count, farthest
        self.n, self.light, self.chunks = x.n, is_short(x.shape[0]), -(-capacity // CHUNK)
        self.largest = Largest(table, self.chunks)

    @staticmethod
    def read(table):
        """(Lowest, highest coordinates, True if any is lost, largest speed) of a Table."""
        row = table.copy_rows(0, 1)[0]
        n = len(row) // 2 - 1
        return -row[n : 2 * n], row[:n], row[2 * n] > 0.0, float(row[2 * n + 1])

    @ti.func
    def find(self):
        """Find the extent of the particles. To be called outside of the loops of a kernel."""
        if ti.static(self.light):
            ti.loop_config(serialize=True)
            for _ in range(1):
                self.of_part(0, self.count(), 0)
        else:
            for chunk in range(loop_length(count_blocks(self.count(), CHUNK), self.chunks)):
                end = ti.min((chunk + 1) * CHUNK, self.count())
                self.of_part(chunk * CHUNK, end, chunk + 1)
            self.largest.find(count_blocks(self.count(), CHUNK))

    @ti.func
    def of_part(self, begin, end, row):
        """Write a row of the table, of the particles from `begin` to before `end`."""
        n = ti.static(self.n)
        high, low = ti.Vector([-NOWHERE] * n, ti.f64), ti.Vector([-NOWHERE] * n, ti.f64)
        fastest, lost = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        for i in range(begin, end):
            for function in ti.static(self.preparations):
                function(i)
            if ti.static(self.moves):
                fastest = ti.max(fastest, self.v[i].norm())
            for a in ti.static(range(n)):
                if ti.abs(self.x[i][a]) < self.farthest:
                    high[a], low[a] = ti.max(high[a], self.x[i][a]), ti.max(low[a], -self.x[i][a])
                else:
                    lost = 1.0
        for a in ti.static(range(n)):
            self.table[row, a], self.table[row, n + a] = high[a], low[a]
        self.table[row, 2 * n], self.table[row, 2 * n + 1] = lost, fastest


@ti.data_oriented
class Cells:
    """The grid, by its numbers in the field `grid`.

    numbers: field; periodic: axes across which the cells repeat; tilted: along x, as the periodic
    cell is.
    """

    def __init__(self, numbers, dimension, *, periodic=(), tilted=False):
        self.numbers, self.n, self.periodic, self.tilted = numbers, dimension, periodic, tilted
        self.outer = [int(a not in periodic) for a in range(dimension)]  # empty cells on a side
        # cells of a column are one after another, unless the column repeats
        self.columns = dimension - 1 not in periodic
        # Only numbers of eight bytes: on a GPU the loops of a kernel pass the grid on in memory,
        # where Taichi puts vectors behind each other, and a device reads eight bytes only at
        # multiples of eight.
        vector = ti.types.vector
        self.Grid = ti.types.struct(
            origin=vector(dimension, ti.f64),
            inv_edge=vector(dimension, ti.f64),
            numbers=vector(dimension, ti.i64),  # of cells along each axis
            edges=vector(dimension, ti.f64),  # of the periodic cell, 0 along other axes
            tilt=ti.f64,  # how much further along x the image above it stands
        )

    @ti.func
    def grid(self):
        """The Grid of this search. To be called outside of the loops of a kernel."""
        n = ti.static(self.n)
        return self.Grid(
            origin=self.vector(0),
            inv_edge=self.vector(n),
            numbers=ti.cast(self.vector(2 * n), ti.i64),
            edges=self.vector(3 * n),
            tilt=self.numbers[4 * n],
        )

    @ti.func
    def vector(self, first: ti.template()):
        return ti.Vector([self.numbers[first + a] for a in ti.static(range(self.n))])

    @ti.func
    def total(self):
        """Number of cells."""
        return ti.cast(self.numbers[4 * self.n + 1], ti.i32)

    @ti.func
    def along(self, grid: ti.template()):
        """Numbers of cells along each axis."""
        return ti.cast(grid.numbers, ti.i32)

    @ti.func
    def find_cell(self, position, grid: ti.template()):
        """Cell of a position along each axis; positions outside are in the outermost cells."""
        d = position - grid.origin
        if ti.static(self.tilted):
            d[0] -= grid.tilt * (d[2] / grid.edges[2] - 0.5)
        outer = ti.Vector([self.outer[a] for a in ti.static(range(self.n))])
        cell = ti.floor(d * grid.inv_edge, ti.i32) + outer
        return ti.max(outer, ti.min(cell, self.along(grid) - 1 - outer))

    @ti.func
    def number(self, cell, grid: ti.template()):
        """Number of a cell: those along the last axis are one after another."""
        out, cells = cell[0], self.along(grid)
        for a in ti.static(range(1, self.n)):
            out = out * cells[a] + cell[a]
        return out

    @ti.func
    def runs(self, size):
        """Number of runs in a slice of a box of that many cells along each axis."""
        out = 1
        for a in ti.static(range(1, self.n - self.columns)):
            out *= size[a]
        return out

    @ti.func
    def run(self, begin, size, cut, number, grid: ti.template()):
        """A run of a box of cells: (first cell, the one behind its last, image).

        begin, size: first cell of the box, which is one beyond that of a place at most, and number
        of cells along each axis. cut: number of its slice across the first axis; number: of the run
        in that. Runs are one behind another in the order of the cells; beyond periodic faces they
        are images; `image` is their displacement.
        """
        n = ti.static(self.n)
        cells, cell, number_left = self.along(grid), begin, number
        image = ti.Vector.zero(ti.f64, n)
        for axis in ti.static(range(n - 1, -1, -1)):
            if ti.static(axis == 0):
                cell[axis] += cut
            elif ti.static(axis == 1 and n - self.columns > 1):
                cell[axis] += number_left
            elif ti.static(axis < n - 1 or not self.columns):
                cell[axis] += number_left % size[axis]
                number_left //= size[axis]
            if ti.static(axis in self.periodic):
                turn = ti.cast(cell[axis] >= cells[axis], ti.i32) - ti.cast(cell[axis] < 0, ti.i32)
                cell[axis] -= turn * cells[axis]
                image[axis] += turn * grid.edges[axis]
                if ti.static(self.tilted and axis == 2):
                    image[0] += turn * grid.tilt
        first = self.number(cell, grid)
        return first, first + (size[n - 1] if ti.static(self.columns) else 1), image


@ti.data_oriented
class Sort:
    """A counting sort of particles by number of a cell.

    `fields.in_cell` has those of cell c from `fields.cell_first[c]` on. fields: with those of
    place_cells as attributes. count(), cells(): functions, numbers of particles and of cells.
    cell(k, grid): function, cell of a particle, -1 of one that is left out. ordered: particles of a
    cell are in the order of their numbers, on any number of threads; else their order is any.
    """

    def __init__(self, fields, count, cells, cell, *, ordered):
        self.first, self.member, self.cell_of = fields.cell_first, fields.in_cell, fields.cell_of
        self.placeless, self.scan = fields.placeless, Scan(fields.cell_chunk)
        self.count, self.cells, self.cell = count, cells, cell
        self.room, self.first_capacity = self.member.shape[0], self.first.shape[0]
        self.light = is_short(self.room)
        self.disordered = ordered and not self.light

    @ti.func
    def sort(self, grid: ti.template()):
        """Sort the particles into the cells. To be called outside of the loops of a kernel.

        Places of a cell are given away from the last one on, to the last particle first: without
        threads they are in order.
        """
        ti.loop_config(serialize=self.light)
        for particle in range(loop_length(self.count(), self.room)):
            if is_idle(particle, self.count()):
                continue
            cell = self.cell(particle, grid)
            self.cell_of[particle] = cell
            if cell >= 0:
                ti.atomic_add(self.placeless[cell], 1)
        self.scan.exclusive(
            self.placeless, self.first, loop_length(self.cells() + 1, self.first_capacity)
        )
        ti.loop_config(serialize=self.light)
        for rank in range(loop_length(self.count(), self.room)):
            if is_idle(rank, self.count()):
                continue
            particle = self.count() - 1 - rank
            cell = self.cell_of[particle]
            if cell >= 0:
                self.member[self.first[cell] + ti.atomic_sub(self.placeless[cell], 1) - 1] = (
                    particle
                )
        if ti.static(self.disordered):
            for cell in range(loop_length(self.cells(), self.first_capacity - 1)):
                if is_idle(cell, self.cells()):
                    continue
                self.put_in_order(self.first[cell], self.first[cell + 1])

    @ti.func
    def put_in_order(self, begin, end):
        """Sort a part of `in_cell`: few numbers, by insertion."""
        for k in range(begin + 1, end):
            particle, slot = self.member[k], k
            while slot > begin and self.member[ti.max(slot - 1, begin)] > particle:
                self.member[slot] = self.member[slot - 1]
                slot -= 1
            self.member[slot] = particle
