"""Neighbour lists: every pair within reach, from particles and ghosts sorted into cells."""

import taichi as ti

from dusttaichi.compute.scan import Scan


def grid_type(dimension):
    """The struct of a grid of cells: origin and one over the width [SI], numbers of cells."""
    return ti.types.struct(
        origin=ti.types.vector(dimension, ti.f64),
        inv_width=ti.types.vector(dimension, ti.f64),
        cells=ti.types.vector(dimension, ti.i32),
    )


@ti.data_oriented
class Lists:
    """fields, lists: see store.place; dimension: 2 or 3."""

    def __init__(self, fields, lists, dimension):
        self.f, self.lists, self.n = fields, lists, dimension
        self.scan = Scan(lists.chunk_sum)
        self.counts = lists.counts

    @ti.func
    def own_cell(self, i, grid: ti.template()):
        """The cell of particle i along each axis; what is outside is in the outermost."""
        place = (self.f.x[i] - grid.origin) * grid.inv_width
        return ti.max(0, ti.min(ti.floor(place, ti.i32), grid.cells - 1))

    @ti.func
    def neighbours(self, i, reach2, grid: ti.template(), write: ti.template()):
        """Count the neighbours of i, and write them down if asked."""
        centre, x, found = self.own_cell(i, grid), self.f.x[i], 0
        start = self.lists.first[i]
        for offset in ti.static(ti.grouped(ti.ndrange(*((-1, 2),) * self.n))):
            cell = centre + offset
            inside, number = 1, 0
            for a in ti.static(range(self.n)):
                inside *= ti.cast(0 <= cell[a] < grid.cells[a], ti.i32)
                number = number * grid.cells[a] + cell[a]
            if inside == 1:
                for k in range(self.lists.cell_first[number], self.lists.cell_first[number + 1]):
                    j = self.lists.in_cell[k]
                    if j != i and (x - self.f.x[j]).norm_sqr() < reach2:
                        if ti.static(write):
                            self.lists.entry[start + found] = j
                        found += 1
        return found


def make_list(lists, Grid):
    """Two kernels: `count(n, reach2, grid)` neighbours and where each list begins; `write` them."""

    @ti.kernel
    def count(n: ti.i32, reach2: ti.f64, grid: Grid):
        for i in range(n):
            lists.counts[i] = lists.neighbours(i, reach2, grid, False)
        lists.scan.exclusive(lists.counts, lists.lists.first, n)
        for _ in range(1):
            lists.lists.first[n] = lists.lists.first[n - 1] + lists.counts[n - 1]

    @ti.kernel
    def write(n: ti.i32, reach2: ti.f64, grid: Grid):
        for i in range(n):
            lists.neighbours(i, reach2, grid, True)

    return count, write
