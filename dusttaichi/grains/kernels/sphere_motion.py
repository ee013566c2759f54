"""The rigid sphere among the grains: which grains are near it, the loads on it, how it moves.

It moves like a grain and is stored behind them in the fields of motion; its contacts are pairs (the
grain first) whose numbers differ from those of two grains, so that they have blocks of their own.
The search visits every grain: with cells as wide as the sphere a grid would exclude hardly any.
"""

from dusttaichi.compute.device_blocks import loop_length, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, count_blocks
from dusttaichi.grains.kernels.grain_cells import SPHERE_REACH
from dusttaichi.grains.kernels.outside_kick import OutsideKick
from dusttaichi.grains.kernels.relist import PairLanes
from dusttaichi.grains.kernels.store import FIRST_SPHERE, GRAINS, ON_SPHERE, SPHERE


@ti.data_oriented
class SphereMotion:
    """Kick and drift of the rigid sphere by the loads of the grains on it.

    A block of threads of a device sums these loads before: each thread those of some contacts.
    """

    def __init__(self, fields, layout):
        self.width, self.counts, self.load = layout.width, fields["counts"], fields["load"]
        self.x, self.v, self.w = fields["x"], fields["v"], fields["w"]
        self.x_search, self.dtype = fields["x_search"], layout.geometry
        self.body, self.impulse = fields["sphere_body"], fields["sphere_impulse"]
        self.forced, self.outside = bool(layout.forces), OutsideKick(fields, layout)
        self.block_load = ti.field(ti.f64, shape=6) if on_device() else None

    @ti.func
    def row_sum(self, first, blocks, row: ti.template()):
        """Sum over all contacts of a row of their loads."""
        total = ti.cast(0.0, ti.f64)
        for b in range(first, first + blocks):
            for k in range(self.width):
                total += ti.cast(self.load[b, row, k], ti.f64)
        return total

    @ti.func
    def loads(self):
        """Force and torque of the grains on the sphere, summed in the order of the lanes."""
        first, n = self.counts[FIRST_SPHERE], count_blocks(self.counts[ON_SPHERE], self.width)
        force = ti.Vector([self.row_sum(first, n, k) for k in ti.static(range(3))])
        torque = ti.Vector([self.row_sum(first, n, 6 + k) for k in ti.static(range(3))])
        return -force, torque

    @ti.func
    def loads_of_thread(self, thread, threads):
        """Force and torque on the sphere of the contacts of one of a block of threads."""
        out, contacts = ti.Vector.zero(ti.f64, 6), self.counts[ON_SPHERE]
        for n in range(count_blocks(contacts, threads)):
            contact = n * threads + thread
            if contact < contacts:
                block = self.counts[FIRST_SPHERE] + contact // self.width
                lane = contact % self.width
                for k in ti.static(range(3)):
                    out[k] -= ti.cast(self.load[block, k, lane], ti.f64)
                    out[3 + k] += ti.cast(self.load[block, 6 + k, lane], ti.f64)
        return out

    @ti.func
    def put_load(self, k, total):
        """Store number k of the sum over a block of threads."""
        if k < 6:
            self.block_load[k] = total

    @ti.func
    def move_by_load(self, dt, reach2, step):
        """`move` by the sum over a block of threads."""
        force, torque = ti.Vector.zero(ti.f64, 3), ti.Vector.zero(ti.f64, 3)
        for k in ti.static(range(3)):
            force[k], torque[k] = self.block_load[k], self.block_load[3 + k]
        return self.kick_and_drift(dt, reach2, step, force, torque)

    @ti.func
    def move(self, dt, reach2, step):
        """Kick and drift from a step to the next; 1 if a search is due."""
        force, torque = self.loads()
        return self.kick_and_drift(dt, reach2, step, force, torque)

    @ti.func
    def kick_and_drift(self, dt, reach2, step, force, torque):
        sphere = self.counts[GRAINS] + SPHERE
        for k in ti.static(range(3)):
            self.impulse[k] = self.impulse[k] + dt * force[k]
            self.impulse[3 + k] = self.impulse[3 + k] + dt * torque[k]
        velocity = self.v[sphere] + ti.cast(dt * self.body[0] * force, self.dtype)
        spin = self.w[sphere] + ti.cast(dt * self.body[1] * torque, self.dtype)
        if ti.static(self.forced):
            at, weight = self.outside.of_sphere(step), self.outside.weight_of_sphere()
            half = 0.5 * dt
            kick, turn = half * self.body[0] * force, half * self.body[1] * torque
            velocity, spin = self.outside.accelerate(
                sphere, at, weight, velocity, spin, kick, turn, dt
            )
        position = self.x[sphere] + ti.cast(dt, self.dtype) * velocity
        self.v[sphere], self.x[sphere], self.w[sphere] = velocity, position, spin
        way = position - self.x_search[sphere]
        return ti.select(way.dot(way) <= reach2, 0, 1)


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
