"""Grains near each wall, in order, with the history of their contacts."""

from dusttaichi.compute.blocks import THREADS, BlockSums, is_idle, loop_length, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, first_of, is_short, whole
from dusttaichi.grains.kernels.relist import HistoryRows
from dusttaichi.grains.kernels.search import TIME, WALL_REACH
from dusttaichi.grains.kernels.store import (
    FIRST_WALL,
    GRAINS,
    OVERFLOW,
    WALL_BLOCKS,
    WALL_ROOM,
    WALL_SECTIONS,
)

FAR = 1e9  # distance that keeps an empty lane out of touch [um]


@ti.data_oriented
class WallLists:
    """Functions that find the grains near each wall and write their lanes.

    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    """

    def __init__(self, fields, scratch, layout, write_constants):
        self.width, self.history = layout.width, HistoryRows(fields, layout)
        self.polydisperse = layout.polydisperse
        for name in ("x", "counts", "impulse", "impulse_total"):
            setattr(self, name, fields[name])
        for name in ("wall_grain", "wall_gap", "wall_of", "wall_slot"):
            setattr(self, name, fields[name])
        # of each wall and chunk of grains: contacts, then the first of them
        self.wall_chunk, self.scan = scratch["wall_chunk"], Scan(scratch["chunk_sum"])
        self.chunk_room = -(-scratch["in_cell"].shape[0] // CHUNK)
        self.radius = fields.get("radius")
        self.write_wall_constants = getattr(write_constants, "wall", None)
        self.write_empty = getattr(write_constants, "empty", None)

    @ti.func
    def plane(self, n, box: ti.template(), time):
        """Unit normal of wall n, and where it is along that at a time."""
        normal = ti.Vector([box.normal[n, 0], box.normal[n, 1], box.normal[n, 2]])
        return normal, box.offset[n] + box.speed[n] * time

    @ti.func
    def is_near(self, g, normal, place, reach):
        distance = self.x[g].dot(normal) - place
        if ti.static(self.polydisperse):
            distance -= self.radius[g]
        return distance < reach

    @ti.func
    def fold_impulses(self, blocks):
        for c in range(blocks):
            for a in ti.static(range(3)):
                self.impulse_total[self.wall_of[c]][a] = (
                    self.impulse_total[self.wall_of[c]][a] + self.impulse[c, a]
                )

    @ti.func
    def put_aside(self, c):
        """The history of a block to where the new lists find it; its impulses have been summed."""
        self.history.put_aside(self.counts[FIRST_WALL] + c)
        for a in ti.static(range(3)):
            self.impulse[c, a] = 0.0

    @ti.func
    def chunks(self):
        """Number of chunks of grains that a loop passes."""
        return loop_length(whole(self.counts[GRAINS], CHUNK), self.chunk_room)

    @ti.func
    def lay_out(self):
        """Find the first lane of each wall and chunk.

        To be called outside of the loops of a kernel.
        """
        if ti.static(on_device()):
            # a block is a lane, so that those of a wall need not begin with a whole block
            entries = ti.static(6 * self.chunk_room)
            self.scan.exclusive(self.wall_chunk, self.wall_chunk, ti.static(entries + 1))
            for _ in range(1):
                if self.counts[OVERFLOW] == 0:
                    self.counts[WALL_BLOCKS] = self.wall_chunk[entries]
                    if self.wall_chunk[entries] > self.counts[WALL_ROOM]:
                        self.counts[OVERFLOW], self.counts[WALL_BLOCKS] = 2, 0
        else:
            ti.loop_config(serialize=True)
            for _ in range(1):
                if self.counts[OVERFLOW] == 0:
                    self.lay_out_sections()

    @ti.func
    def lay_out_sections(self):
        """Lanes and blocks of each wall, section by section."""
        block, sections, chunks = 0, self.counts[WALL_SECTIONS], self.chunks()
        for section in range(sections):
            first = first_of(section, sections, chunks)
            end = first_of(section + 1, sections, chunks)
            for n in range(6):
                lanes = 0
                for chunk in range(first, end):
                    here = self.wall_chunk[n * self.chunk_room + chunk]
                    self.wall_chunk[n * self.chunk_room + chunk] = block * self.width + lanes
                    lanes += here
                blocks = whole(lanes, self.width)
                if block + blocks > self.counts[WALL_ROOM]:
                    self.counts[OVERFLOW] = 2
                    blocks, lanes = 0, 0
                for c in range(block, block + blocks):
                    self.wall_of[c] = n
                for c in range(block * self.width + lanes, (block + blocks) * self.width):
                    self.clear_lane(c)
                block += blocks
        self.counts[WALL_BLOCKS] = block

    @ti.func
    def clear_lane(self, c):
        b, k = c // self.width, c % self.width
        self.wall_grain[b, k] = self.counts[GRAINS]
        self.wall_gap[b, k] = FAR
        if ti.static(self.polydisperse):
            self.write_empty(self.counts[FIRST_WALL] + b, k)
        self.history.clear(self.counts[FIRST_WALL] + b, k)

    @ti.func
    def write_contact(self, g, n, c):
        first = self.counts[FIRST_WALL]
        b, k = c // self.width, c % self.width
        self.wall_grain[b, k] = g
        self.wall_gap[b, k] = 0.0
        if ti.static(on_device()):
            self.wall_of[b] = n
        if ti.static(self.polydisperse):
            self.write_wall_constants(first + b, k, g)
        old = self.wall_slot[g][n]
        if old >= 0:
            old += first * self.width
        self.history.carry(first + b, k, old)


@ti.data_oriented
class WallSums:
    """Sums over the contacts of a wall by a block of threads, in a fixed order.

    part(c): function that gives the vector of block c of the contacts with walls.
    """

    def __init__(self, counts, wall_of, part):
        self.counts, self.of, self.part, self.sums = counts, wall_of, part, BlockSums(3)

    @ti.func
    def of_wall(self, wall, thread):
        """Component number `thread` of the sum; all threads of the block must call it."""
        own, blocks = ti.Vector.zero(ti.f64, 3), self.counts[WALL_BLOCKS]
        for n in range(whole(blocks, THREADS)):
            c = n * THREADS + thread
            if c < blocks:
                if self.of[c] == wall:
                    own += self.part(c)
        return self.sums.total(own, thread)


def impulse_sums(fields):
    """WallSums of the impulses since the last search."""
    impulse = fields["impulse"]

    @ti.func
    def part(c):
        return ti.Vector([impulse[c, 0], impulse[c, 1], impulse[c, 2]])

    return WallSums(fields["counts"], fields["wall_of"], part)


def force_sums(fields, layout):
    """WallSums of the forces; a block has one contact."""
    counts, load = fields["counts"], fields["load"]

    @ti.func
    def part(c):
        b = counts[FIRST_WALL] + c
        own = ti.Vector([load[b, 0, 0], load[b, 1, 0], load[b, 2, 0]])
        return ti.cast(own, ti.f64)

    return WallSums(counts, fields["wall_of"], part)


def make_fold(fields, lists):
    """Function `fold()`: adds the impulses of the lists before to those of the walls.

    To be called outside of the loops of a kernel.
    """
    counts, impulse_total, sums = fields["counts"], fields["impulse_total"], impulse_sums(fields)

    @ti.func
    def fold():
        if ti.static(on_device()):
            ti.loop_config(block_dim=THREADS)
            for t in range(6 * THREADS):
                wall, thread = t // THREADS, t % THREADS
                total = sums.of_wall(wall, thread)
                for a in ti.static(range(3)):
                    if thread == a:
                        impulse_total[wall][a] = impulse_total[wall][a] + total
        else:
            ti.loop_config(serialize=True)
            for _ in range(1):
                lists.fold_impulses(counts[WALL_BLOCKS])

    return fold


def make_wall_relist(fields, scratch, layout, write_constants=None):
    """Function `relist_walls(box)`, to be called outside of the loops of a kernel.

    WALL_REACH, numbers of the search, is the distance of centre and wall within which a grain
    is listed, of polydisperse grains that of their surfaces; far below zero where there is no wall.
    write_constants: see WallLists.
    """
    counts, wall_slot = fields["counts"], fields["wall_slot"]
    lists = WallLists(fields, scratch, layout, write_constants)
    numbers = scratch["grid"]
    light, fold = is_short(fields["x"].shape[0]), make_fold(fields, lists)
    wall_chunk, blocks = lists.wall_chunk, fields["wall_of"].shape[0]

    @ti.func
    def near_wall(box: ti.template(), q, write: ti.template()):
        """Counts or writes the contacts of a chunk of grains with a wall, number q of both."""
        n, chunk = q // lists.chunks(), q % lists.chunks()
        entry = n * lists.chunk_room + chunk
        normal, place = lists.plane(n, box, numbers[TIME])
        reach, c = numbers[WALL_REACH + n], 0
        if ti.static(write):
            c = wall_chunk[entry]
        for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, counts[GRAINS])):
            if ti.static(write):
                if lists.is_near(g, normal, place, reach) and counts[OVERFLOW] == 0:
                    lists.write_contact(g, n, c)
                    wall_slot[g][n] = c
                    c += 1
                else:
                    wall_slot[g][n] = -1
            else:
                c += ti.cast(lists.is_near(g, normal, place, reach), ti.i32)
        if ti.static(not write):
            wall_chunk[entry] = c

    @ti.func
    def relist_walls(box: ti.template()):
        fold()
        ti.loop_config(serialize=light)
        for c in range(loop_length(counts[WALL_BLOCKS], blocks)):
            if is_idle(c, counts[WALL_BLOCKS]):
                continue
            lists.put_aside(c)
        ti.loop_config(serialize=light)
        for q in range(6 * lists.chunks()):
            near_wall(box, q, False)
        lists.lay_out()
        ti.loop_config(serialize=light)
        for q in range(6 * lists.chunks()):
            near_wall(box, q, True)

    return relist_walls
