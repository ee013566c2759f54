"""The rigid sphere among the grains: which grains are near it, the loads on it, how it moves.

It moves like a grain and stands behind them in the fields of motion; its contacts are pairs (the
grain first) whose numbers differ from those of two grains, so that they have blocks of their own.
The search looks at every grain: a grid with cells as wide as the sphere would be none.
"""

from types import SimpleNamespace

from dusttaichi.compute.blocks import is_idle, loop_length, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, is_short, whole
from dusttaichi.grains.kernels.grains import make_gravity
from dusttaichi.grains.kernels.relist import HistoryRows
from dusttaichi.grains.kernels.store import FIRST_SPHERE, GRAINS, ON_SPHERE, SPHERE


def make_loads(fields, layout):
    """Functions `loads()` and `share(thread, threads)` of make_sphere."""
    W, counts, load = layout.width, fields["counts"], fields["load"]

    @ti.func
    def along(first, blocks, row: ti.template()):
        """Sum over all contacts of a row of their loads."""
        total = ti.cast(0.0, ti.f64)
        for b in range(first, first + blocks):
            for k in range(W):
                total += ti.cast(load[b, row, k], ti.f64)
        return total

    @ti.func
    def loads():
        first, n = counts[FIRST_SPHERE], whole(counts[ON_SPHERE], W)
        force = ti.Vector([along(first, n, 0), along(first, n, 1), along(first, n, 2)])
        torque = ti.Vector([along(first, n, 6), along(first, n, 7), along(first, n, 8)])
        return -force, torque

    @ti.func
    def share(thread, threads):
        out, contacts = ti.Vector.zero(ti.f64, 6), counts[ON_SPHERE]
        for n in range(whole(contacts, threads)):
            c = n * threads + thread
            if c < contacts:
                b, lane = counts[FIRST_SPHERE] + c // W, c % W
                for k in ti.static(range(3)):
                    out[k] -= ti.cast(load[b, k, lane], ti.f64)
                    out[3 + k] += ti.cast(load[b, 6 + k, lane], ti.f64)
        return out

    return loads, share


def make_sphere(fields, layout):
    """Functions for the rigid sphere: `tiles`, `loads` and `move`. None in a scene without one.

    `tiles()`: number of tiles of contacts; `loads()`: force and torque of the grains on the sphere,
    summed in the order of the lanes; `move(dt, reach2)`: kick and drift, 1 if a new search is due.
    For a block of threads: `share(thread, threads)`: force and torque of the contacts of one of
    them on the sphere; `put_load(k, total)`: number k of the sum over the block; `move_by_load(dt,
    reach2)`: kick and drift by these.
    """
    if not layout.sphere:
        return None
    W, counts, (loads, share) = layout.width, fields["counts"], make_loads(fields, layout)
    x, v, w, x_search = fields["x"], fields["v"], fields["w"], fields["x_search"]
    body, impulse = fields["sphere_body"], fields["sphere_impulse"]
    real, falls = layout.geometry, make_gravity(fields, layout)
    load = ti.field(ti.f64, shape=6) if on_device() else None

    @ti.func
    def tiles():
        return whole(counts[ON_SPHERE], W * layout.tile)

    @ti.func
    def put_load(k, total):
        if k < 6:
            load[k] = total

    @ti.func
    def move_by_load(dt, reach2):
        force = ti.Vector([load[0], load[1], load[2]])
        return moved(dt, reach2, force, ti.Vector([load[3], load[4], load[5]]))

    @ti.func
    def move(dt, reach2):
        force, torque = loads()
        return moved(dt, reach2, force, torque)

    @ti.func
    def moved(dt, reach2, force, torque):
        s = counts[GRAINS] + SPHERE
        for k in ti.static(range(3)):
            impulse[k] = impulse[k] + dt * force[k]
            impulse[3 + k] = impulse[3 + k] + dt * torque[k]
        velocity = v[s] + ti.cast(dt * body[0] * force, real)
        if ti.static(layout.falls):
            velocity += ti.cast(ti.select(body[0] > 0.0, dt, 0.0), real) * falls(s)
        place = x[s] + ti.cast(dt, real) * velocity
        v[s], x[s] = velocity, place
        w[s] = w[s] + ti.cast(dt * body[1] * torque, real)
        way = place - x_search[s]
        return ti.select(way.dot(way) <= reach2, 0, 1)

    of_block = {"share": share, "put_load": put_load, "move_by_load": move_by_load}
    return SimpleNamespace(tiles=tiles, loads=loads, move=move, **of_block)


@ti.data_oriented
class SphereLists:
    """Functions that find the grains near the sphere and write their lanes.

    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    """

    def __init__(self, fields, layout, write_constants):
        self.width, self.axes = layout.width, layout.periodic
        self.polydisperse, self.history = layout.polydisperse, HistoryRows(fields, layout)
        self.x, self.counts, self.slot = fields["x"], fields["counts"], fields["sphere_slot"]
        self.pair_i, self.pair_j = fields["pair_i"], fields["pair_j"]
        self.shift, self.radius = fields.get("shift"), fields.get("radius")
        self.write = write_constants

    @ti.func
    def edges_between(self, g, s, edges, a: ti.template()):
        """Edges of the periodic cell between a grain and the sphere along an axis."""
        return ti.floor((self.x[g][a] - self.x[s][a]) / edges[a] + 0.5)

    @ti.func
    def is_near(self, g, s, edges, reach):
        d = self.x[g] - self.x[s]
        for a in ti.static(self.axes):
            d[a] -= self.edges_between(g, s, edges, a) * edges[a]
        far = reach
        if ti.static(self.polydisperse):
            far += self.radius[g]
        return d.dot(d) < far * far

    @ti.func
    def write_contact(self, g, s, c, edges):
        b, k = self.counts[FIRST_SPHERE] + c // self.width, c % self.width
        self.pair_i[b, k], self.pair_j[b, k] = g, s
        if ti.static(self.polydisperse):
            self.write.sphere(b, k, g, s)
        for n in ti.static(range(len(self.axes))):
            self.shift[b, n, k] = self.edges_between(g, s, edges, ti.static(self.axes[n]))
        old = self.slot[g]
        if old >= 0:
            old += self.counts[FIRST_SPHERE] * self.width
        self.history.carry(b, k, old)

    @ti.func
    def clear_lane(self, c):
        b, k = self.counts[FIRST_SPHERE] + c // self.width, c % self.width
        self.pair_i[b, k], self.pair_j[b, k] = self.counts[GRAINS], self.counts[GRAINS] + 1
        if ti.static(self.polydisperse):
            self.write.empty(b, k)
        self.history.clear(b, k)
        for n in ti.static(range(len(self.axes))):
            self.shift[b, n, k] = 0.0


def make_sphere_relist(fields, scratch, layout, write_constants=None):
    """Kernel `relist_sphere(reach, edges)`: the grains near the sphere, in order, with history.

    reach: distance of the centres within which a grain is listed, of polydisperse grains less their
    radius. edges: of the periodic cell.
    """
    W, full = layout.width, layout.width * layout.tile
    counts, slot = fields["counts"], fields["sphere_slot"]
    x, x_search, chunk_first = fields["x"], fields["x_search"], scratch["sphere_chunk"]
    lists, scan = SphereLists(fields, layout, write_constants), Scan(scratch["chunk_sum"])
    chunk_room, blocks = chunk_first.shape[0] - 1, fields["pair_i"].shape[0]
    light, in_order = is_short(x.shape[0]), not on_device()

    @ti.func
    def chunks():
        return loop_length(whole(counts[GRAINS], CHUNK), chunk_room)

    @ti.func
    def old_blocks():
        return whole(counts[ON_SPHERE], W)

    @ti.func
    def near_sphere(chunk, reach, edges, write: ti.template()):
        """Counts or writes the contacts of a chunk of grains."""
        s, c = counts[GRAINS] + SPHERE, 0
        if ti.static(write):
            c = chunk_first[chunk]
        for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, counts[GRAINS])):
            near = lists.is_near(g, s, edges, reach)
            if ti.static(write):
                if near:
                    lists.write_contact(g, s, c, edges)
                slot[g] = ti.select(near, c, -1)
            c += ti.cast(near, ti.i32)
        if ti.static(not write):
            chunk_first[chunk] = c

    @ti.kernel
    def relist_sphere(reach: ti.f64, edges: ti.types.vector(3, ti.f64)):
        ti.loop_config(serialize=light)
        for b in range(loop_length(old_blocks(), blocks)):
            if is_idle(b, old_blocks()):
                continue
            lists.history.put_aside(counts[FIRST_SPHERE] + b)
        ti.loop_config(serialize=light)
        for chunk in range(chunks()):
            near_sphere(chunk, reach, edges, False)
        scan.exclusive(chunk_first, chunk_first, chunks() + 1)
        ti.loop_config(serialize=in_order)
        for k in range(full):
            lanes = chunk_first[whole(counts[GRAINS], CHUNK)]
            if k == 0:
                x_search[counts[GRAINS] + SPHERE] = x[counts[GRAINS] + SPHERE]
                counts[ON_SPHERE] = lanes
            if lanes + k < whole(lanes, full) * full:
                lists.clear_lane(lanes + k)
        ti.loop_config(serialize=light)
        for chunk in range(chunks()):
            near_sphere(chunk, reach, edges, True)

    return relist_sphere
