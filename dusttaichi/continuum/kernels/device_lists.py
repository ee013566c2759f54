"""Lists of a search on a device: the grid, particles by cell, images, the surfaces near them.

motion: motion.Motion; near: lists.Lists; numbers: field of the StepNumbers.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Largest, Scan
from dusttaichi.continuum.kernels.lists import FARTHEST, FURTHER_CELLS, MOST_CELLS, WIDER
from dusttaichi.continuum.kernels.store import declare

REACH, TOUCH = range(2)  # places in `reaches`: of lists, and of surfaces [m]
LOST, IMAGES, SURFACES = range(3)  # in `found`: 1 of lost particles; images of each; surfaces

NOWHERE = 1e300  # m, the place of a plane that nothing reaches


@ti.data_oriented
class Grid:
    """The grid of cells around particles and their ghosts."""

    def __init__(self, motion, numbers):
        self.lists, self.n, self.x = motion.lists, motion.n, motion.f.x
        self.numbers, self.has_ghosts = numbers, bool(motion.layout.ghosts)
        self.chunks = -(-motion.f.mass.shape[0] // CHUNK)
        self.bounds = self.lists.bounds
        self.largest = Largest(self.bounds, self.chunks)

    @ti.func
    def contain(self, chunk):
        """Row of a chunk of particles: the largest places, and with the opposite sign the smallest.

        Note particles whose place is not a number.
        """
        high, low = ti.Vector([-NOWHERE] * self.n, ti.f64), ti.Vector([-NOWHERE] * self.n, ti.f64)
        for i in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, self.numbers[None].count)):
            for a in ti.static(range(self.n)):
                if ti.abs(self.x[i][a]) < FARTHEST:
                    high[a], low[a] = ti.max(high[a], self.x[i][a]), ti.max(low[a], -self.x[i][a])
                else:
                    self.lists.found[LOST] = 1
        for a in ti.static(range(self.n)):
            self.bounds[chunk + 1, a], self.bounds[chunk + 1, self.n + a] = high[a], low[a]

    @ti.func
    def along(self, a, margin, width):
        """Cells along an axis."""
        low, high = -self.bounds[0, self.n + a] - margin, self.bounds[0, a] + margin
        return ti.floor((high - low) / width) + 1.0

    @ti.func
    def in_all(self, margin, width):
        """Cells of the grid."""
        out = ti.cast(1.0, ti.f64)
        for a in ti.static(range(self.n)):
            out *= self.along(a, margin, width)
        return out

    @ti.func
    def divide(self):
        """Cells as wide as the reach of the lists, or wider where they exceed the capacity."""
        margin, width = ti.cast(0.0, ti.f64), self.lists.reaches[REACH]
        if ti.static(self.has_ghosts):
            margin = width
        room = MOST_CELLS * self.numbers[None].count + FURTHER_CELLS
        while self.in_all(margin, width) > room:
            width *= WIDER
        self.lists.inv_width[0] = 1.0 / width
        for a in ti.static(range(self.n)):
            self.lists.grid_origin[a] = -self.bounds[0, self.n + a] - margin
            self.lists.grid_cells[a] = ti.cast(self.along(a, margin, width), ti.i32)


@ti.data_oriented
class Cells:
    """Particles and ghosts by cell of the grid, those of a cell by number. ghosts: Ghosts, or None.

    Threads find places in a cell in any order; then one puts its list in order.
    """

    def __init__(self, motion, near, numbers, ghosts):
        self.f, self.lists, self.n = motion.f, motion.lists, motion.n
        self.near, self.numbers = near, numbers
        self.ghosts, self.has_ghosts = ghosts, bool(ghosts)
        self.seen, self.cells = self.f.x.shape[0], self.lists.cell_first.shape[0]
        self.scan, self.columns = Scan(self.lists.cell_chunk), []
        used = {"f64": 0, "i32": 0}
        for variable in declare(motion.layout):
            kind, length = variable.element
            spare = getattr(self.lists, f"spare_{kind}")
            self.columns.append((getattr(self.f, variable.name), spare, used[kind], length))
            used[kind] += max(1, length)

    @ti.func
    def cell(self, k):
        """Number of the cell of particle or ghost k."""
        along, out = self.near.cell_of(self.f.x[k], self.lists.inv_width[0]), 0
        for a in ti.static(range(self.n)):
            out = out * self.lists.grid_cells[a] + along[a]
        return out

    @ti.func
    def takes_part(self, k, listed: ti.template()):
        """True if k is a particle; where lists are made, one that yields or a ghost."""
        count = self.numbers[None].count
        out = ti.cast(k < count, ti.i32)
        if ti.static(listed):
            if k < count:
                out = self.near.yields(k)
            elif ti.static(self.has_ghosts):
                out = ti.cast(k < count + self.ghosts.total(), ti.i32)
        return out

    @ti.func
    def sort(self, listed: ti.template()):
        """Fill `in_cell` and `cell_first`. To be called outside of the loops of a kernel."""
        first, placeless = ti.static(self.lists.cell_first, self.lists.placeless)
        for k in range(self.seen):
            if self.takes_part(k, listed) == 1:
                ti.atomic_add(placeless[self.cell(k)], 1)
        self.scan.exclusive(placeless, first, self.cells)
        for k in range(self.seen):
            if self.takes_part(k, listed) == 1:
                c = self.cell(k)
                place = first[c] + ti.atomic_sub(placeless[c], 1) - 1
                self.lists.in_cell[place] = k
        for c in range(self.cells - 1):
            self.by_number(first[c], first[c + 1])

    @ti.func
    def by_number(self, begin, end):
        """Sort a part of `in_cell`: few numbers, by insertion."""
        for k in range(begin + 1, end):
            own, place = self.lists.in_cell[k], k
            while place > begin and self.lists.in_cell[ti.max(place - 1, 0)] > own:
                self.lists.in_cell[place] = self.lists.in_cell[place - 1]
                place -= 1
            self.lists.in_cell[place] = own

    @ti.func
    def copy_aside(self, i, source):
        """All variables of particle `source` to where particle i takes them from."""
        for field, spare, column, length in ti.static(self.columns):
            if ti.static(length == 0):
                spare[column, i] = field[source]
            else:
                for k in ti.static(range(length)):
                    spare[column + k, i] = field[source][k]

    @ti.func
    def copy_back(self, i):
        for field, spare, column, length in ti.static(self.columns):
            if ti.static(length == 0):
                field[i] = spare[column, i]
            else:
                for k in ti.static(range(length)):
                    field[i][k] = spare[column + k, i]


@ti.data_oriented
class Ghosts:
    """Images of particles beyond mirrors and periodic faces."""

    def __init__(self, motion, near, numbers):
        self.f, self.lists, self.n, self.layout = motion.f, motion.lists, motion.n, motion.layout
        self.motion, self.near, self.numbers = motion, near, numbers
        self.first, self.room = self.lists.ghost_first, self.lists.ghost_sign.shape[0]

    @ti.func
    def total(self):
        """Number of ghosts; 0 where it exceeds the capacity."""
        n = self.first[self.numbers[None].count]
        return ti.select(n <= self.room, n, 0)

    @ti.func
    def is_near(self, i, m):
        """True if image number m of particle i is within reach of the space of the originals."""
        out = self.near.yields(i)
        for a in ti.static(range(self.n)):
            x = self.f.x[i][a] * self.lists.images[m, a] + self.lists.images[m, self.n + a]
            for side in ti.static(range(2)):
                beyond = (x - self.lists.planes[a, side]) * ti.static(1.0 if side else -1.0)
                out *= ti.cast(beyond < self.lists.reaches[REACH], ti.i32)
        return out

    @ti.func
    def count(self, i):
        out = 0
        for m in range(self.lists.found[IMAGES]):
            out += self.is_near(i, m)
        return out

    @ti.func
    def write(self, i):
        """Signs and shifts of the images of particle i."""
        g = self.first[i]
        for m in range(self.lists.found[IMAGES]):
            if self.is_near(i, m) == 1:
                for a in ti.static(range(self.n)):
                    self.lists.ghost_sign[g, a] = self.lists.images[m, a]
                    self.lists.ghost_shift[g, a] = self.lists.images[m, self.n + a]
                g += 1

    @ti.func
    def place(self, i):
        """All that neighbours read of the images of particle i."""
        self.motion.move_ghosts(i, self.numbers[None])
        self.motion.answer_ghosts(i, self.numbers[None])
        if ti.static(self.layout.sides):
            for g in range(self.first[i], self.first[i + 1]):
                self.f.side[self.numbers[None].count + g] = self.f.side[i]


@ti.data_oriented
class Touches:
    """Pairs of particle and rigid surface that may touch before the next search."""

    def __init__(self, motion, near, numbers):
        self.f, self.lists, self.rigid = motion.f, motion.lists, motion.rigid
        self.near, self.numbers = near, numbers
        self.first, self.room = self.lists.touch_first, self.lists.touch_row.shape[0]

    @ti.func
    def total(self):
        """Number of the listed touches, 0 where they exceed the capacity."""
        n = self.first[self.numbers[None].count]
        return ti.select(n <= self.room, n, 0)

    @ti.func
    def is_near(self, i, row):
        arm = self.rigid.arm(row, self.f.x[i], self.numbers[None])
        distance = self.rigid.surface(row, arm, self.numbers[None].h)[0]
        return ti.cast(distance < self.lists.reaches[TOUCH], ti.i32)

    @ti.func
    def count(self, i):
        out = 0
        if self.near.yields(i) == 1:
            for q in range(self.lists.found[SURFACES]):
                out += self.is_near(i, self.lists.surfaces[q])
        return out

    @ti.func
    def write(self, i):
        """The surfaces near particle i."""
        e = self.first[i]
        if self.near.yields(i) == 1:
            for q in range(self.lists.found[SURFACES]):
                row = self.lists.surfaces[q]
                if self.is_near(i, row) == 1:
                    self.lists.touch_row[e] = row
                    e += 1
