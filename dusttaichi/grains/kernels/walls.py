"""One pass over the contacts between grains and walls, a block (of one wall) at a time."""

import taichi as ti

from dusttaichi.grains.kernels.contacts import BREAKING, ContactPass, add_to, step01
from dusttaichi.grains.kernels.store import FIRST_WALL

Walls = ti.types.struct(
    normal=ti.types.matrix(6, 3, ti.f64),  # unit normals, into the sample
    offset=ti.types.vector(6, ti.f64),  # plane: x.n = offset + speed t
    speed=ti.types.vector(6, ti.f64),  # along the normal
    strength=ti.types.vector(6, ti.f64),  # of rolling, sliding, twisting
)


@ti.data_oriented
class WallPass(ContactPass):
    """`block(c, tile, plane, p, step)` updates block c of wall contacts and the sums of its tile.

    c counts wall blocks; their state and loads stand behind those of the pairs.
    plane: the struct that `plane` returns. p: the numbers of the contacts. step: the time step.
    """

    def __init__(self, fields, layout, laws):
        loss, virial = fields["wall_loss"], fields.get("wall_virial")
        super().__init__(fields, layout, laws, loss=loss, virial=virial)
        self.counts = fields["counts"]
        self.grain, self.gap, self.of = fields["wall_grain"], fields["wall_gap"], fields["wall_of"]
        self.impulse = fields["impulse"]

    @ti.func
    def plane(self, c, box, time):
        """Of the wall of block c: unit normal (a lane each), offset at `time`, speed, strength."""
        k = self.of[c]
        one = ti.cast(1.0 + 0.0 * self.gap[c], self.geometry)
        normal = self.V3(one * box.normal[k, 0], one * box.normal[k, 1], one * box.normal[k, 2])
        offset = box.offset[k] + box.speed[k] * time
        return ti.Struct(nw=normal, offset=offset, speed=box.speed[k], strength=box.strength[k])

    @ti.func
    def slide(self, n1, foot, place, nw, p):
        """zeta on a wall (S12 eq 24)."""
        zeta = place.plus(n1.times(p.r1)).minus(foot)
        if ti.static(self.has_sliding):
            zeta = self.laws.sliding.displacement(zeta, nw, p)
        return zeta

    @ti.func
    def limit(self, at: ti.template(), turn: ti.template(), way: ti.template(), p):
        """Pointer and foot put back to the limits: the foot takes all of what slides (S12 eq 25).

        The foot goes with the pointer: rolling must not load the sliding spring.
        """
        foot = way.foot
        if ti.static(self.has_sliding):
            zeta = self.slide(turn.n1, foot, way.place, turn.n2, p)
            arm_rate = way.dv.plus(turn.w1.cross(turn.n1).times(p.r1))
            rate = self.laws.sliding.displacement(arm_rate, turn.n2, p)
            past = self.slip(at, zeta, rate, p)
            foot = foot.plus(zeta.times(past.over))
        n1, _n2, _tilt = self.roll(at, turn, p)
        n1 = n1.unit()
        return n1, foot.plus(n1.minus(turn.n1).times(p.r1))

    @ti.func
    def block(self, c, tile, plane: ti.template(), p, step):
        b, i, nw = self.counts[FIRST_WALL] + c, self.grain[c], plane.nw
        place, w1 = self.gather(self.x, i), self.gather(self.w, i)
        dt, long = self.law(step), ti.cast(step, self.geometry)
        distance = place.dot(nw) - plane.offset + self.gap[c]
        dv = self.gather(self.v, i).minus(nw.times(plane.speed))
        u = self.law(dv.dot(nw))
        n1, foot = self.get(b, self.N1), self.get(b, self.N2)
        was = self.law(step01(n1.dot(n1) - 0.5))
        # the pointer of a lane that did not touch a step ago is zero: weight masks its springs
        at = ti.Struct(
            b=b, tile=tile, dt=dt, overlap=self.law(p.touch - distance), u=u, u_now=u, u_then=u,
            was=was, weight=self.law(was * plane.strength),
        )  # fmt: skip
        on = self.touch(at, p)
        push = self.push(at, on, p)

        turn1 = w1.times(long)
        turn = ti.Struct(n1=n1.turned(turn1), n2=nw, w1=w1, w2=w1.times(0.0))
        way = ti.Struct(foot=foot, place=place, dv=dv)
        turn.n1, foot = self.limit(at, turn, way, p)
        start = place.minus(nw.times(p.r1))
        self.put(self.state, b, self.N1, turn.n1.times(on.kept).minus(nw.times(on.formed)))
        self.put(self.state, b, self.N2, foot.times(on.kept).plus(start.times(on.formed)))

        zeta = self.slide(turn.n1, foot, place, nw, p)
        found = self.springs(turn, zeta, -1.0, p)
        if ti.static(self.has_twisting):
            axial, stored = self.twist(at, on, turn1.dot(nw), w1.dot(nw), p)
            found.torque1 = found.torque1.plus(self.law3(nw).times(axial))
            found.stored += stored
        # a spring that breaks has worked for half a step less than its displacement says
        work = self.law(dt * found.force.dot(dv) + found.torque1.dot(turn1))
        lost = on.broken * plane.strength * (found.stored + 0.5 * work)
        self.lose(tile, BREAKING, lost)
        weight = self.law(on.kept * plane.strength)
        force = self.law3(nw).times(push).plus(found.force.times(weight))
        self.put(self.load, b, 0, force)
        self.put(self.load, b, 3, found.torque1.times(weight))
        add_to(self.impulse, c, 0, step * force.x)
        add_to(self.impulse, c, 1, step * force.y)
        add_to(self.impulse, c, 2, step * force.z)
        if ti.static(self.stress):
            self.add_virial(tile, nw.times(distance), force, step)
