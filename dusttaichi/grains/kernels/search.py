"""The search for neighbours: grid of cells, lists in a fixed order, history carried over exactly.

Called only when a grain or a wall has moved half the skin since the last time, with the positions
of that moment: every pair closer than touch + skin is in the list, so that no contact can form
outside it. Lists are sorted by grain number, whatever order the threads worked in.
"""

import taichi as ti

from dusttaichi.grains.kernels.store import (
    CHUNK,
    FIRST_WALL,
    GRAINS,
    NEIGHBOURS,
    OVERFLOW,
    PAIR_ROOM,
    PAIRS,
    capacity,
)

Grid = ti.types.struct(
    origin=ti.types.vector(3, ti.f64),
    inv_edge=ti.types.vector(3, ti.f64),
    cells=ti.types.vector(3, ti.i32),
    edges=ti.types.vector(3, ti.f64),  # of the periodic cell, 0 along other axes
)

CELLS_PER_GRAIN = 4


def place_search(grains, layout, walls):
    """Scratch fields of the search (nothing in them outlives it)."""
    cells = CELLS_PER_GRAIN * grains + 64
    chunks = -(-max(cells + 1, grains + 1) // CHUNK)
    pair_blocks = capacity(grains, layout, walls)[0]
    # a large grain has as many small neighbours as there is room for in all: one list after another
    near = 2 * pair_blocks * layout.width if layout.polydisperse else (grains, NEIGHBOURS)
    own = {"near_start": ti.field(ti.i32, shape=grains + 1)} if layout.polydisperse else {}
    if walls:
        own |= {
            "wall_chunk": ti.field(ti.i32, shape=(6, -(-grains // CHUNK) + 1)),
            "wall_first": ti.field(ti.i32, shape=8),
        }
    return own | {
        "old_j": ti.Vector.field(layout.width, ti.i32, shape=pair_blocks),
        "cell_start": ti.field(ti.i32, shape=cells + 1),
        "cell_fill": ti.field(ti.i32, shape=cells + 1),
        "cell_grain": ti.field(ti.i32, shape=grains),
        "near": ti.field(ti.i32, shape=near),
        "near_count": ti.field(ti.i32, shape=grains + layout.polydisperse),
        "own_count": ti.field(ti.i32, shape=grains + 1),
        "old_start": ti.field(ti.i32, shape=grains + 1),
        "chunk_sum": ti.field(ti.i32, shape=chunks),
        "bounds": ti.field(ti.f64, shape=8),
    }


def make_bounds(fields, scratch):
    """Kernel: bounds[0:3], [3:6] smallest and largest coordinates, [6] 1 if some are not numbers,
    [7] the largest speed."""
    x, v, bounds, counts = fields["x"], fields["v"], scratch["bounds"], fields["counts"]

    @ti.kernel
    def find_bounds():
        for k in range(8):
            bounds[k] = ti.select(k < 3, 1e30, ti.select(k < 6, -1e30, 0.0))
        for g in range(counts[GRAINS]):
            ti.atomic_max(bounds[7], v[g].norm())
            for k in ti.static(range(3)):
                if ti.abs(x[g][k]) < 1e12:
                    ti.atomic_min(bounds[k], x[g][k])
                    ti.atomic_max(bounds[3 + k], x[g][k])
                else:
                    bounds[6] = 1.0

    return find_bounds


def make_scan(chunk_sum):
    """Func pieces of an exclusive prefix sum in three loops (chunks, their sums, chunks again)."""

    @ti.func
    def chunk_total(values: ti.template(), chunk, n):
        total = 0
        for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
            total += values[k]
        chunk_sum[chunk] = total

    @ti.func
    def chunk_starts(chunks):
        total = 0
        for chunk in range(chunks):
            here = chunk_sum[chunk]
            chunk_sum[chunk] = total
            total += here

    @ti.func
    def chunk_fill(values: ti.template(), starts: ti.template(), chunk, n):
        total = chunk_sum[chunk]
        for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
            here = values[k]
            starts[k] = total
            total += here

    return chunk_total, chunk_starts, chunk_fill


def make_find(fields, scratch, layout):
    """Kernel `find(grid, cells, reach2)`: the neighbours of every grain, sorted, and how many are
    its own (of higher number); starts of the pair list. cells: of all scenes of a batch."""
    x, x_search, counts = fields["x"], fields["x_search"], fields["counts"]
    cell_start, cell_fill = scratch["cell_start"], scratch["cell_fill"]
    cell_grain, near, near_count = scratch["cell_grain"], scratch["near"], scratch["near_count"]
    own_count, old_start = scratch["own_count"], scratch["old_start"]
    pair_start = fields["pair_start"]
    chunk_total, chunk_starts, chunk_fill = make_scan(scratch["chunk_sum"])
    scene = fields.get("scene")
    near_start, radius = scratch.get("near_start"), fields.get("radius")

    @ti.func
    def cell_of(p, grid):
        c = ti.cast((p - grid.origin) * grid.inv_edge, ti.i32)
        return ti.max(0, ti.min(c, grid.cells - 1))

    @ti.func
    def number(c, grid):
        return (c[0] * grid.cells[1] + c[1]) * grid.cells[2] + c[2]

    @ti.func
    def block_of(g, grid):
        """First cell of the scene of grain g: in a batch each scene has a block of cells."""
        first = 0
        if ti.static(layout.batch):
            first = scene[g] * (grid.cells[0] * grid.cells[1] * grid.cells[2])
        return first

    @ti.func
    def home(g, grid):
        return block_of(g, grid) + number(cell_of(x[g], grid), grid)

    @ti.func
    def list_cells(g, low, high, image, reach2):
        """Adds the grains of the cells low ... high, moved by `image`, to the neighbours of g."""
        for k in range(cell_start[low], cell_start[high + 1]):
            other = cell_grain[k]
            d = x[other] + image - x[g]
            if d.dot(d) < reach2 and other != g:
                found = near_count[g]
                if found < NEIGHBOURS:
                    place = found
                    while place > 0 and near[g, ti.max(place - 1, 0)] > other:
                        near[g, place] = near[g, place - 1]
                        place -= 1
                    near[g, place] = other
                    near_count[g] = found + 1
                    own_count[g] = own_count[g] + ti.cast(other > g, ti.i32)
                else:
                    counts[OVERFLOW] = 1

    @ti.func
    def is_near(g, other, image, margin):
        """Grains of their own radius: margin is what their surfaces may be apart."""
        d = x[other] + image - x[g]
        reach = radius[g] + radius[other] + margin
        return d.dot(d) < reach * reach and other != g

    @ti.func
    def count_cells(g, low, high, image, margin):
        """How many grains of these cells `list_unequal` is going to list."""
        for k in range(cell_start[low], cell_start[high + 1]):
            if is_near(g, cell_grain[k], image, margin):
                near_count[g] = near_count[g] + 1

    @ti.func
    def list_unequal(g, low, high, image, margin):
        """The same as list_cells, into lists that stand one after another."""
        first = near_start[g]
        for k in range(cell_start[low], cell_start[high + 1]):
            other = cell_grain[k]
            if is_near(g, other, image, margin):
                place = first + near_count[g]
                while place > first and near[ti.max(place - 1, 0)] > other:
                    near[place] = near[place - 1]
                    place -= 1
                near[place] = other
                near_count[g] = near_count[g] + 1
                own_count[g] = own_count[g] + ti.cast(other > g, ti.i32)

    @ti.func
    def visit_neighbours(g, grid, reach2, list_cells: ti.template()):
        c = cell_of(x[g], grid)
        near_count[g], own_count[g] = 0, 0
        if ti.static(layout.periodic):
            for a, b, e in ti.ndrange((-1, 2), (-1, 2), (-1, 2)):
                there = c + ti.Vector([a, b, e])
                image = ti.Vector.zero(ti.f64, 3)
                for n in ti.static(layout.periodic):
                    turn = ti.cast(there[n] >= grid.cells[n], ti.i32) - ti.cast(
                        there[n] < 0, ti.i32
                    )
                    there[n] -= turn * grid.cells[n]
                    image[n] = turn * grid.edges[n]
                if there.min() >= 0 and (grid.cells - 1 - there).min() >= 0:
                    here = number(there, grid)
                    list_cells(g, here, here, image, reach2)
        else:
            none = ti.Vector.zero(ti.f64, 3)
            first = block_of(g, grid)
            for a in range(ti.max(c[0] - 1, 0), ti.min(c[0] + 2, grid.cells[0])):
                for b in range(ti.max(c[1] - 1, 0), ti.min(c[1] + 2, grid.cells[1])):
                    # cells of a column stand one after another
                    low = number(ti.Vector([a, b, ti.max(c[2] - 1, 0)]), grid)
                    high = number(ti.Vector([a, b, ti.min(c[2] + 1, grid.cells[2] - 1)]), grid)
                    list_cells(g, first + low, first + high, none, reach2)

    @ti.kernel
    def find(grid: Grid, cells: ti.i32, reach2: ti.f64):
        grains, room = counts[GRAINS], counts[PAIR_ROOM]
        # reach2: where grains have radii of their own the margin between their surfaces
        for c in range(cells + 1):
            cell_fill[c] = 0
        for g in range(grains):
            x_search[g] = x[g]
            ti.atomic_add(cell_fill[home(g, grid)], 1)
        for chunk in range((cells + CHUNK) // CHUNK):
            chunk_total(cell_fill, chunk, cells + 1)
        for _ in range(1):
            chunk_starts((cells + CHUNK) // CHUNK)
        for chunk in range((cells + CHUNK) // CHUNK):
            chunk_fill(cell_fill, cell_start, chunk, cells + 1)
        for c in range(cells + 1):
            cell_fill[c] = cell_start[c]
        for g in range(grains):
            cell_grain[ti.atomic_add(cell_fill[home(g, grid)], 1)] = g
        for g in range(grains + 1):
            old_start[g] = pair_start[g]
        if ti.static(layout.polydisperse):
            for g in range(grains):
                visit_neighbours(g, grid, reach2, count_cells)
            for chunk in range((grains + CHUNK) // CHUNK):
                chunk_total(near_count, chunk, grains + 1)
            for _ in range(1):
                chunk_starts((grains + CHUNK) // CHUNK)
            for chunk in range((grains + CHUNK) // CHUNK):
                chunk_fill(near_count, near_start, chunk, grains + 1)
            for _ in range(1):
                if near_start[grains] > 2 * room:
                    counts[OVERFLOW] = 1
            for g in range(grains):
                if counts[OVERFLOW] == 0:
                    visit_neighbours(g, grid, reach2, list_unequal)
        else:
            for g in range(grains):
                visit_neighbours(g, grid, reach2, list_cells)
        for chunk in range((grains + CHUNK) // CHUNK):
            chunk_total(own_count, chunk, grains + 1)
        for _ in range(1):
            chunk_starts((grains + CHUNK) // CHUNK)
        for chunk in range((grains + CHUNK) // CHUNK):
            chunk_fill(own_count, pair_start, chunk, grains + 1)
        for _ in range(1):
            if pair_start[grains] > room:
                counts[OVERFLOW] = 1

    return find


def make_relist(fields, scratch, layout, write_constants=None):
    """Kernel `relist(edges)`: pairs, their history, and the list of contacts of every grain.

    edges: of the periodic cell. write_constants: `make_write_constants` of
    kernels.polydisperse, where grains have radii and materials of their own.
    """
    W = layout.width
    pair_i, pair_j, pair_start = fields["pair_i"], fields["pair_j"], fields["pair_start"]
    state, load, counts = fields["state"], fields["load"], fields["counts"]
    entry, entry_start = fields["entry"], fields["entry_start"]
    near, near_count = scratch["near"], scratch["near_count"]
    own_count, old_start, old_j = scratch["own_count"], scratch["old_start"], scratch["old_j"]
    chunk_total, chunk_starts, chunk_fill = make_scan(scratch["chunk_sum"])
    size = layout.state_size
    wall_slot = fields.get("wall_slot")
    walls = wall_slot is not None
    axes = layout.periodic
    x, shift = fields["x"], fields["shift"] if axes else None
    near_start = scratch.get("near_start")
    write_pair_constants, _, write_empty = write_constants or (None, None, None)

    @ti.func
    def neighbour(g, k):
        """Number k of the neighbours of g."""
        out = 0
        if ti.static(layout.polydisperse):
            out = near[near_start[g] + k]
        else:
            out = near[g, k]
        return out

    @ti.func
    def keep_old(b):
        """The loads are recomputed after a search: their place holds the old lists meanwhile."""
        for k in ti.static(range(size)):
            load[b, k] = state[b, k]
        old_j[b] = pair_j[b]

    @ti.func
    def write_pair(g, j, c, edges):
        b, k = c // W, c % W
        pair_i[b][k], pair_j[b][k] = g, j
        if ti.static(layout.polydisperse):
            write_pair_constants(b, k, g, j)
        for n in ti.static(range(len(axes))):
            a = ti.static(axes[n])
            shift[b, n][k] = ti.floor((x[g][a] - x[j][a]) / edges[a] + 0.5)
        old = -1
        for o in range(old_start[g], old_start[g + 1]):
            if old_j[o // W][o % W] == j:
                old = o
        for n in ti.static(range(size)):
            value = ti.cast(0.0, layout.geometry)
            if old >= 0:
                value = load[old // W, n][old % W]
            state[b, n][k] = value

    @ti.func
    def write_pairs(g, edges):
        c = pair_start[g]
        for k in range(near_count[g]):
            if neighbour(g, k) > g:
                write_pair(g, neighbour(g, k), c, edges)
                c += 1

    @ti.func
    def clear_lane(c):
        b, k = c // W, c % W
        pair_i[b][k], pair_j[b][k] = counts[GRAINS], counts[GRAINS] + 1
        if ti.static(layout.polydisperse):
            write_empty(b, k)
        for n in ti.static(range(size)):
            state[b, n][k] = 0.0
        for n in ti.static(range(len(axes))):
            shift[b, n][k] = 0.0

    @ti.func
    def contact_of(g, j):
        """Number of the pair g < j."""
        c, found = pair_start[g], -1
        for k in range(near_count[g]):
            if neighbour(g, k) == j:
                found = c
            c += ti.cast(neighbour(g, k) > g, ti.i32)
        return found

    @ti.func
    def write_entries(g):
        e = entry_start[g]
        for k in range(near_count[g]):
            j = neighbour(g, k)
            entry[e] = 2 * contact_of(ti.min(g, j), ti.max(g, j)) + ti.cast(j < g, ti.i32)
            e += 1
        if ti.static(walls):
            for n in range(6):
                if wall_slot[g][n] >= 0:
                    entry[e] = 2 * (counts[FIRST_WALL] * W + wall_slot[g][n])
                    e += 1

    @ti.kernel
    def relist(edges: ti.types.vector(3, ti.f64)):
        grains = counts[GRAINS]
        old_blocks = (old_start[grains] + W - 1) // W
        for b in range(old_blocks):
            keep_old(b)
        for g in range(grains):
            write_pairs(g, edges)
        for _ in range(1):
            pairs = pair_start[grains]
            counts[PAIRS] = pairs
            full = W * layout.tile
            for c in range(pairs, (pairs + full - 1) // full * full):
                clear_lane(c)

    @ti.kernel
    def list_entries():
        grains = counts[GRAINS]
        for g in range(grains):
            n = near_count[g]
            if ti.static(walls):
                for k in range(6):
                    n += ti.cast(wall_slot[g][k] >= 0, ti.i32)
            own_count[g] = n
        for _ in range(1):
            own_count[grains] = 0
        for chunk in range((grains + CHUNK) // CHUNK):
            chunk_total(own_count, chunk, grains + 1)
        for _ in range(1):
            chunk_starts((grains + CHUNK) // CHUNK)
        for chunk in range((grains + CHUNK) // CHUNK):
            chunk_fill(own_count, entry_start, chunk, grains + 1)
        for g in range(grains):
            write_entries(g)

    return relist, list_entries
