"""The lists that the steps use, from the neighbours that a search has found.

Pairs with their history, carried over exactly, and the contacts of every grain.
"""

from dusttaichi.compute.device_blocks import is_idle, loop_length, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, count_blocks, is_short
from dusttaichi.grains.kernels.list_entries import encode_entry
from dusttaichi.grains.kernels.store import GRAINS, NEIGHBOURS, OVERFLOW, PAIRS
from dusttaichi.particles.lists import Lists


@ti.data_oriented
class HistoryRows:
    """History of the contacts, carried from the lists of the last search to the new ones.

    Loads are computed again after that: their rows contain the old history meanwhile. Blocks are
    masked as in kernels.contact_pass: loops over lanes become vectors, their code is half as long.
    """

    def __init__(self, fields, layout):
        self.table, self.load, self.rows = fields["contact"], fields["load"], layout.state_rows
        self.width, self.dtype, self.mask = layout.width, layout.law, layout.mask

    @ti.func
    def put_aside(self, block):
        """Copy the history of a block to where the new lists read it."""
        index = block & self.mask
        for n in range(self.rows):
            for lane in range(self.width):
                self.load[index, n, lane] = self.table[index, n, lane]

    @ti.func
    def carry(self, block, lane, previous):
        """Give a lane the history of contact `previous`, none where that is -1."""
        index, slot = block & self.mask, ti.max(previous, 0)
        source_block, source_lane = (slot // self.width) & self.mask, slot % self.width
        for n in range(self.rows):
            value = self.load[source_block, n, source_lane]
            self.table[index, n, lane] = ti.select(previous >= 0, value, ti.cast(0.0, self.dtype))

    @ti.func
    def clear(self, block, lane):
        index = block & self.mask
        for n in range(self.rows):
            self.table[index, n, lane] = 0.0


@ti.data_oriented
class PairLanes:
    """Functions for the lanes of contacts of two bodies that both move: two grains, or the sphere.

    write_constants, write_empty: of kernels.polydisperse, None of equal grains.
    """

    def __init__(self, fields, layout, write_constants, write_empty):
        self.axes, self.tilted = layout.periodic, layout.tilted
        self.x, self.counts, self.shift = fields["x"], fields["counts"], fields.get("shift")
        self.pair_i, self.pair_j = fields["pair_i"], fields["pair_j"]
        self.history = HistoryRows(fields, layout)
        self.polydisperse = layout.polydisperse
        self.write_constants, self.write_empty = write_constants, write_empty

    @ti.func
    def write(self, block, lane, grain, j, grid: ti.template()):
        """Give a lane to the contact of a grain and body j."""
        self.pair_i[block, lane], self.pair_j[block, lane] = grain, j
        if ti.static(self.polydisperse):
            self.write_constants(block, lane, grain, j)
        shifted = ti.cast(0.0, ti.f64)
        for passed in ti.static(range(len(self.axes))):
            # from the last axis to the first: a face across z also displaces along x
            column = ti.static(len(self.axes) - 1 - passed)
            axis = ti.static(self.axes[column])
            way = self.x[grain][axis] - self.x[j][axis]
            if ti.static(self.tilted and axis == 0):
                way -= shifted
            turns = ti.floor(way / grid.edges[axis] + 0.5)
            self.shift[block, column, lane] = turns
            if ti.static(self.tilted and axis == 2):
                shifted = turns * grid.tilt

    @ti.func
    def clear(self, block, lane):
        """An empty lane: two grains that are far away."""
        self.pair_i[block, lane], self.pair_j[block, lane] = (
            self.counts[GRAINS],
            self.counts[GRAINS] + 1,
        )
        if ti.static(self.polydisperse):
            self.write_empty(block, lane)
        self.history.clear(block, lane)
        for n in ti.static(range(len(self.axes))):
            self.shift[block, n, lane] = 0.0


@ti.data_oriented
class PairLists:
    """Functions that write pairs, their history, and the entries of grains.

    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    further_lists: WallLists and SphereLists that the scene has.
    """

    def __init__(self, fields, scratch, layout, write_constants, further_lists):
        self.width, self.polydisperse, self.further_lists = (
            layout.width,
            layout.polydisperse,
            further_lists,
        )
        writers = (getattr(write_constants, name, None) for name in ("pair", "empty"))
        self.lanes = PairLanes(fields, layout, *writers)
        self.history, self.counts = self.lanes.history, fields["counts"]
        self.pair_j, self.pair_start = fields["pair_j"], fields["pair_start"]
        self.entry, self.first = fields["entry"], fields["entry_start"]
        self.near, self.near_start = scratch["near"], scratch.get("near_start")
        self.near_count, self.old_start = scratch["near_count"], scratch["old_start"]

    @ti.func
    def neighbour(self, grain, k):
        """Neighbour number k of a grain."""
        out = 0
        if ti.static(self.polydisperse):
            out = self.near[self.near_start[grain] + k]
        else:
            out = self.near[grain * NEIGHBOURS + k]
        return out

    @ti.func
    def keep_old(self, block):
        """Keep the former partners in place of the entries, which are listed again."""
        index = block & self.history.mask
        self.history.put_aside(index)
        for lane in range(self.width):
            self.entry[index * self.width + lane] = self.pair_j[index, lane]

    @ti.func
    def write_pairs(self, grain, grid: ti.template()):
        contact = self.pair_start[grain]
        for n in range(self.near_count[grain]):
            j = self.neighbour(grain, n)
            if j > grain:
                block, lane = contact // self.width, contact % self.width
                self.lanes.write(block, lane, grain, j, grid)
                previous, end = self.old_start[grain], self.old_start[grain + 1]
                while previous < end and self.entry[previous] != j:
                    previous += 1
                self.history.carry(block, lane, ti.select(previous < end, previous, -1))
                contact += 1

    @ti.func
    def contact_of(self, grain, j):
        """Number of the pair of a grain and j, which is larger."""
        contact, k = self.pair_start[grain], 0
        while k < self.near_count[grain] and self.neighbour(grain, k) != j:
            contact += ti.cast(self.neighbour(grain, k) > grain, ti.i32)
            k += 1
        return ti.select(k < self.near_count[grain], contact, -1)

    @ti.func
    def count(self):
        """Number of grains."""
        return self.counts[GRAINS]

    @ti.func
    def entries(self, grain, listing: ti.template()):
        """Length of the list of a grain's contacts, with the number that ends it.

        It is written if `listing` (particles.lists): pairs of which it is the second grain, those
        of which it is the first, contacts with other bodies.
        """
        n, first_pair, near = 0, self.pair_start[grain], self.near_count[grain]
        pairs = self.pair_start[grain + 1] - first_pair
        if self.counts[OVERFLOW] > 0:
            pairs, near = 0, 0
        for k in range(near):
            j = self.neighbour(grain, k)
            if j < grain:
                if ti.static(listing):
                    self.put(grain, n, self.contact_of(j, grain), 1)
                n += 1
        if ti.static(listing):
            for k in range(pairs):
                self.put(grain, n + k, first_pair + k, 0)
        n += pairs
        for lists in ti.static(self.further_lists):
            for k in range(lists.bodies):
                slot = lists.slot(grain, k)
                if slot >= 0:
                    if ti.static(listing):
                        self.put(grain, n, self.counts[lists.begin] * self.width + slot, 0)
                    n += 1
        if ti.static(listing):
            self.entry[self.first[grain] + n] = -1
        return n + 1

    @ti.func
    def put(self, grain, n, contact, is_second):
        """Write number n of the list of a grain, which is the second body if `is_second` is 1."""
        self.entry[self.first[grain] + n] = encode_entry(contact, is_second, self.width)


def make_relist(fields, scratch, layout, write_constants=None, further_lists=()):
    """Functions `relist(grid)`: pairs and their history, and `list_entries()`: contacts of grains.

    To be called outside of the loops of a kernel. write_constants, further_lists: see PairLists.
    """
    width, counts = layout.width, fields["counts"]
    old_start, pair_start = scratch["old_start"], fields["pair_start"]
    lists = PairLists(fields, scratch, layout, write_constants, further_lists)
    entries = Lists(lists, scratch["own_count"], scratch["chunk_sum"])
    room, blocks = scratch["in_cell"].shape[0], fields["pair_i"].shape[0]
    light, in_order = is_short(fields["x"].shape[0]), not on_device()

    @ti.func
    def old_blocks():
        return count_blocks(old_start[counts[GRAINS]], width)

    @ti.func
    def relist(grid: ti.template()):
        ti.loop_config(serialize=light)
        for block in range(loop_length(old_blocks(), blocks)):
            if is_idle(block, old_blocks()) or counts[OVERFLOW] > 0:
                continue
            lists.keep_old(block)
        ti.loop_config(serialize=light)
        for grain in range(loop_length(counts[GRAINS], room)):
            if is_idle(grain, counts[GRAINS]) or counts[OVERFLOW] > 0:
                continue
            lists.write_pairs(grain, grid)
        ti.loop_config(serialize=in_order)
        for k in range(width * layout.tile):
            if counts[OVERFLOW] == 0:
                pairs, full = pair_start[counts[GRAINS]], width * layout.tile
                if k == 0:
                    counts[PAIRS] = pairs
                # one at least: a grain's pairs end where those of another begin
                if k == 0 or pairs + k < count_blocks(pairs, full) * full:
                    lists.lanes.clear((pairs + k) // width, (pairs + k) % width)

    return relist, entries.fill


def make_body_relist(fields, scratch, layout, lists):
    """Function `relist(box, grid)`: grains near walls or the sphere, in order, with their history.

    To be called outside of the loops of a kernel. lists: WallLists or SphereLists. It has the
    number of its `bodies`, the place of its first block in `counts` (`begin`), the first contact of
    each body and chunk of grains (`chunk_first`), and the functions blocks(): of the lists before;
    body(n, box, grid): where a body is; is_near(grain, body); lay_out(): from numbers of contacts
    to the first ones; write(block, lane, grain, n, grid): the lane of a contact; slot(grain, n) and
    put_slot(grain, n, contact): number of a contact, -1 of none.
    """
    width, counts, history = layout.width, fields["counts"], HistoryRows(fields, layout)
    light, chunk_first, begin = is_short(fields["x"].shape[0]), lists.chunk_first, lists.begin
    chunk_room, blocks = -(-scratch["in_cell"].shape[0] // CHUNK), fields["contact"].shape[0]

    @ti.func
    def chunks():
        return loop_length(count_blocks(counts[GRAINS], CHUNK), chunk_room)

    @ti.func
    def carry(grain, n, contact, grid: ti.template()):
        block, lane, previous = (
            counts[begin] + contact // width,
            contact % width,
            lists.slot(grain, n),
        )
        lists.write(block, lane, grain, n, grid)
        if previous >= 0:
            previous += counts[begin] * width
        history.carry(block, lane, previous)

    @ti.func
    def near_body(item, box: ti.template(), grid: ti.template(), write: ti.template()):
        """Count or write the contacts of a chunk of grains with a body; item: number of both."""
        n, chunk, contact = item // chunks(), item % chunks(), 0
        entry, body = n * chunk_room + chunk, lists.body(n, box, grid)
        if ti.static(write):
            contact = chunk_first[entry]
        for grain in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, counts[GRAINS])):
            near = lists.is_near(grain, body)
            if ti.static(write):
                near = near and counts[OVERFLOW] == 0
                if near:
                    carry(grain, n, contact, grid)
                lists.put_slot(grain, n, ti.select(near, contact, -1))
            contact += ti.cast(near, ti.i32)
        if ti.static(not write):
            chunk_first[entry] = contact

    @ti.func
    def relist(box: ti.template(), grid: ti.template()):
        ti.loop_config(serialize=light)
        for block in range(loop_length(lists.blocks(), blocks)):
            if is_idle(block, lists.blocks()):
                continue
            history.put_aside(counts[begin] + block)
        ti.loop_config(serialize=light)
        for item in range(lists.bodies * chunks()):
            near_body(item, box, grid, False)
        lists.lay_out()
        ti.loop_config(serialize=light)
        for item in range(lists.bodies * chunks()):
            near_body(item, box, grid, True)

    return relist
