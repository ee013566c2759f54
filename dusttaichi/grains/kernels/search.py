"""The search for neighbours: grid of cells, and the neighbours of every grain in a fixed order.

Called only when a grain or a wall has moved half the skin since the last time, with the positions
of that moment: every pair closer than touch + skin is in the list, so that no contact can form
outside it. Lists are sorted by grain number, whatever order the threads worked in.
"""

from dusttaichi.compute.blocks import is_idle, loop_length
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Largest, Scan, is_short, scan_capacity, whole
from dusttaichi.grains.kernels.store import (
    GRAINS,
    NEIGHBOURS,
    OVERFLOW,
    PAIR_ROOM,
    capacity,
)

# Only numbers of eight bytes: on a GPU the loops of a kernel pass it on in memory, where Taichi
# puts vectors behind each other, and a device reads eight bytes only at multiples of eight.
Grid = ti.types.struct(
    origin=ti.types.vector(3, ti.f64),
    inv_edge=ti.types.vector(3, ti.f64),
    numbers=ti.types.vector(3, ti.i64),  # of cells along each axis
    edges=ti.types.vector(3, ti.f64),  # of the periodic cell, 0 along other axes
    tilt=ti.f64,  # how much further along x the image above it stands
)

CELLS_PER_GRAIN = 4
# numbers of a search, in the order of the `search` field: a kernel reads them from there, for
# Python passes them more slowly than it searches. reach: of two centres, squared, where grains have
# radii of their own the margin between their surfaces; wall_reach, time: see `make_wall_relist`
SEARCH = (
    *(f"{name}_{axis}" for name in ("origin", "inv_edge", "cells", "edges") for axis in "xyz"),
    *("tilt", "all_cells", "reach", "time"),
    *(f"wall_reach_{n}" for n in range(6)),
)


def place_search(grains, layout, walls):
    """Scratch fields of the search (nothing in them outlives it)."""
    cells = CELLS_PER_GRAIN * grains + 64
    pair_blocks = capacity(grains, layout, walls)[0]
    # a large grain may have as many small neighbours as fit in all: one list after another
    near = 2 * pair_blocks * layout.width if layout.polydisperse else grains * NEIGHBOURS
    own = {"near_start": ti.field(ti.i32, shape=grains + 1)} if layout.polydisperse else {}
    if walls:
        own |= {
            "wall_chunk": ti.field(ti.i32, shape=6 * -(-grains // CHUNK) + 1),
        }
    if layout.sphere:
        own["sphere_chunk"] = ti.field(ti.i32, shape=-(-grains // CHUNK) + 1)
    return own | {
        "cell_start": ti.field(ti.i32, shape=cells + 1),
        "cell_grain": ti.field(ti.i32, shape=grains),
        # more than the cells: until it is filled, it counts what is in them
        "near": ti.field(ti.i32, shape=max(near, cells + 1)),
        "near_count": ti.field(ti.i32, shape=grains + layout.polydisperse),
        "own_count": ti.field(ti.i32, shape=grains + 1),
        "old_start": ti.field(ti.i32, shape=grains + 1),
        "chunk_sum": ti.field(ti.i32, shape=scan_capacity(max(cells, grains) + 1)),
        "bounds": ti.field(ti.f64, shape=(1 + scan_capacity(grains), BOUNDS)),
        "search": ti.field(ti.f64, shape=len(SEARCH)),
    }


# columns of `bounds`: the largest coordinates, and with the opposite sign the smallest; 1 if a
# position is not a number; the largest speed
HIGHEST, LOWEST, LOST, FASTEST = 0, 3, 6, 7
BOUNDS = 8


def make_bounds(fields, scratch):
    """Kernel `find_bounds()`: row 0 of `bounds`, of all grains."""
    x, v, bounds, counts = fields["x"], fields["v"], scratch["bounds"], fields["counts"]
    chunks = -(-scratch["cell_grain"].shape[0] // CHUNK)
    light, largest = is_short(x.shape[0]), Largest(bounds, chunks)

    @ti.func
    def bound(chunk):
        """Row of a chunk of grains."""
        high, low = ti.Vector([-1e30] * 3, ti.f64), ti.Vector([-1e30] * 3, ti.f64)
        fastest, lost = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, counts[GRAINS])):
            fastest = ti.max(fastest, v[g].norm())
            for k in ti.static(range(3)):
                if ti.abs(x[g][k]) < 1e12:
                    high[k], low[k] = ti.max(high[k], x[g][k]), ti.max(low[k], -x[g][k])
                else:
                    lost = 1.0
        for k in ti.static(range(3)):
            bounds[chunk + 1, HIGHEST + k], bounds[chunk + 1, LOWEST + k] = high[k], low[k]
        bounds[chunk + 1, LOST], bounds[chunk + 1, FASTEST] = lost, fastest

    @ti.kernel
    def find_bounds():
        ti.loop_config(serialize=light)
        for chunk in range(loop_length(whole(counts[GRAINS], CHUNK), chunks)):
            bound(chunk)
        largest.find(whole(counts[GRAINS], CHUNK))

    return find_bounds


@ti.data_oriented
class Cells:
    """The grid of cells: where a grain is in it, and which cells are around it."""

    def __init__(self, fields, scratch, layout):
        self.x, self.tilted = fields["x"], layout.tilted
        self.start, self.grain = scratch["cell_start"], scratch["cell_grain"]

    @ti.func
    def along(self, grid):
        """Numbers of cells along each axis."""
        return ti.cast(grid.numbers, ti.i32)

    @ti.func
    def cell_of(self, p, grid):
        d = p - grid.origin
        if ti.static(self.tilted):  # the cells are tilted as the periodic cell is
            d[0] -= grid.tilt * (d[2] / grid.edges[2] - 0.5)
        c = ti.cast(d * grid.inv_edge, ti.i32)
        return ti.max(0, ti.min(c, self.along(grid) - 1))

    @ti.func
    def number(self, c, grid):
        cells = self.along(grid)
        return (c[0] * cells[1] + c[1]) * cells[2] + c[2]

    @ti.func
    def home(self, g, grid):
        return self.number(self.cell_of(self.x[g], grid), grid)


@ti.data_oriented
class Neighbours:
    """The lists of neighbours.

    Equal grains: NEIGHBOURS places of `near` each. Polydisperse ones: one list after another, which
    are counted first.
    """

    def __init__(self, fields, scratch, layout, cells):
        self.cells, self.periodic = cells, layout.periodic
        self.polydisperse = layout.polydisperse
        self.x, self.counts = fields["x"], fields["counts"]
        self.near, self.near_count = scratch["near"], scratch["near_count"]
        self.own_count, self.capacity = scratch["own_count"], scratch["cell_grain"].shape[0]
        self.near_start, self.radius = scratch.get("near_start"), fields.get("radius")

    @ti.func
    def insert(self, g, other, first, found: ti.template()):
        """Insert a neighbour of g into its sorted list, which begins at `first`.

        found: number of its neighbours, and of those with higher numbers.
        """
        place = first + found[0]
        while place > first and self.near[ti.max(place - 1, 0)] > other:
            self.near[place] = self.near[place - 1]
            place -= 1
        self.near[place] = other
        found[0] += 1
        found[1] += ti.cast(other > g, ti.i32)

    @ti.func
    def list_equal(self, g, found: ti.template(), low, high, image, reach2):
        """Add the grains of the cells low ... high, moved by `image`, to the neighbours of g."""
        here = self.x[g]
        for k in range(self.cells.start[low], self.cells.start[high + 1]):
            other = self.cells.grain[k]
            d = self.x[other] + image - here
            if d.dot(d) < reach2 and other != g:
                if found[0] < NEIGHBOURS:
                    self.insert(g, other, g * NEIGHBOURS, found)
                else:
                    self.counts[OVERFLOW] = 1

    @ti.func
    def list_polydisperse(
        self, g, found: ti.template(), low, high, image, margin, counting: ti.template()
    ):
        """Add grains with their own radii to the neighbours of g, or only count them.

        low, high, image: as of equal grains. margin: largest distance of their surfaces.
        """
        for k in range(self.cells.start[low], self.cells.start[high + 1]):
            other = self.cells.grain[k]
            d = self.x[other] + image - self.x[g]
            reach = self.radius[g] + self.radius[other] + margin
            if d.dot(d) < reach * reach and other != g:
                if ti.static(counting):
                    found[0] += 1
                else:
                    self.insert(g, other, self.near_start[g], found)

    @ti.func
    def take(self, g, found: ti.template(), low, high, image, reach, counting: ti.template()):
        if ti.static(self.polydisperse):
            self.list_polydisperse(g, found, low, high, image, reach, counting)
        else:
            self.list_equal(g, found, low, high, image, reach)

    @ti.func
    def visit(self, g, grid, reach2, counting: ti.template()):
        """Counts or lists the neighbours of g: what is near in the cells around its own."""
        c, cells = self.cells.cell_of(self.x[g], grid), self.cells.along(grid)
        found = ti.Vector([0, 0])
        if ti.static(self.periodic):
            for a, b, e in ti.ndrange((-1, 2), (-1, 2), (-1, 2)):
                there = c + ti.Vector([a, b, e])
                image = ti.Vector.zero(ti.f64, 3)
                for n in ti.static(self.periodic):
                    turn = ti.cast(there[n] >= cells[n], ti.i32) - ti.cast(there[n] < 0, ti.i32)
                    there[n] -= turn * cells[n]
                    image[n] += turn * grid.edges[n]
                    if ti.static(self.cells.tilted and n == 2):
                        image[0] += turn * grid.tilt
                if there.min() >= 0 and (cells - 1 - there).min() >= 0:
                    here = self.cells.number(there, grid)
                    self.take(g, found, here, here, image, reach2, counting)
        else:
            none = ti.Vector.zero(ti.f64, 3)
            for a in range(ti.max(c[0] - 1, 0), ti.min(c[0] + 2, cells[0])):
                for b in range(ti.max(c[1] - 1, 0), ti.min(c[1] + 2, cells[1])):
                    # cells of a column stand one after another
                    top = ti.min(c[2] + 1, cells[2] - 1)
                    low = self.cells.number(ti.Vector([a, b, ti.max(c[2] - 1, 0)]), grid)
                    high = self.cells.number(ti.Vector([a, b, top]), grid)
                    self.take(g, found, low, high, none, reach2, counting)
        self.near_count[g], self.own_count[g] = found[0], found[1]

    @ti.func
    def visit_all(self, grid: ti.template(), reach: ti.template(), counting: ti.template()):
        """Visit all grains. To be called outside of the loops of a kernel."""
        for g in range(loop_length(self.counts[GRAINS], self.capacity)):
            if is_idle(g, self.counts[GRAINS]) or self.is_full(counting):
                continue
            self.visit(g, grid, reach, counting)

    @ti.func
    def is_full(self, counting: ti.template()):
        """True if the lists have grown too long; those of equal grains have places of their own."""
        checked = ti.static(self.polydisperse and not counting)
        return self.counts[OVERFLOW] > 0 if ti.static(checked) else 0


def make_grid(scratch):
    """Function `grid()`: the Grid of a search, from its numbers."""
    numbers = scratch["search"]
    place = {name: n for n, name in enumerate(SEARCH)}

    @ti.func
    def vector(first):
        return ti.Vector([numbers[first], numbers[first + 1], numbers[first + 2]])

    @ti.func
    def grid():
        return Grid(
            origin=vector(ti.static(place["origin_x"])),
            inv_edge=vector(ti.static(place["inv_edge_x"])),
            numbers=ti.cast(vector(ti.static(place["cells_x"])), ti.i64),
            edges=vector(ti.static(place["edges_x"])),
            tilt=numbers[ti.static(place["tilt"])],
        )

    return grid


def make_find(fields, scratch, layout):
    """Function `find(grid)`: the neighbours of every grain, sorted; starts of the pair list.

    And the number of those that are its own (of higher number). To be called outside of the loops
    of a kernel.
    """
    x, x_search, counts = fields["x"], fields["x_search"], fields["counts"]
    cell_start, cell_fill = scratch["cell_start"], scratch["near"]
    cell_grain, near_count = scratch["cell_grain"], scratch["near_count"]
    own_count, old_start = scratch["own_count"], scratch["old_start"]
    pair_start, near_start = fields["pair_start"], scratch.get("near_start")
    scan, grid_cells = Scan(scratch["chunk_sum"]), Cells(fields, scratch, layout)
    neighbours, numbers = Neighbours(fields, scratch, layout, grid_cells), scratch["search"]
    room, cell_room = cell_grain.shape[0], cell_start.shape[0]
    light = is_short(x.shape[0])

    @ti.func
    def find(grid: ti.template()):
        cells = ti.cast(numbers[ti.static(SEARCH.index("all_cells"))], ti.i32)
        reach = numbers[ti.static(SEARCH.index("reach"))]
        ti.loop_config(serialize=light)
        for c in range(loop_length(cells + 1, cell_room)):
            cell_fill[c] = 0
        ti.loop_config(serialize=light)
        for g in range(loop_length(counts[GRAINS], room)):
            if is_idle(g, counts[GRAINS]):
                continue
            x_search[g] = x[g]
            ti.atomic_add(cell_fill[grid_cells.home(g, grid)], 1)
        scan.exclusive(cell_fill, cell_start, loop_length(cells + 1, cell_room))
        ti.loop_config(serialize=light)
        for c in range(loop_length(cells + 1, cell_room)):
            cell_fill[c] = cell_start[c]
        ti.loop_config(serialize=light)
        for g in range(loop_length(counts[GRAINS], room)):
            if is_idle(g, counts[GRAINS]):
                continue
            cell_grain[ti.atomic_add(cell_fill[grid_cells.home(g, grid)], 1)] = g
        ti.loop_config(serialize=light)
        for g in range(loop_length(counts[GRAINS] + 1, room + 1)):
            old_start[g] = pair_start[g]
        if ti.static(layout.polydisperse):
            neighbours.visit_all(grid, reach, True)
            scan.exclusive(near_count, near_start, loop_length(counts[GRAINS] + 1, room + 1))
            limit(near_start, 2)
        neighbours.visit_all(grid, reach, False)
        scan.exclusive(own_count, pair_start, loop_length(counts[GRAINS] + 1, room + 1))
        limit(pair_start, 1)

    @ti.func
    def limit(starts: ti.template(), times: ti.template()):
        """Lists for which there is no room, with one number behind them, are an overflow."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            if starts[counts[GRAINS]] >= times * counts[PAIR_ROOM]:
                counts[OVERFLOW] = 1

    return find
