"""Contacts that keep their two pointers (S12 sect. 2.1.3), on a wall one and the point where they
touched first: the form of double precision."""

import taichi as ti

from dusttaichi.grains.kernels.contacts import ROLLING, SumTables, step01
from dusttaichi.grains.kernels.pairs import PairPass
from dusttaichi.grains.kernels.walls import WallPass
from dusttaichi.physics.contact.limit import restoring


@ti.func
def roll(by: ti.template(), at: ti.template(), turn: ti.template(), p):
    """The pointers put back to the limit of rolling; what that costs goes into the ledger of the
    pass `by`. turn: n1, n2 (turned already), w1, w2.

    n_i <- n_i - alpha_i (xi - xi_c)/r_i moves xi by R/r1 + R/r2 = 1 times the excess, and
    r1 dn1 - r2 dn2 = 0: sliding sees nothing of it but what keeping the pointers at unit length
    does, tilt (n1 - n2). Returns n1, n2 and that factor.
    """
    n1, n2, tilt = turn.n1, turn.n2, 0.0 * turn.n1.x
    if ti.static(by.has_rolling):
        xi = by.laws.rolling.displacement(n1, n2, p)
        rate = turn.w1.cross(n1).plus(turn.w2.cross(n2)).times(p.R)
        past = by.laws.rolling.correct(xi, rate, p)
        by.lose(at.tile, ROLLING, at.weight * past.lost)
        a1, a2 = restoring(n1, xi, past.inverse), restoring(n2, xi, past.inverse)
        tilt = past.over * a1 * n1.dot(xi)
        n1 = n1.plus(xi.times(-past.over * p.inv_r1 * a1))
        n2 = n2.plus(xi.times(-past.over * p.inv_r2 * a2))
    return n1, n2, tilt


@ti.data_oriented
class PointerPairs(PairPass):
    """Pairs that keep n1 and n2."""

    def tables(self, fields, layout):
        self.face_work = fields.get("face_work")
        return SumTables(fields["loss"], fields.get("virial"))

    @ti.func
    def add_face_work(self, tile, value):
        self.face_work[tile] = self.face_work[tile] + value

    @ti.func
    def held(self, b):
        n1, n2 = self.get(b, self.FIRST), self.get(b, self.SECOND)
        return ti.Struct(n1=n1, n2=n2, was=step01(n1.dot(n1) - 0.5))

    @ti.func
    def ways(self, b, p, step, frame):
        d, dv, w1, w2 = self.gathered(b, frame)
        long = self.one(step)
        turn1, turn2 = w1.times(long), w2.times(long)
        square = d.dot(d)
        inv = 1.0 / ti.sqrt(square)
        nc = d.times(inv)
        # where v and w are: second order in dt
        back = d.minus(dv.times(0.5 * long)).times(inv + 0.5 * long * dv.dot(nc) * inv * inv)
        return ti.Struct(
            d=d, dv=dv, w1=w1, w2=w2, turn1=turn1, turn2=turn2, inv=inv, nc=nc, back=back,
            distance=square * inv,
        )  # fmt: skip

    @ti.func
    def speed(self, way: ti.template()):
        return way.dv.dot(way.back)

    @ti.func
    def overlap(self, way: ti.template(), p):
        return p.touch - way.distance

    @ti.func
    def speed_then(self, way: ti.template(), dt):
        then = way.d.minus(way.dv.times(dt))
        return way.dv.dot(then) / ti.sqrt(then.dot(then))

    @ti.func
    def slide(self, n1, n2, nc, p):
        """(zeta, (r1 n1 - r2 n2).n_c) of these pointers."""
        arm = n1.times(p.r1).minus(n2.times(p.r2))
        zeta = arm
        if ti.static(self.has_sliding):
            zeta = self.laws.sliding.displacement(arm, nc, p)
        return zeta, arm.dot(nc)

    @ti.func
    def limit(self, at: ti.template(), turn: ti.template(), way: ti.template(), p):
        """Pointers put back to the limits, of unit length.

        Sliding moves n_i by alpha_i (zeta - zeta_c)/(r1 + r2), so that r1 dn1 - r2 dn2 is the
        excess while rolling, R (dn1 + dn2), sees nothing of it. Rolling changes zeta at second
        order of the displacements, by `tilt` (n1 - n2): that goes into the loss of rolling.
        """
        m1, m2, tilt = roll(self, at, turn, p)
        if ti.static(self.has_sliding):
            n1, n2 = turn.n1, turn.n2
            zeta, _ = self.slide(n1, n2, way.nc, p)
            arm_rate = turn.w1.cross(n1).times(p.r1).minus(turn.w2.cross(n2).times(p.r2))
            rate = self.laws.sliding.displacement(arm_rate.plus(way.dv), way.nc, p)
            past = self.slip(at, zeta, rate, p)
            change = tilt * zeta.dot(n1.minus(n2)) * (1.0 - past.over)
            gone = self.laws.sliding.stiffness(zeta, p) * change
            self.lose(at.tile, ROLLING, -at.weight * gone)
            share = past.over * p.inv_touch
            m1 = m1.plus(zeta.times(-share * restoring(n1, zeta, past.inverse)))
            m2 = m2.plus(zeta.times(share * restoring(n2, zeta, past.inverse)))
        return m1.unit(), m2.unit()

    @ti.func
    def pose(self, at: ti.template(), held: ti.template(), way: ti.template(), p):
        turn = ti.Struct(
            n1=held.n1.turned(way.turn1), n2=held.n2.turned(way.turn2), w1=way.w1, w2=way.w2
        )
        n1, n2 = self.limit(at, turn, way, p)
        zeta, along = self.slide(n1, n2, way.nc, p)
        return ti.Struct(n1=n1, n2=n2, one=n1, two=n2, zeta=zeta, lean=along * way.inv)

    @ti.func
    def keep(self, b, on: ti.template(), way: ti.template(), pose: ti.template()):
        n1, n2 = pose.n1.times(on.kept), pose.n2.times(on.kept)
        self.put(self.state, b, self.FIRST, n1.minus(way.nc.times(on.formed)))
        self.put(self.state, b, self.SECOND, n2.plus(way.nc.times(on.formed)))


@ti.data_oriented
class PointerWalls(WallPass):
    """Contacts with walls that keep n1 and the foot, the point of the wall that they touched."""

    def tables(self, fields, layout):
        return SumTables(fields["wall_loss"], fields.get("wall_virial"))

    @ti.func
    def held(self, b):
        n1, foot = self.get(b, self.FIRST), self.get(b, self.SECOND)
        # the pointer of a lane that did not touch a step ago is zero
        return ti.Struct(n1=n1, foot=foot, was=step01(n1.dot(n1) - 0.5))

    @ti.func
    def slide(self, n1, foot, way: ti.template(), p):
        """zeta on a wall (S12 eq 24)."""
        zeta = way.place.plus(n1.times(p.r1)).minus(foot)
        if ti.static(self.has_sliding):
            zeta = self.laws.sliding.displacement(zeta, way.nw, p)
        return zeta

    @ti.func
    def pose(self, at: ti.template(), held: ti.template(), way: ti.template(), p):
        """Pointer and foot put back to the limits: the foot takes all of what slides (S12 eq 25).

        The foot goes with the pointer: rolling must not load the sliding spring.
        """
        turn = ti.Struct(n1=held.n1.turned(way.turn1), n2=way.nw, w1=way.w1, w2=way.w1.times(0.0))
        foot = held.foot
        if ti.static(self.has_sliding):
            zeta = self.slide(turn.n1, foot, way, p)
            arm_rate = way.dv.plus(turn.w1.cross(turn.n1).times(p.r1))
            rate = self.laws.sliding.displacement(arm_rate, way.nw, p)
            past = self.slip(at, zeta, rate, p)
            foot = foot.plus(zeta.times(past.over))
        n1, _n2, _tilt = roll(self, at, turn, p)
        n1 = n1.unit()
        foot = foot.plus(n1.minus(turn.n1).times(p.r1))
        zeta = self.slide(n1, foot, way, p)
        return ti.Struct(n1=n1, n2=way.nw, one=n1, two=way.nw, zeta=zeta, lean=-1.0, foot=foot)

    @ti.func
    def keep(self, b, on: ti.template(), way: ti.template(), pose: ti.template(), p):
        start = way.place.minus(way.nw.times(p.r1))
        n1, foot = pose.n1.times(on.kept), pose.foot.times(on.kept)
        self.put(self.state, b, self.FIRST, n1.minus(way.nw.times(on.formed)))
        self.put(self.state, b, self.SECOND, foot.plus(start.times(on.formed)))
