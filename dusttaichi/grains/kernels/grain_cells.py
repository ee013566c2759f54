"""The search for neighbours: grid of cells, and the neighbours of every grain in a fixed order.

Called only when a grain or a wall has moved half the skin since the last time, with the positions
of that moment: every pair closer than touch + skin is in the list, so that no contact can form
outside it. Lists are sorted by grain number, whatever order the threads worked in.
"""

from types import SimpleNamespace

from dusttaichi.compute.device_blocks import is_idle, loop_length
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, is_short, scan_capacity
from dusttaichi.grains.kernels.members import make_stand_apart
from dusttaichi.grains.kernels.store import (
    GRAINS,
    NEIGHBOURS,
    OVERFLOW,
    PAIR_ROOM,
    capacity,
)
from dusttaichi.particles.cells import Bounds, Sort, grid_length, place_cells

CELLS_PER_GRAIN, FURTHER_CELLS = 4, 252
FARTHEST = 1e12  # um; a position beyond it counts as not a number
# numbers of a search in the field `grid`, behind those of the cells: a kernel reads them from
# there, for Python passes them more slowly than it searches. REACH: of two centres, squared, where
# grains have radii of their own the margin between their surfaces; TIME, WALL_REACH (of six walls
# and surfaces): see WallLists.body; SPHERE_REACH: see SphereLists.body. AROUND: cells along x and y
# around one. If LLVM knew their number, it would write their loops out nine times, as it writes out
# a loop with a single end eight times
REACH, TIME, SPHERE_REACH, AROUND, WALL_REACH = range(grid_length(3), grid_length(3) + 5)
OWN_NUMBERS = 4  # beside the reach of each wall


def place_search(grains, layout, walls):
    """Scratch fields of the search."""
    pair_blocks = capacity(grains, layout, walls)[0]
    # a large grain may have very many small neighbours: lists are one after another
    near = 2 * pair_blocks * layout.width if layout.polydisperse else grains * NEIGHBOURS
    fields = {"near_start": ti.field(ti.i32, shape=grains + 1)} if layout.polydisperse else {}
    if walls:
        fields["wall_chunk"] = ti.field(ti.i32, shape=layout.surfaces * -(-grains // CHUNK) + 1)
    if layout.sphere:
        fields["sphere_chunk"] = ti.field(ti.i32, shape=-(-grains // CHUNK) + 1)
    method_numbers = OWN_NUMBERS + layout.surfaces
    if layout.members:
        fields["apart"] = ti.Vector.field(3, ti.f64, shape=grains)
    return (
        place_cells(
            3, grains, CELLS_PER_GRAIN * grains + FURTHER_CELLS, method_numbers=method_numbers
        )
        | fields
        | {
            "near": ti.field(ti.i32, shape=near),
            "near_count": ti.field(ti.i32, shape=grains + layout.polydisperse),
            "own_count": ti.field(ti.i32, shape=grains + 1),
            "old_start": ti.field(ti.i32, shape=grains + 1),
            "chunk_sum": ti.field(ti.i32, shape=scan_capacity(grains + 1)),
        }
    )


def make_bounds(fields, scratch):
    """Kernel `find_bounds()` of all grains, and of their speeds (particles.cells.Bounds)."""
    x, bound_options = (
        fields["x"],
        {"capacity": scratch["in_cell"].shape[0], "v": fields["v"]},
    )
    if "apart" in scratch:
        x = scratch["apart"]
        bound_options["preparations"] = (make_stand_apart(fields, scratch),)
    bounds = Bounds(x, scratch["bounds"], counter(fields), FARTHEST, **bound_options)

    @ti.kernel
    def find_bounds():
        bounds.find()

    return find_bounds


def counter(fields):
    """Function `count()`: number of grains."""
    counts = fields["counts"]

    @ti.func
    def count():
        return counts[GRAINS]

    return count


@ti.data_oriented
class Neighbours:
    """The lists of neighbours.

    Equal grains: NEIGHBOURS entries of `near` each. Polydisperse ones: lists one after another,
    counted first.
    """

    def __init__(self, fields, scratch, layout, cells):
        self.cells, self.polydisperse = cells, layout.polydisperse
        self.x, self.counts, self.numbers = fields["x"], fields["counts"], scratch["grid"]
        self.max_neighbours = scratch["near"].shape[0] if layout.polydisperse else NEIGHBOURS
        self.first, self.member = scratch["cell_first"], scratch["in_cell"]
        self.near, self.near_count = scratch["near"], scratch["near_count"]
        self.own_count, self.capacity = scratch["own_count"], scratch["in_cell"].shape[0]
        self.near_start, self.radius = scratch.get("near_start"), fields.get("radius")
        # members are apart in the cells, so that none sees another
        self.seen, self.body = scratch.get("apart", self.x), fields.get("body")
        self.members = layout.members

    @ti.func
    def insert(self, grain, neighbour, first, counts: ti.template()):
        """Insert a neighbour of a grain into its sorted list, which begins at `first`.

        counts: number of its neighbours, and of those with higher numbers.
        """
        slot = first + counts[0]
        while slot > first and self.near[ti.max(slot - 1, 0)] > neighbour:
            self.near[slot] = self.near[slot - 1]
            slot -= 1
        self.near[slot] = neighbour
        counts[0] += 1
        counts[1] += ti.cast(neighbour > grain, ti.i32)

    @ti.func
    def add(self, grain, neighbour, counts: ti.template(), counting: ti.template()):
        """Add a neighbour of a grain, or only count it."""
        if ti.static(counting):
            counts[0] += 1
        elif ti.static(self.polydisperse):
            self.insert(grain, neighbour, self.near_start[grain], counts)
        elif counts[0] < NEIGHBOURS:
            self.insert(grain, neighbour, grain * NEIGHBOURS, counts)
        else:
            self.counts[OVERFLOW] = 1
            counts[0] += 1

    @ti.func
    def reach2(self, g, neighbour, reach):
        """Square of the distance within which two grains are neighbours."""
        out = reach
        if ti.static(self.polydisperse):
            far = self.radius[g] + self.radius[neighbour] + reach
            out = far * far
        return out

    @ti.func
    def meets(self, g, neighbour):
        """True if a grain may touch another one."""
        out = neighbour != g
        if ti.static(self.members):
            out = out and self.body[g] >> 1 == self.body[neighbour] >> 1
        return out

    @ti.func
    def visit(self, grain, grid, reach, counting: ti.template()):
        """Count or list the neighbours of a grain in the cells around its own."""
        position, counts, side = (
            self.x[grain],
            ti.Vector([0, 0]),
            ti.cast(self.numbers[AROUND], ti.i32),
        )
        begin, box_size = (
            self.cells.find_cell(self.seen[grain], grid) - 1,
            ti.Vector([side, side, 3]),
        )
        for cut in range(box_size[0]):
            for run in range(self.cells.runs(box_size)):
                first_cell, behind, image = self.cells.run(begin, box_size, cut, run, grid)
                entry, end = self.first[first_cell], self.first[behind]
                while entry < end and counts[0] <= self.max_neighbours:
                    neighbour = self.member[entry]
                    separation = self.x[neighbour] + image - position
                    if separation.dot(separation) < self.reach2(
                        grain, neighbour, reach
                    ) and self.meets(grain, neighbour):
                        self.add(grain, neighbour, counts, counting)
                    entry += 1
        self.near_count[grain], self.own_count[grain] = counts[0], counts[1]

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


def make_find(fields, scratch, layout, cells):
    """Function `find(grid)`: the neighbours of every grain, sorted; starts of the pair list.

    And the number of those that are its own (of higher number). To be called outside of the loops
    of a kernel. cells: Cells.
    """
    x, x_search, counts = fields["x"], fields["x_search"], fields["counts"]
    near_count, numbers = scratch["near_count"], scratch["grid"]
    own_count, old_start = scratch["own_count"], scratch["old_start"]
    pair_start, near_start = fields["pair_start"], scratch.get("near_start")
    scan, neighbours = Scan(scratch["chunk_sum"]), Neighbours(fields, scratch, layout, cells)
    room, light, seen = old_start.shape[0] - 1, is_short(x.shape[0]), scratch.get("apart", x)

    @ti.func
    def home(g, grid: ti.template()):
        out = cells.number(cells.find_cell(seen[g], grid), grid)
        if ti.static(layout.members):  # a member at rest is in none
            out = ti.select(fields["body"][g] >= 0, out, -1)
        return out

    sort = Sort(SimpleNamespace(**scratch), counter(fields), cells.total, home, ordered=False)

    @ti.func
    def find(grid: ti.template()):
        reach = numbers[REACH]
        sort.sort(grid)
        ti.loop_config(serialize=light)
        for grain in range(loop_length(counts[GRAINS] + 1, room + 1)):
            old_start[grain] = pair_start[grain]
            if grain < counts[GRAINS]:
                x_search[grain] = x[grain]
        if ti.static(layout.polydisperse):
            neighbours.visit_all(grid, reach, True)
            scan.exclusive(near_count, near_start, loop_length(counts[GRAINS] + 1, room + 1))
            limit(near_start, 2)
        neighbours.visit_all(grid, reach, False)
        scan.exclusive(own_count, pair_start, loop_length(counts[GRAINS] + 1, room + 1))
        limit(pair_start, 1)

    @ti.func
    def limit(starts: ti.template(), times: ti.template()):
        """Set the overflow where lists, with one number after them, exceed the capacity."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            if starts[counts[GRAINS]] >= times * counts[PAIR_ROOM]:
                counts[OVERFLOW] = 1

    return find
