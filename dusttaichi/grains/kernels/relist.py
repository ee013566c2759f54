"""The lists that the steps use, from the neighbours that a search has found.

Pairs with their history, carried over exactly, and the contacts of every grain.
"""

from dusttaichi.compute.device_blocks import is_idle, loop_length, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, count_blocks, is_short
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
        self.width, self.real, self.mask = layout.width, layout.law, layout.mask

    @ti.func
    def put_aside(self, block):
        """The history of a block to where the new lists find it."""
        b = block & self.mask
        for n in range(self.rows):
            for k in range(self.width):
                self.load[b, n, k] = self.table[b, n, k]

    @ti.func
    def carry(self, block, k, previous):
        """History of lane k of a block: that of contact `previous`, nothing where that is -1."""
        b, slot = block & self.mask, ti.max(previous, 0)
        there, lane = (slot // self.width) & self.mask, slot % self.width
        for n in range(self.rows):
            value = self.load[there, n, lane]
            self.table[b, n, k] = ti.select(previous >= 0, value, ti.cast(0.0, self.real))

    @ti.func
    def clear(self, block, k):
        b = block & self.mask
        for n in range(self.rows):
            self.table[b, n, k] = 0.0


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
    def write(self, b, k, g, j, grid: ti.template()):
        """Lane k of block b is that of grain g and body j from now on."""
        self.pair_i[b, k], self.pair_j[b, k] = g, j
        if ti.static(self.polydisperse):
            self.write_constants(b, k, g, j)
        shifted = ti.cast(0.0, ti.f64)
        for m in ti.static(range(len(self.axes))):
            # from the last axis to the first: what a face across z adds along x is known then
            n = ti.static(len(self.axes) - 1 - m)
            a = ti.static(self.axes[n])
            way = self.x[g][a] - self.x[j][a]
            if ti.static(self.tilted and a == 0):
                way -= shifted
            turns = ti.floor(way / grid.edges[a] + 0.5)
            self.shift[b, n, k] = turns
            if ti.static(self.tilted and a == 2):
                shifted = turns * grid.tilt

    @ti.func
    def clear(self, b, k):
        """An empty lane: two grains that are far away."""
        self.pair_i[b, k], self.pair_j[b, k] = self.counts[GRAINS], self.counts[GRAINS] + 1
        if ti.static(self.polydisperse):
            self.write_empty(b, k)
        self.history.clear(b, k)
        for n in ti.static(range(len(self.axes))):
            self.shift[b, n, k] = 0.0


@ti.data_oriented
class PairLists:
    """Functions that write pairs, their history, and the entries of grains.

    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    further_lists: WallLists and SphereLists that the scene has.
    """

    def __init__(self, fields, scratch, layout, write_constants, further_lists):
        self.width, self.polydisperse, self.others = (
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
    def neighbour(self, g, k):
        """Number k of the neighbours of g."""
        out = 0
        if ti.static(self.polydisperse):
            out = self.near[self.near_start[g] + k]
        else:
            out = self.near[g * NEIGHBOURS + k]
        return out

    @ti.func
    def keep_old(self, block):
        """Entries are listed again after this: their places hold the old partners meanwhile."""
        b = block & self.history.mask
        self.history.put_aside(b)
        for k in range(self.width):
            self.entry[b * self.width + k] = self.pair_j[b, k]

    @ti.func
    def write_pairs(self, g, grid: ti.template()):
        c = self.pair_start[g]
        for n in range(self.near_count[g]):
            j = self.neighbour(g, n)
            if j > g:
                b, k = c // self.width, c % self.width
                self.lanes.write(b, k, g, j, grid)
                previous, end = self.old_start[g], self.old_start[g + 1]
                while previous < end and self.entry[previous] != j:
                    previous += 1
                self.history.carry(b, k, ti.select(previous < end, previous, -1))
                c += 1

    @ti.func
    def contact_of(self, g, j):
        """Number of the pair g < j."""
        c, k = self.pair_start[g], 0
        while k < self.near_count[g] and self.neighbour(g, k) != j:
            c += ti.cast(self.neighbour(g, k) > g, ti.i32)
            k += 1
        return ti.select(k < self.near_count[g], c, -1)

    @ti.func
    def count(self):
        """Number of grains."""
        return self.counts[GRAINS]

    @ti.func
    def entries(self, g, listing: ti.template()):
        """Length of the list of a grain's contacts, with the numbers that end its parts.

        It is written if `listing` (particles.lists).
        """
        n = 0
        for k in range(self.near_count[g] * ti.cast(self.counts[OVERFLOW] == 0, ti.i32)):
            j = self.neighbour(g, k)
            if j < g:
                if ti.static(listing):
                    self.entry[self.first[g] + n] = self.contact_of(j, g)
                n += 1
        n += self.put(g, n, -1, listing)
        for lists in ti.static(self.others):
            for k in range(lists.bodies):
                slot = lists.slot(g, k)
                if slot >= 0:
                    n += self.put(g, n, self.counts[lists.begin] * self.width + slot, listing)
        if ti.static(len(self.others) > 0):
            n += self.put(g, n, -1, listing)
        return n

    @ti.func
    def put(self, g, n, value, listing: ti.template()):
        """Write number n of the list of a grain if `listing`; returns 1."""
        if ti.static(listing):
            self.entry[self.first[g] + n] = value
        return 1


def make_relist(fields, scratch, layout, write_constants=None, further_lists=()):
    """Functions `relist(grid)`: pairs and their history, and `list_entries()`: contacts of grains.

    To be called outside of the loops of a kernel. write_constants, further_lists: see PairLists.
    """
    W, counts = layout.width, fields["counts"]
    old_start, pair_start = scratch["old_start"], fields["pair_start"]
    lists = PairLists(fields, scratch, layout, write_constants, further_lists)
    entries = Lists(lists, scratch["own_count"], scratch["chunk_sum"])
    room, blocks = scratch["in_cell"].shape[0], fields["pair_i"].shape[0]
    light, in_order = is_short(fields["x"].shape[0]), not on_device()

    @ti.func
    def old_blocks():
        return count_blocks(old_start[counts[GRAINS]], W)

    @ti.func
    def relist(grid: ti.template()):
        ti.loop_config(serialize=light)
        for b in range(loop_length(old_blocks(), blocks)):
            if is_idle(b, old_blocks()) or counts[OVERFLOW] > 0:
                continue
            lists.keep_old(b)
        ti.loop_config(serialize=light)
        for g in range(loop_length(counts[GRAINS], room)):
            if is_idle(g, counts[GRAINS]) or counts[OVERFLOW] > 0:
                continue
            lists.write_pairs(g, grid)
        ti.loop_config(serialize=in_order)
        for k in range(W * layout.tile):
            if counts[OVERFLOW] == 0:
                pairs, full = pair_start[counts[GRAINS]], W * layout.tile
                if k == 0:
                    counts[PAIRS] = pairs
                # one at least: a grain's pairs end where those of another begin
                if k == 0 or pairs + k < count_blocks(pairs, full) * full:
                    lists.lanes.clear((pairs + k) // W, (pairs + k) % W)

    return relist, entries.fill


def make_body_relist(fields, scratch, layout, lists):
    """Function `relist(box, grid)`: grains near walls or the sphere, in order, with their history.

    To be called outside of the loops of a kernel. lists: WallLists or SphereLists. It has the
    number of its `bodies`, the place of its first block in `counts` (`begin`), the first contact of
    each body and chunk of grains (`chunk_first`), and the functions blocks(): of the lists before;
    body(n, box, grid): where a body is; is_near(g, body); lay_out(): from numbers of contacts to
    the first ones; write(b, k, g, n, grid): the lane of a contact; slot(g, n) and put_slot(g, n,
    c): number of a contact, -1 of none.
    """
    W, counts, history = layout.width, fields["counts"], HistoryRows(fields, layout)
    light, chunk_first, begin = is_short(fields["x"].shape[0]), lists.chunk_first, lists.begin
    chunk_room, blocks = -(-scratch["in_cell"].shape[0] // CHUNK), fields["contact"].shape[0]

    @ti.func
    def chunks():
        return loop_length(count_blocks(counts[GRAINS], CHUNK), chunk_room)

    @ti.func
    def carry(g, n, c, grid: ti.template()):
        b, k, previous = counts[begin] + c // W, c % W, lists.slot(g, n)
        lists.write(b, k, g, n, grid)
        if previous >= 0:
            previous += counts[begin] * W
        history.carry(b, k, previous)

    @ti.func
    def near_body(q, box: ti.template(), grid: ti.template(), write: ti.template()):
        """Counts or writes the contacts of a chunk of grains with a body, number q of both."""
        n, chunk, c = q // chunks(), q % chunks(), 0
        entry, body = n * chunk_room + chunk, lists.body(n, box, grid)
        if ti.static(write):
            c = chunk_first[entry]
        for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, counts[GRAINS])):
            near = lists.is_near(g, body)
            if ti.static(write):
                near = near and counts[OVERFLOW] == 0
                if near:
                    carry(g, n, c, grid)
                lists.put_slot(g, n, ti.select(near, c, -1))
            c += ti.cast(near, ti.i32)
        if ti.static(not write):
            chunk_first[entry] = c

    @ti.func
    def relist(box: ti.template(), grid: ti.template()):
        ti.loop_config(serialize=light)
        for b in range(loop_length(lists.blocks(), blocks)):
            if is_idle(b, lists.blocks()):
                continue
            history.put_aside(counts[begin] + b)
        ti.loop_config(serialize=light)
        for q in range(lists.bodies * chunks()):
            near_body(q, box, grid, False)
        lists.lay_out()
        ti.loop_config(serialize=light)
        for q in range(lists.bodies * chunks()):
            near_body(q, box, grid, True)

    return relist
