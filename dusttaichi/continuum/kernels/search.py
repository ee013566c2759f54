"""The search on a device: kernels that write the lists of continuum.search without the host.

All counts are integers, and entries found by threads in any order are sorted, so that the lists are
reproducible. Loops have the lengths of fields, known when they are compiled: else a launch
of their own would find them first.
"""

from types import SimpleNamespace

from dusttaichi.compute.engine import ti
from dusttaichi.compute.launching import Launch
from dusttaichi.compute.scan import Scan, scan_capacity
from dusttaichi.continuum.kernels.device_lists import (
    LOST,
    REACH,
    Cells,
    Ghosts,
    Grid,
    Touches,
)
from dusttaichi.continuum.kernels.lists import Lists
from dusttaichi.continuum.kernels.store import BODIES, COLUMN, FACES, declare

MOST_IMAGES = 26  # of a particle: along each axis there are the particle and two others
ROWS = FACES + BODIES


def place_search(fields, lists, layout):
    """Further lists of a search on a device, by name: scratch, and what it knows of the scene."""
    n, room, cells = layout.dimension, fields["mass"].shape[0], lists["cell_first"].shape[0]
    columns = {"f64": 0, "i32": 0}
    for variable in declare(layout):
        kind, length = variable.element
        columns[kind] += max(1, length)
    shapes = {
        # what each particle has of something before it is summed, and 0 behind the last one
        "number": (ti.i32, (room + 1,)),
        # what a cell has that has no place in its list yet; 0 between two sorts
        "placeless": (ti.i32, (cells,)),
        "cell_chunk": (ti.i32, (scan_capacity(cells),)),
        # largest places, and smallest ones with the opposite sign: of all, of chunks of particles,
        # of groups of chunks
        "bounds": (ti.f64, (scan_capacity(room) + 1, 2 * n)),
        "inv_width": (ti.f64, (1,)),
        "spare_f64": (ti.f64, (columns["f64"], room)),
        "spare_i32": (ti.i32, (columns["i32"], room)),
        "found": (ti.i32, (3,)),
        "reaches": (ti.f64, (2,)),
        # low and high end of axes that repeat, 0 of others; planes that images are beyond
        "edges": (ti.f64, (n, 2)),
        "planes": (ti.f64, (n, 2)),
        "images": (ti.f64, (MOST_IMAGES, 2 * n)),  # signs, shifts
        "surfaces": (ti.i32, (ROWS,)),
    }
    return {name: ti.field(kind, shape=shape) for name, (kind, shape) in shapes.items()}


def make_search(motion, numbers):
    """Launches of a search, in order.

    `wrap()` particles into the periodic cell; `lay_grid()` of cells around them; `reorder()` them
    by cell; `write_lists()`; `place_ghosts()`; `outcome()`: 0, or not where particles are lost or
    lists too long. numbers: field of the StepNumbers.
    """
    layout, near = motion.layout, Lists(motion.f, motion.lists, motion.layout)
    known = motion, near, numbers
    ghosts = Ghosts(*known) if layout.ghosts else None
    touches = Touches(*known) if layout.rigid else None
    cells = Cells(*known, ghosts)
    wrap, lay_grid = make_grid(motion, numbers)
    kernels = {"wrap": wrap, "lay_grid": lay_grid, "reorder": make_reorder(motion, numbers, cells)}
    kernels["write_lists"] = make_write(cells, ghosts, touches)
    kernels["outcome"] = make_outcome(motion.lists, numbers, ghosts, touches)
    if layout.ghosts:
        kernels["place_ghosts"] = make_place_ghosts(numbers, ghosts)
    return SimpleNamespace(**{name: Launch(kernel) for name, kernel in kernels.items()})


def make_grid(motion, numbers):
    """Kernels `wrap()` and `lay_grid()` of make_search."""
    lists, x, grid = motion.lists, motion.f.x, Grid(motion, numbers)
    n, room, edges = motion.n, motion.f.mass.shape[0], lists.edges

    @ti.kernel
    def wrap():
        for i in range(room):
            if i < numbers[None].count:
                for a in ti.static(range(n)):
                    length = edges[a, 1] - edges[a, 0]
                    if length > 0.0:
                        x[i][a] -= ti.floor((x[i][a] - edges[a, 0]) / length) * length

    @ti.kernel
    def lay_grid():
        for _ in range(1):
            lists.found[LOST] = 0
        for chunk in range(grid.chunks):
            grid.contain(chunk)
        grid.largest.find(grid.chunks)
        for _ in range(1):
            grid.divide()

    return wrap, lay_grid


def make_reorder(motion, numbers, cells):
    """Kernel `reorder()` of make_search; the places of this search are written down."""
    f, in_cell, room = motion.f, motion.lists.in_cell, motion.f.mass.shape[0]

    @ti.kernel
    def reorder():
        cells.sort(False)
        for i in range(room):
            if i < numbers[None].count:
                cells.copy_aside(i, in_cell[i])
        for i in range(room):
            if i < numbers[None].count:
                cells.copy_back(i)
                f.x_search[i] = f.x[i]
        for b in range(ROWS):
            for a in ti.static(range(3)):
                f.rigid[b, COLUMN.searched + a] = f.rigid[b, COLUMN.centre + a]

    return reorder


def make_write(cells, ghosts, touches):
    """Kernel `write_lists()` of make_search."""
    lists, near, numbers = cells.lists, cells.near, cells.numbers
    number, room = lists.number, lists.counts.shape[0]
    scan, entries = Scan(lists.chunk_sum), lists.entry.shape[0]
    has_ghosts, has_touches = bool(ghosts), bool(touches)

    @ti.func
    def sum_up(things: ti.template()):
        """Sum up the counts: first entry of each particle."""
        for i in range(room + 1):
            number[i] = 0
            if i < numbers[None].count:
                number[i] = things.count(i)
        scan.exclusive(number, things.first, room + 1)

    @ti.func
    def visit(i, write: ti.template()):
        reach = lists.reaches[REACH]
        count = numbers[None].count
        return near.neighbours(i, count, reach * reach, lists.inv_width[0], write)

    @ti.kernel
    def write_lists():
        if ti.static(has_ghosts):
            sum_up(ghosts)
            for i in range(room):
                if i < numbers[None].count and ghosts.total() > 0:
                    ghosts.write(i)
                    ghosts.place(i)
        cells.sort(True)
        for i in range(room + 1):
            number[i] = 0
            if i < numbers[None].count:
                number[i] = visit(i, False)
        scan.exclusive(number, lists.first, room + 1)
        for i in range(room):
            if i < numbers[None].count and lists.first[numbers[None].count] <= entries:
                visit(i, True)
        if ti.static(has_touches):
            sum_up(touches)
            for i in range(room):
                if i < numbers[None].count and touches.total() > 0:
                    touches.write(i)

    return write_lists


def make_outcome(lists, numbers, ghosts, touches):
    """Kernel `outcome()` of make_search."""
    entries, has_ghosts, has_touches = lists.entry.shape[0], bool(ghosts), bool(touches)

    @ti.kernel
    def outcome() -> ti.i32:
        n = numbers[None].count
        wrong = lists.found[LOST] + ti.cast(lists.first[n] > entries, ti.i32)
        if ti.static(has_ghosts):
            wrong += ti.cast(ghosts.first[n] > ghosts.room, ti.i32)
        if ti.static(has_touches):
            wrong += ti.cast(touches.first[n] > touches.room, ti.i32)
        return wrong

    return outcome


def make_place_ghosts(numbers, ghosts):
    """Kernel `place_ghosts()` of make_search."""
    room = ghosts.f.mass.shape[0]

    @ti.kernel
    def place_ghosts():
        for i in range(room):
            if i < numbers[None].count:
                ghosts.place(i)

    return place_ghosts
