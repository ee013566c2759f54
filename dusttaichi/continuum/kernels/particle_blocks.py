"""Blocks of particles, which share a list of neighbours.

The passes go through the list of a block once: what belongs to a neighbour is read once for all
particles of the block, and the processor computes these together, as the lanes of a vector. For
that the loop over the lanes is the innermost, without branches, and numbers of the particles are in
local arrays, number c of lane l in place c lanes + l. A neighbour out of reach of one of them has
the weight 0 there. On a device a block is one particle.
"""

from dusttaichi.compute.engine import ti


@ti.data_oriented
class Blocks:
    """fields, lists: see store.place; layout: store.Layout; near: lists.Neighbours."""

    def __init__(self, fields, lists, layout, near):
        self.f, self.lists, self.layout, self.near = fields, lists, layout, near
        self.n, self.lanes = layout.dimension, layout.lanes
        self.resisting = (fields.alpha, fields.beta, fields.impedance, fields.density)

    @ti.func
    def count(self, numbers: ti.template()):
        """Number of blocks."""
        return (numbers.count + self.lanes - 1) // self.lanes

    @ti.func
    def particle(self, block, lane, numbers: ti.template()):
        """Particle of a lane; behind the last particle, that one again."""
        return ti.min(block * self.lanes + lane, numbers.count - 1)

    @ti.func
    def width(self, numbers: ti.template()):
        """Length of a loop over the lanes; in the plane LLVM does not know it.

        Short loops it unrolls, and finds fewer vectors in some. In space it finds all, and keeps
        their sums in registers.
        """
        return (
            ti.static(self.lanes) if ti.static(self.n == 3) else ti.min(self.lanes, numbers.count)
        )

    @ti.func
    def is_open(self, i):
        """1 where the contact of particle i is open."""
        out = 0.0
        if ti.static(self.layout.separate):
            out = ti.select(self.f.gap[i] >= 0.0, 1.0, 0.0)
        return out

    @ti.func
    def place_lanes(self, block, numbers: ti.template()):
        """Variables of the particles of a block that their pairs need, lane by lane.

        motion: place and velocity; resisting: see `Forces.resist`; side: to which body it belongs;
        opened: 1 of open contacts; face: see planes.place_lanes.
        """
        n, lanes = ti.static(self.n, self.lanes)
        block_lanes = ti.Struct(
            motion=ti.Vector.zero(ti.f64, ti.static(2 * n * lanes)),
            resisting=ti.Vector.zero(ti.f64, ti.static(4 * lanes)),
            side=ti.Vector.zero(ti.i32, lanes),
            opened=ti.Vector.zero(ti.f64, lanes),
            face=ti.Vector.zero(ti.f64, ti.static(2 * lanes)),
        )
        for lane in range(lanes):
            i = self.particle(block, lane, numbers)
            for a in ti.static(range(n)):
                block_lanes.motion[a * lanes + lane] = self.f.x[i][a]
                block_lanes.motion[(n + a) * lanes + lane] = self.f.v[i][a]
            if ti.static(self.layout.viscous):
                for c, values in ti.static(enumerate(self.resisting)):
                    block_lanes.resisting[c * lanes + lane] = values[i]
            if ti.static(self.layout.separate or self.layout.viscous):
                block_lanes.side[lane], block_lanes.opened[lane] = self.f.side[i], self.is_open(i)
        return block_lanes

    @ti.func
    def apart(self, lane, motion: ti.template(), x, v):
        """Place and velocity of a lane less x and v; motion: those of all lanes."""
        n, lanes = ti.static(self.n, self.lanes)
        d = ti.Vector([motion[a * lanes + lane] - x[a] for a in ti.static(range(n))])
        u = ti.Vector([motion[(n + a) * lanes + lane] - v[a] for a in ti.static(range(n))])
        return d, u

    @ti.func
    def begin(self, i):
        """First entry of the near neighbours of particle i in `near`."""
        return self.lists.first[i // self.lanes]

    @ti.func
    def end(self, i):
        """The entry behind the last one of them."""
        return self.begin(i) + self.lists.near_counts[i // self.lanes]

    @ti.func
    def find_neighbours(self, block, numbers: ti.template()):
        """Select the listed neighbours of a block within reach of the kernel."""
        x = ti.Vector.zero(ti.f64, ti.static(self.n * self.lanes))
        self.near.place_lanes(block, numbers.count, x)
        begin, reach2 = self.lists.first[block], 4.0 * numbers.h * numbers.h
        slot = begin
        for k in range(begin, self.lists.first[block + 1]):
            j = self.lists.entry[k]
            # one out of reach is overwritten by the next: no unpredictable branch
            self.lists.near[slot] = j
            slot += ti.min(self.near.in_reach(x, j, reach2), 1)
        self.lists.near_counts[block] = slot - begin
