"""The kernels of a search: particles in the order of blocks, images, lists.

On a CPU and on a device the same: all counts are integers, and particles of a cell are in order, so
that the lists are reproducible.
"""

from types import SimpleNamespace

from dusttaichi.compute.device_blocks import is_idle, loop_length
from dusttaichi.compute.engine import ti
from dusttaichi.compute.taichi_internals.launching import Launch
from dusttaichi.continuum.kernels.block_lists import (
    COUNT,
    LIST,
    LOW,
    ORDER,
    PARTICLES,
    PERIOD,
    PLANES,
    SEEN,
    Ghosts,
    Touches,
)
from dusttaichi.continuum.kernels.store import BODIES, COLUMN, FACES, declare
from dusttaichi.particles.cells import Bounds, Cells, Sort, place_cells
from dusttaichi.particles.lists import Lists

FARTHEST = 1e10  # m; beyond, the place of a particle does not count as a number
MOST_CELLS, FURTHER_CELLS = 4, 252  # capacity in cells: for each particle, and in addition
MOST_IMAGES = 26  # of a particle: along each axis there are the particle and two others
ROWS = FACES + BODIES


def place_search(fields, layout, room):
    """Lists of a search beside those of store.place: scratch, and what it knows of the scene."""
    n, seen = layout.dimension, fields["x"].shape[0]
    shapes = {
        "tally": (ti.i32, (room + 1,)),
        "known": (ti.i32, (2,)),
        "reaches": (ti.f64, (3,)),
        "axes": (ti.f64, (n, PLANES + 2)),
        "images": (ti.f64, (MOST_IMAGES + 1, 2 * n)),  # signs, shifts
        "surfaces": (ti.i32, (ROWS + 1, 2)),  # 1, row
    }
    if layout.lanes == 1:  # all variables in the new order
        for dtype in ("f64", "i32"):
            columns = sum(max(1, v.element[1]) for v in declare(layout) if v.element[0] == dtype)
            shapes[f"spare_{dtype}"] = getattr(ti, dtype), (columns, room)
    search_fields = {name: ti.field(dtype, shape=shape) for name, (dtype, shape) in shapes.items()}
    return search_fields | place_cells(n, seen, MOST_CELLS * seen + FURTHER_CELLS, method_numbers=1)


@ti.data_oriented
class SeenParticles:
    """Particles and images of a Motion in the cells of a search.

    count: of particles; seen: of these and of images. near: lists.Neighbours.
    """

    def __init__(self, motion, near):
        self.x, self.lists, self.n, self.near = motion.f.x, motion.lists, motion.n, near
        self.cells, self.last = Cells(motion.lists.grid, motion.n), motion.lists.grid.shape[0] - 1

    @ti.func
    def count(self):
        return self.lists.known[PARTICLES]

    @ti.func
    def seen(self):
        return self.lists.known[SEEN]

    @ti.func
    def put_back(self, i):
        """Particle i back into the periodic cell."""
        for a in ti.static(range(self.n)):
            low, length = self.lists.axes[a, LOW], self.lists.axes[a, PERIOD]
            if length > 0.0:
                self.x[i][a] -= ti.floor((self.x[i][a] - low) / length) * length

    @ti.func
    def cell(self, k, grid: ti.template()):
        """The cell of a particle or image.

        Rigid and fixed particles are no neighbours: their body or face acts by its surface.
        """
        is_occupied = 1
        if k < self.count() and self.lists.grid[self.last] != ORDER:
            is_occupied = self.near.yields(k)
        cell = self.cells.number(self.cells.find_cell(self.x[k], grid), grid)
        return ti.select(is_occupied == 1, cell, -1)


def make_search(motion, near):
    """Launches of a search, in order.

    `find_bounds()` of the particles, which it puts back into the periodic cell; where a block is
    one particle, `sort()` all into the grid, and `reorder()` them by cell, else the host has done
    so; `look_around()`: images and surfaces near particles; `sort()` those that have neighbours and
    the images; `visit()` blocks, which counts neighbours and returns 0, or not where lists are too
    long, and `visit()` again, which lists them. What takes long to compile is one kernel for two
    uses: the phase, the last number of `grid`, says which. near: lists.Neighbours.
    """
    layout, f, lists = motion.layout, motion.f, motion.lists
    particles, last = SeenParticles(motion, near), lists.grid.shape[0] - 1
    cells, count = particles.cells, particles.count
    ghosts = Ghosts(motion, near) if layout.ghosts else None
    touches = Touches(motion.rigid, near) if layout.rigid else None
    marked = [marked_lists for marked_lists in (ghosts, touches) if marked_lists is not None]
    listings = [Lists(marked_lists, lists.tally, lists.chunk_sum) for marked_lists in marked]
    blocks = Lists(near, lists.tally, lists.chunk_sum)

    sort_seen = Sort(lists, particles.seen, cells.total, particles.cell, ordered=True)
    preparations = (particles.put_back,) if layout.ghosts else ()
    room = lists.in_cell.shape[0]
    bounds = Bounds(f.x, lists.bounds, count, FARTHEST, capacity=room, preparations=preparations)

    @ti.kernel
    def find_bounds():
        bounds.find()
        lists.known[SEEN] = count()

    @ti.kernel
    def look_around():
        for listing in ti.static(listings):
            listing.fill()
        if ti.static(layout.ghosts):
            if not ghosts.is_full():
                lists.known[SEEN] = count() + ghosts.first[count()]

    @ti.kernel
    def sort():
        grid = cells.grid()
        sort_seen.sort(grid)

    @ti.kernel
    def visit() -> ti.i32:
        grid = cells.grid()
        for block in range(loop_length(near.count(), f.mass.shape[0])):
            if is_idle(block, near.count()):
                continue
            lists.tally[block] = near.entries(block, cells, grid, lists.grid[last] == LIST)
        blocks.sum_up()
        wrong = ti.cast(near.first[near.count()] > near.room, ti.i32)
        for entries in ti.static(marked):
            wrong += ti.cast(entries.is_full(), ti.i32)
        lists.grid[last] = LIST
        return wrong

    kernels = [find_bounds, sort, visit, *([look_around] if marked else [])]
    if layout.lanes == 1:
        kernels.append(make_reorder(motion, count))
    return SimpleNamespace(**{kernel.__name__: Launch(kernel) for kernel in kernels})


def make_reorder(motion, count):
    """Kernel `reorder()` of make_search."""
    f, lists, columns, used = motion.f, motion.lists, [], {"f64": 0, "i32": 0}
    for variable in declare(motion.layout):
        dtype, length = variable.element
        spare = getattr(lists, f"spare_{dtype}")
        columns.append((getattr(f, variable.name), spare, used[dtype], length))
        used[dtype] += max(1, length)
    room, last = f.mass.shape[0], lists.grid.shape[0] - 1

    @ti.kernel
    def reorder():
        for i in range(room):
            if i < count():
                source = lists.in_cell[i]
                for field, spare, column, length in ti.static(columns):
                    if ti.static(length == 0):
                        spare[column, i] = field[source]
                    else:
                        for k in ti.static(range(length)):
                            spare[column + k, i] = field[source][k]
        for i in range(room):
            if i < count():
                for field, spare, column, length in ti.static(columns):
                    if ti.static(length == 0):
                        field[i] = spare[column, i]
                    else:
                        for k in ti.static(range(length)):
                            field[i][k] = spare[column + k, i]
                f.x_search[i] = f.x[i]
        for row in range(ROWS):
            for a in ti.static(range(3)):
                f.rigid[row, COLUMN.searched + a] = f.rigid[row, COLUMN.centre + a]
        lists.grid[last] = COUNT

    return reorder
