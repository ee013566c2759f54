"""Grains near each wall, in order, with the history of their contacts."""

from dusttaichi.compute.device_blocks import THREADS, BlockSums, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, count_blocks, first_item
from dusttaichi.grains.kernels.grain_cells import TIME, WALL_REACH
from dusttaichi.grains.kernels.relist import HistoryRows
from dusttaichi.grains.kernels.store import (
    FIRST_WALL,
    GRAINS,
    OVERFLOW,
    PLANES,
    WALL_BLOCKS,
    WALL_ROOM,
    WALL_SECTIONS,
)
from dusttaichi.grains.kernels.surface_kinematics import CurvedSurfaces
from dusttaichi.physics.surfaces import plane

plane_distance = ti.func(plane.distance)
FAR = 1e9  # distance that keeps an empty lane out of touch [um]


@ti.data_oriented
class WallLists:
    """Functions that find the grains near each wall and write their lanes (make_body_relist).

    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    """

    begin = FIRST_WALL

    def __init__(self, fields, scratch, layout, write_constants):
        self.bodies, self.impulses = layout.surfaces, layout.impulses
        self.curved = None
        if layout.curved:
            self.curved = CurvedSurfaces(layout.curved, fields["surfaces"])
        self.count = len(layout.curved)
        self.width, self.history = layout.width, HistoryRows(fields, layout)
        self.polydisperse, self.numbers = layout.polydisperse, scratch["grid"]
        for name in ("x", "counts", "impulse", "wall_grain", "wall_gap", "wall_of", "wall_slot"):
            setattr(self, name, fields[name])
        # of each wall and chunk of grains: contacts, then the first of them
        self.chunk_first, self.scan = scratch["wall_chunk"], Scan(scratch["chunk_sum"])
        self.chunk_room = -(-scratch["in_cell"].shape[0] // CHUNK)
        self.radius = fields.get("radius")
        self.write_constants = getattr(write_constants, "wall", None)
        self.write_empty = getattr(write_constants, "empty", None)

    @ti.func
    def blocks(self):
        """Number of blocks of the lists before."""
        return self.counts[WALL_BLOCKS]

    @ti.func
    def body(self, n, box: ti.template(), grid: ti.template()):
        """Unit normal of wall n, where it is along that, and how far from it a grain is near.

        That is a distance of centre and wall, of polydisperse grains of their surfaces; far below
        zero where there is no wall.
        """
        plane = n
        if ti.static(self.count > 0):
            plane = ti.min(n, PLANES - 1)
        normal = ti.Vector([box.normal[plane, 0], box.normal[plane, 1], box.normal[plane, 2]])
        offset = box.offset[plane] + box.speed[plane] * self.numbers[TIME]
        reach = self.numbers[WALL_REACH + n]
        return ti.Struct(normal=normal, offset=offset, reach=reach, number=n)

    @ti.func
    def is_near(self, g, wall):
        distance = plane_distance(self.x[g], wall)
        for n in ti.static(range(self.count)):
            if wall.number == PLANES + n:
                distance = self.curved.distance(n, self.x[g], self.numbers[TIME])
        if ti.static(self.polydisperse):
            distance -= self.radius[g]
        return distance < wall.reach

    @ti.func
    def slot(self, g, n):
        return self.wall_slot[g][n]

    @ti.func
    def put_slot(self, g, n, c):
        self.wall_slot[g][n] = c

    @ti.func
    def lay_out(self):
        """Find the first lane of each wall and chunk.

        To be called outside of the loops of a kernel.
        """
        if ti.static(on_device()):
            # a block is a lane, so that those of a wall need not begin with a whole block
            entries = ti.static(self.bodies * self.chunk_room)
            self.scan.exclusive(self.chunk_first, self.chunk_first, ti.static(entries + 1))
            for _ in range(1):
                if self.counts[OVERFLOW] == 0:
                    self.counts[WALL_BLOCKS] = self.chunk_first[entries]
                    if self.chunk_first[entries] > self.counts[WALL_ROOM]:
                        self.counts[OVERFLOW], self.counts[WALL_BLOCKS] = 2, 0
        else:
            ti.loop_config(serialize=True)
            for _ in range(1):
                if self.counts[OVERFLOW] == 0:
                    self.lay_out_sections()

    @ti.func
    def lay_out_sections(self):
        """Lanes and blocks of each wall, section by section."""
        block, sections, chunks = (
            0,
            self.counts[WALL_SECTIONS],
            count_blocks(self.counts[GRAINS], CHUNK),
        )
        for section in range(sections):
            first = first_item(section, sections, chunks)
            end = first_item(section + 1, sections, chunks)
            for n in range(self.bodies):
                lanes = 0
                for chunk in range(first, end):
                    lanes_of_chunk = self.chunk_first[n * self.chunk_room + chunk]
                    self.chunk_first[n * self.chunk_room + chunk] = block * self.width + lanes
                    lanes += lanes_of_chunk
                blocks = count_blocks(lanes, self.width)
                if block + blocks > self.counts[WALL_ROOM]:
                    self.counts[OVERFLOW] = 2
                    blocks, lanes = 0, 0
                for number in range(block, block + blocks):
                    self.begin_block(number, n)
                for number in range(block * self.width + lanes, (block + blocks) * self.width):
                    self.clear_lane(number)
                block += blocks
        self.counts[WALL_BLOCKS] = block

    @ti.func
    def begin_block(self, c, n):
        """Block c of the contacts with walls is of wall n; its impulses before have been summed."""
        self.wall_of[c] = n
        for a in ti.static(range(self.impulses)):
            self.impulse[c, a] = 0.0

    @ti.func
    def clear_lane(self, c):
        b, k = c // self.width, c % self.width
        self.wall_grain[b, k], self.wall_gap[b, k] = self.counts[GRAINS], FAR
        if ti.static(self.polydisperse):
            self.write_empty(self.counts[FIRST_WALL] + b, k)
        self.history.clear(self.counts[FIRST_WALL] + b, k)

    @ti.func
    def write(self, b, k, g, n, grid: ti.template()):
        c = b - self.counts[FIRST_WALL]
        self.wall_grain[c, k], self.wall_gap[c, k] = g, 0.0
        if ti.static(on_device()):
            self.begin_block(c, n)
        if ti.static(self.polydisperse):
            self.write_constants(b, k, g, n)


@ti.data_oriented
class WallSums:
    """Force of each wall and its impulse since the last search, by a block of threads of a device.

    In a fixed order; a block has one contact there.
    """

    def __init__(self, fields):
        self.counts, self.of, self.load = fields["counts"], fields["wall_of"], fields["load"]
        self.impulse, self.columns = fields["impulse"], fields["impulse"].shape[1]
        self.sums = BlockSums(3 + self.columns)

    @ti.func
    def of_wall(self, wall, thread):
        """Number `thread` of the force and the impulse; all threads of the block must call it."""
        sums = ti.Vector.zero(ti.f64, ti.static(3 + self.columns))
        blocks = self.counts[WALL_BLOCKS]
        for n in range(count_blocks(blocks, THREADS)):
            c = n * THREADS + thread
            if c < blocks:
                if self.of[c] == wall:
                    for a in ti.static(range(3)):
                        sums[a] += ti.cast(self.load[self.counts[FIRST_WALL] + c, a, 0], ti.f64)
                    for a in ti.static(range(self.columns)):
                        sums[3 + a] += self.impulse[c, a]
        return self.sums.total(sums, thread)


def make_fold(fields):
    """Function `fold()`: adds the impulses of the lists before to those of the walls.

    To be called outside of the loops of a kernel.
    """
    counts, wall_of, impulse = fields["counts"], fields["wall_of"], fields["impulse"]
    impulse_total, sums = fields["impulse_total"], WallSums(fields)

    @ti.func
    def add(wall, a: ti.template(), value):
        impulse_total[wall][a] = impulse_total[wall][a] + value

    @ti.func
    def fold():
        if ti.static(on_device()):
            ti.loop_config(block_dim=THREADS)
            for thread in range(ti.static(impulse_total.shape[0]) * THREADS):
                total = sums.of_wall(thread // THREADS, thread % THREADS)
                for component in ti.static(range(sums.columns)):
                    if thread % THREADS == 3 + component:
                        add(thread // THREADS, component, total)
        else:
            ti.loop_config(serialize=True)
            for _ in range(1):
                for contact in range(counts[WALL_BLOCKS]):
                    for component in ti.static(range(sums.columns)):
                        add(wall_of[contact], component, impulse[contact, component])

    return fold
