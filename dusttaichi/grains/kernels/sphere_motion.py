"""The rigid sphere among the grains: which grains are near it, the loads on it, how it moves.

It moves like a grain and is stored behind them in the fields of motion; its contacts are pairs (the
grain first) whose numbers differ from those of two grains, so that they have blocks of their own.
The search visits every grain: with cells as wide as the sphere a grid would exclude hardly any.
"""

from types import SimpleNamespace

from dusttaichi.compute.device_blocks import loop_length, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, count_blocks
from dusttaichi.grains.kernels.grain_cells import SPHERE_REACH
from dusttaichi.grains.kernels.outside_kick import OutsideKick
from dusttaichi.grains.kernels.relist import PairLanes
from dusttaichi.grains.kernels.store import FIRST_SPHERE, GRAINS, ON_SPHERE, SPHERE


def make_loads(fields, layout):
    """Functions `loads()` and `share(thread, threads)` of make_sphere."""
    width, counts, load = layout.width, fields["counts"], fields["load"]

    @ti.func
    def along(first, blocks, row: ti.template()):
        """Sum over all contacts of a row of their loads."""
        total = ti.cast(0.0, ti.f64)
        for b in range(first, first + blocks):
            for k in range(width):
                total += ti.cast(load[b, row, k], ti.f64)
        return total

    @ti.func
    def loads():
        first, n = counts[FIRST_SPHERE], count_blocks(counts[ON_SPHERE], width)
        force = ti.Vector([along(first, n, 0), along(first, n, 1), along(first, n, 2)])
        torque = ti.Vector([along(first, n, 6), along(first, n, 7), along(first, n, 8)])
        return -force, torque

    @ti.func
    def share(thread, threads):
        out, contacts = ti.Vector.zero(ti.f64, 6), counts[ON_SPHERE]
        for n in range(count_blocks(contacts, threads)):
            c = n * threads + thread
            if c < contacts:
                b, lane = counts[FIRST_SPHERE] + c // width, c % width
                for k in ti.static(range(3)):
                    out[k] -= ti.cast(load[b, k, lane], ti.f64)
                    out[3 + k] += ti.cast(load[b, 6 + k, lane], ti.f64)
        return out

    return loads, share


def make_sphere(fields, layout):
    """Functions for the rigid sphere: `loads` and `move`. None in a scene without one.

    `loads()`: force and torque of the grains on the sphere, summed in the order of the lanes;
    `move(dt, reach2, step)`: kick and drift, 1 if a search is due.
    For a block of threads: `share(thread, threads)`: force and torque of the contacts of one of
    them on the sphere; `put_load(k, total)`: number k of the sum over the block; `move_by_load(dt,
    reach2, step)`: kick and drift by these.
    """
    if not layout.sphere:
        return None
    counts, (loads, share_load) = fields["counts"], make_loads(fields, layout)
    x, v, w, x_search = fields["x"], fields["v"], fields["w"], fields["x_search"]
    body, impulse = fields["sphere_body"], fields["sphere_impulse"]
    dtype, forces = layout.geometry, OutsideKick(fields, layout)
    load = ti.field(ti.f64, shape=6) if on_device() else None

    @ti.func
    def put_load(k, total):
        if k < 6:
            load[k] = total

    @ti.func
    def move_by_load(dt, reach2, step):
        force = ti.Vector([load[0], load[1], load[2]])
        return kick_and_drift(dt, reach2, step, force, ti.Vector([load[3], load[4], load[5]]))

    @ti.func
    def move(dt, reach2, step):
        force, torque = loads()
        return kick_and_drift(dt, reach2, step, force, torque)

    @ti.func
    def kick_and_drift(dt, reach2, step, force, torque):
        sphere = counts[GRAINS] + SPHERE
        for component in ti.static(range(3)):
            impulse[component] = impulse[component] + dt * force[component]
            impulse[3 + component] = impulse[3 + component] + dt * torque[component]
        velocity = v[sphere] + ti.cast(dt * body[0] * force, dtype)
        spin = w[sphere] + ti.cast(dt * body[1] * torque, dtype)
        if ti.static(bool(layout.forces)):
            at, weight, half = forces.of_sphere(step), forces.weight_of_sphere(), 0.5 * dt
            kick, turn = half * body[0] * force, half * body[1] * torque
            velocity, spin = forces.accelerate(sphere, at, weight, velocity, spin, kick, turn, dt)
        position = x[sphere] + ti.cast(dt, dtype) * velocity
        v[sphere], x[sphere], w[sphere] = velocity, position, spin
        way = position - x_search[sphere]
        return ti.select(way.dot(way) <= reach2, 0, 1)

    of_block = {"share": share_load, "put_load": put_load, "move_by_load": move_by_load}
    return SimpleNamespace(loads=loads, move=move, **of_block)


@ti.data_oriented
class SphereLists:
    """Functions that find the grains near the sphere and write their lanes (make_body_relist).

    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    """

    bodies, begin = 1, FIRST_SPHERE

    def __init__(self, fields, scratch, layout, write_constants):
        writers = (getattr(write_constants, name, None) for name in ("sphere", "empty"))
        self.lanes, self.axes = PairLanes(fields, layout, *writers), layout.periodic
        self.width, self.full = layout.width, layout.width * layout.tile
        self.x, self.counts, self.of = fields["x"], fields["counts"], fields["sphere_slot"]
        self.x_search, self.radius = fields["x_search"], fields.get("radius")
        self.polydisperse, self.numbers = layout.polydisperse, scratch["grid"]
        self.chunk_first, self.scan = scratch["sphere_chunk"], Scan(scratch["chunk_sum"])
        self.in_order = not on_device()

    @ti.func
    def blocks(self):
        """Number of blocks of the lists before."""
        return count_blocks(self.counts[ON_SPHERE], self.width)

    @ti.func
    def body(self, n, box: ti.template(), grid: ti.template()):
        """Place of the sphere, edges of the cell, distance of the centres of a grain that is near.

        Of polydisperse grains less their radius.
        """
        position = self.x[self.counts[GRAINS] + SPHERE]
        return ti.Struct(place=position, edges=grid.edges, reach=self.numbers[SPHERE_REACH])

    @ti.func
    def is_near(self, g, sphere):
        d = self.x[g] - sphere.place
        for a in ti.static(self.axes):
            d[a] -= ti.floor(d[a] / sphere.edges[a] + 0.5) * sphere.edges[a]
        far = sphere.reach
        if ti.static(self.polydisperse):
            far += self.radius[g]
        return d.dot(d) < far * far

    @ti.func
    def slot(self, g, n):
        return self.of[g]

    @ti.func
    def put_slot(self, g, n, c):
        self.of[g] = c

    @ti.func
    def write(self, b, k, g, n, grid: ti.template()):
        self.lanes.write(b, k, g, self.counts[GRAINS] + SPHERE, grid)

    @ti.func
    def lay_out(self):
        """Find the first lane of each chunk, and clear those behind the last one.

        To be called outside of the loops of a kernel.
        """
        entries = ti.static(self.chunk_first.shape[0] - 1)
        end = loop_length(count_blocks(self.counts[GRAINS], CHUNK), entries)
        self.scan.exclusive(self.chunk_first, self.chunk_first, end + 1)
        ti.loop_config(serialize=self.in_order)
        for k in range(self.full):
            contacts = self.chunk_first[count_blocks(self.counts[GRAINS], CHUNK)]
            if k == 0:
                sphere = self.counts[GRAINS] + SPHERE
                self.x_search[sphere], self.counts[ON_SPHERE] = self.x[sphere], contacts
            if contacts + k < count_blocks(contacts, self.full) * self.full:
                contact = self.counts[FIRST_SPHERE] * self.width + contacts + k
                self.lanes.clear(contact // self.width, contact % self.width)
