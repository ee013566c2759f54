"""One pass over the contacts between grains and walls, a block (of one wall) at a time."""

import taichi as ti

from dusttaichi.grains.kernels.contacts import BREAKING, ContactPass, add_to
from dusttaichi.grains.kernels.store import FIRST_WALL
from dusttaichi.names import WALLS

Walls = ti.types.struct(
    normal=ti.types.matrix(6, 3, ti.f64),  # unit normals, into the sample
    offset=ti.types.vector(6, ti.f64),  # plane: x.n = offset + speed t
    speed=ti.types.vector(6, ti.f64),  # along the normal
    strength=ti.types.vector(6, ti.f64),  # of rolling, sliding, twisting
    slid=ti.f64,  # the top wall has gone along x by slid + along time
    along=ti.f64,
)

TOP = WALLS.index("top")


@ti.data_oriented
class WallPass(ContactPass):
    """`block(c, tile, plane, p, step)` updates block c of wall contacts and the sums of its tile.

    c counts wall blocks; their state and loads stand behind those of the pairs.
    plane: the struct that `plane` returns. p: the numbers of the contacts. step: the time step.

    Like PairPass, with held(b), pose(at, held, way, p), keep(b, on, way, pose, p), tables(fields,
    layout) of kernels.pointers or kernels.deviations; way: place, dv, w1, turn1, nw, distance.
    """

    def __init__(self, fields, layout, laws):
        super().__init__(fields, layout, laws, self.tables(fields, layout))
        self.counts = fields["counts"]
        self.grain, self.gap, self.of = fields["wall_grain"], fields["wall_gap"], fields["wall_of"]
        self.impulse, self.geometry = fields["impulse"], layout.geometry

    @ti.func
    def plane(self, c, box, time):
        """Of the wall of block c: unit normal (a lane each), offset at `time`, speed, strength, how
        far it has gone along itself and how fast it does."""
        k = self.of[c]
        one = ti.cast(1.0 + 0.0 * self.gap[c], self.geometry)
        normal = self.Wide(one * box.normal[k, 0], one * box.normal[k, 1], one * box.normal[k, 2])
        slid, along = self.lateral(k, box, time)
        return ti.Struct(
            nw=normal, offset=box.offset[k] + box.speed[k] * time, speed=box.speed[k],
            strength=box.strength[k], slid=self.Wide(one * slid, 0.0 * one, 0.0 * one),
            along=self.Wide(one * along, 0.0 * one, 0.0 * one),
        )  # fmt: skip

    @ti.func
    def lateral(self, k, box: ti.template(), time):
        """How far wall k has gone along x, and how fast it does."""
        slid, along = ti.cast(0.0, self.geometry), ti.cast(0.0, self.geometry)
        if k == TOP:
            slid = ti.cast(box.slid + box.along * time, self.geometry)
            along = ti.cast(box.along, self.geometry)
        return slid, along

    @ti.func
    def ways(self, c, plane: ti.template(), step):
        """Where the grains are and how they move, in the precision of the laws; on a wall n_c is
        its normal nw."""
        i = self.grain[c]
        # foot points stand where they do on the wall, wherever it has gone along itself
        place, w1 = self.gather(self.x, i).minus(plane.slid), self.three(self.gather(self.w, i))
        distance = place.dot(plane.nw) - plane.offset + self.gap[c]
        speed = plane.nw.times(plane.speed).plus(plane.along)
        dv = self.three(self.gather(self.v, i).minus(speed))
        return ti.Struct(
            place=self.three(place), dv=dv, w1=w1, turn1=w1.times(self.one(step)),
            nw=self.three(plane.nw), distance=distance,
        )  # fmt: skip

    @ti.func
    def block(self, c, tile, plane: ti.template(), p, step):
        b, dt = self.counts[FIRST_WALL] + c, self.one(step)
        way, strength = self.ways(c, plane, step), self.one(plane.strength)
        u, held = way.dv.dot(way.nw), self.held(b)
        # weight masks the springs of lanes that did not touch a step ago
        at = ti.Struct(
            b=b, tile=tile, dt=dt, overlap=self.one(p.touch - way.distance), u=u, u_now=u, u_then=u,
            was=held.was, weight=held.was * strength,
        )  # fmt: skip
        on = self.touch(at, p)
        push = self.push(at, on, p)

        pose = self.pose(at, held, way, p)
        self.keep(b, on, way, pose, p)
        found = self.springs(pose, p)
        if ti.static(self.has_twisting):
            axial, stored = self.twist(at, on, way.turn1.dot(way.nw), way.w1.dot(way.nw), p)
            found.torque1 = found.torque1.plus(way.nw.times(axial))
            found.stored += stored
        # a spring that breaks has worked for half a step less than its displacement says
        work = dt * found.force.dot(way.dv) + found.torque1.dot(way.turn1)
        self.lose(tile, BREAKING, on.broken * strength * (found.stored + 0.5 * work))
        weight = on.kept * strength
        force = way.nw.times(push).plus(found.force.times(weight))
        self.put(self.load, b, 0, force)
        self.put(self.load, b, 3, found.torque1.times(weight))
        if ti.static(self.stress):
            self.add_virial(tile, way.nw.times(self.one(way.distance)), force, dt)

    @ti.func
    def add_impulse(self, c, step):
        """Sum the force on a block over time, once its loads are there."""
        b = self.counts[FIRST_WALL] + c
        for a in ti.static(range(3)):
            add_to(self.impulse, c, a, step * self.load[b, a])
