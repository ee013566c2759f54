"""Contacts that keep by what their pointers deviate from the line of centres, and on a wall zeta:
the form of mixed precision (physics.contact.deviation).

Positions, velocities and spins are in double precision, and so are the few differences of them that
cancel; the rest is in single. Losses and stresses of a step are added up for a tile in single
precision and then, once a step, to the sums in double: what a compiler makes of a block is as wide
as the widest numbers that it stores.
"""

import taichi as ti

from dusttaichi.grains.kernels.contacts import ROLLING, SumTables, add_to
from dusttaichi.grains.kernels.pairs import PairPass
from dusttaichi.grains.kernels.walls import WallPass
from dusttaichi.physics.contact.deviation import across, rotation, separation, shortfall


@ti.func
def roll(by: ti.template(), at: ti.template(), pose: ti.template(), way: ti.template(), p):
    """How far rolling is past its limit; what that costs goes into the ledger of the pass `by`.

    pose: deviations e1, e2 and pointers n1, n2. Returns the parts of e1 and e2 to take away.
    """
    off1 = pose.e1.times(0.0 * p.inv_r1)
    off2 = off1
    if ti.static(by.has_rolling):
        xi = by.laws.rolling.displacement(pose.e1, pose.e2, p)
        rate = way.w1.cross(pose.n1).plus(way.w2.cross(pose.n2)).times(p.R)
        past = by.laws.rolling.correct(xi, rate, p)
        by.lose(at.tile, ROLLING, at.weight * past.lost)
        off1, off2 = xi.times(past.over * p.inv_r1), xi.times(past.over * p.inv_r2)
    return off1, off2


@ti.data_oriented
class TileSums:
    """A pass whose sums of a tile and step stand in single precision, in columns of one table.

    where: of the names of its tables, "" of pairs, "wall_" of walls.
    """

    where = ""

    def tables(self, fields, layout):
        self.columns, self.TOUCHED = layout.tile_columns, layout.touched
        self.channels, first = len(layout.channels) * layout.ledger, len(layout.channels)
        self.FACES = first + 9 * layout.stress
        self.across = bool(layout.periodic and not self.where)
        self.total_loss = fields[self.where + "loss"]
        self.total_virial = fields.get(self.where + "virial")
        self.face_work = fields.get("face_work")
        table = fields[self.where + "tile_sums"]
        return SumTables(table, table, first)

    @ti.func
    def begin_tile(self, tile):
        for n in ti.static(range(self.columns)):
            self.loss[tile, n] = 0.0 * self.loss[tile, n]

    @ti.func
    def end_tile(self, tile):
        """Adds the sums of a tile and step to those of all steps."""
        for n in ti.static(range(self.channels)):
            add_to(self.total_loss, tile, n, self.loss[tile, n])
        if ti.static(self.stress):
            for n in ti.static(range(9)):
                add_to(self.total_virial, tile, n, self.loss[tile, self.VIRIAL + n])
        if ti.static(self.across):
            self.face_work[tile] = self.face_work[tile] + self.loss[tile, self.FACES]


@ti.data_oriented
class DeviationPairs(TileSums, PairPass):
    """Pairs that keep e1 and e2."""

    def __init__(self, fields, layout, laws):
        super().__init__(fields, layout, laws)
        self.settles, self.ENDS = layout.ledger, layout.tile_columns
        self.columns += self.settles

    @ti.func
    def add_face_work(self, tile, value):
        add_to(self.loss, tile, self.FACES, value)

    @ti.func
    def held(self, b):
        e1, e2 = self.get(b, self.FIRST), self.get(b, self.SECOND)
        return ti.Struct(e1=e1, e2=e2, was=self.state[b, self.TOUCHED])

    @ti.func
    def ways(self, b, p, step, frame):
        dt = self.one(step)
        far, fast, spin1, spin2 = self.gathered(b, frame)
        # both terms are some 1e4 times the gap of grains that touch
        gap = self.one(p.touch * p.touch - far.dot(far))
        d, dv, w1, w2 = self.three(far), self.three(fast), self.three(spin1), self.three(spin2)
        way = separation(d, gap, dv, dt, self.one(p.touch))
        return ti.Struct(
            d=d, dv=dv, w1=w1, w2=w2, turn1=w1.times(dt), turn2=w2.times(dt), inv=way.inv,
            nc=way.nc, back=way.back, turned=way.turned, overlap=way.overlap, u=way.u,
        )  # fmt: skip

    @ti.func
    def speed(self, way: ti.template()):
        return way.u

    @ti.func
    def overlap(self, way: ti.template(), p):
        return way.overlap

    @ti.func
    def speed_then(self, way: ti.template(), dt):
        return way.dv.dot(way.nc.minus(way.turned))

    @ti.func
    def pose(self, at: ti.template(), held: ti.template(), way: ti.template(), p):
        """Turned, and put back to the limits: rolling moves e_i by (xi - xi_c)/r_i, sliding by
        (zeta - zeta_c)/(r1 + r2) one way and the other, and neither sees the other.
        """
        before = way.nc.minus(way.turned)
        n1, n2 = held.e1.minus(before), held.e2.plus(before)
        e1 = held.e1.plus(rotation(n1, way.turn1)).plus(way.turned)
        e2 = held.e2.plus(rotation(n2, way.turn2)).minus(way.turned)
        along1, along2 = e1.dot(way.nc), -e2.dot(way.nc)
        e1, e2 = across(e1, way.nc), across(e2, way.nc)
        turned = ti.Struct(e1=e1, e2=e2, n1=n1, n2=n2)
        off1, off2 = roll(self, at, turned, way, p)
        e1, e2 = e1.minus(off1), e2.minus(off2)
        zeta = e1
        if ti.static(self.has_sliding):
            arm = turned.e1.times(p.r1).minus(turned.e2.times(p.r2))
            zeta = self.laws.sliding.displacement(arm, way.nc, p)
            arm_rate = way.w1.cross(n1).times(p.r1).minus(way.w2.cross(n2).times(p.r2))
            rate = self.laws.sliding.displacement(arm_rate.plus(way.dv), way.nc, p)
            past = self.slip(at, zeta, rate, p)
            off = zeta.times(past.over * p.inv_touch)
            e1, e2 = e1.minus(off), e2.plus(off)
            zeta = zeta.times(1.0 - past.over)
        h1, h2 = shortfall(e1, along1), shortfall(e2, along2)
        e1, e2 = e1.plus(way.nc.times(h1)), e2.minus(way.nc.times(h2))
        lean = (p.r1 * h1 + p.r2 * h2 - self.one(p.touch)) * way.inv
        n1, n2 = e1.minus(way.nc), e2.plus(way.nc)
        return ti.Struct(n1=n1, n2=n2, one=e1, two=e2, zeta=zeta, lean=lean)

    @ti.func
    def keep(self, b, on: ti.template(), way: ti.template(), pose: ti.template()):
        # pointers begin on the line of centres
        self.put(self.state, b, self.FIRST, pose.one.times(on.hold))
        self.put(self.state, b, self.SECOND, pose.two.times(on.hold))
        if ti.static(not self.settles):
            self.state[b, self.TOUCHED] = on.now

    @ti.func
    def note_ends(self, b, tile, on: ti.template()):
        """Notes in `touched` which contacts have formed (2) or broken (-1), for `settle`."""
        self.state[b, self.TOUCHED] = on.now + on.formed - on.broken
        add_to(self.loss, tile, self.ENDS, on.formed + on.broken)

    @ti.func
    def any_ends(self, tile):
        """Whether contacts of a tile have formed or broken."""
        return self.loss[tile, self.ENDS].sum() > 0.0

    @ti.func
    def has_ends(self, b):
        """The same of a block."""
        noted = self.state[b, self.TOUCHED]
        return (noted * (noted - 1.0)).sum() > 0.0  # 0 and 1 are what else stands there

    @ti.func
    def settle(self, b, tile, p, step, frame):
        """Enters what it costs that contacts of a block have formed or broken, and drops the
        springs of those that have broken.

        Few tiles have any, and what it costs is a tenth of the work on a block. A branch inside of
        that would part its lanes (test_packed), so this comes when a tile is done, and takes
        everything from memory again.
        """
        noted = self.state[b, self.TOUCHED]
        formed, broken = ti.max(noted - 1.0, 0.0), ti.max(-noted, 0.0)
        dt, way = self.one(step), self.ways(b, p, step, frame)
        at = ti.Struct(tile=tile, b=b, dt=dt, u=way.u)
        s = self.contact_radius((way.overlap + broken * way.u * dt) * p.inv_delta0)
        on = ti.Struct(formed=formed, broken=broken, s=s)
        self.begin_and_end(at, on, p.F4 * self.laws.normal.force(s), p)

        e1, e2 = self.get(b, self.FIRST), self.get(b, self.SECOND)
        arm = e1.times(p.r1).minus(e2.times(p.r2))
        if ti.static(self.has_sliding):
            arm = self.laws.sliding.displacement(arm, way.nc, p)
        short = p.r1 * e1.dot(way.nc) - p.r2 * e2.dot(way.nc)
        pose = ti.Struct(
            n1=e1.minus(way.nc), n2=e2.plus(way.nc), one=e1, two=e2, zeta=arm,
            lean=(short - self.one(p.touch)) * way.inv,
        )  # fmt: skip
        found = self.springs(pose, p)
        if ti.static(self.has_twisting):
            phi = self.state[b, self.TWIST]
            torque = way.nc.times(-self.laws.twisting.stiffness(phi, p) * phi)
            self.add_twist(found, torque, self.laws.twisting.energy(phi, p))
        self.end_springs(at, on, found, way)
        for n in ti.static(range(6 + self.has_twisting)):
            self.state[b, n] = self.state[b, n] * (1.0 - broken)
        self.state[b, self.TOUCHED] = noted - formed + broken


@ti.data_oriented
class DeviationWalls(TileSums, WallPass):
    """Contacts with walls that keep e1 and zeta; n2 is the normal of the wall, and so e2 is 0."""

    where = "wall_"

    @ti.func
    def held(self, b):
        e1, zeta = self.get(b, self.FIRST), self.get(b, self.SECOND)
        return ti.Struct(e1=e1, zeta=zeta, was=self.state[b, self.TOUCHED])

    @ti.func
    def pose(self, at: ti.template(), held: ti.template(), way: ti.template(), p):
        """Turned and moved, and put back to the limits. What rolls over its limit does not move
        zeta, what slides over its own is taken from zeta alone."""
        n1, still = held.e1.minus(way.nw), way.w1.times(0.0)
        turn = rotation(n1, way.turn1)
        e1 = held.e1.plus(turn)
        along = e1.dot(way.nw)
        e1 = across(e1, way.nw)
        zeta = held.zeta
        if ti.static(self.has_sliding):
            moved = held.zeta.plus(turn.times(p.r1)).plus(way.dv.times(at.dt))
            zeta = self.laws.sliding.displacement(moved, way.nw, p)
            arm_rate = way.dv.plus(way.w1.cross(n1).times(p.r1))
            rate = self.laws.sliding.displacement(arm_rate, way.nw, p)
            past = self.slip(at, zeta, rate, p)
            zeta = zeta.times(1.0 - past.over)
        turned = ti.Struct(e1=e1, e2=still, n1=n1, n2=way.nw)
        off, _ = roll(self, at, turned, ti.Struct(w1=way.w1, w2=still), p)
        e1 = e1.minus(off)
        e1 = e1.plus(way.nw.times(shortfall(e1, along)))
        n1 = e1.minus(way.nw)
        return ti.Struct(n1=n1, n2=way.nw, one=e1, two=still, zeta=zeta, lean=-1.0)

    @ti.func
    def keep(self, b, on: ti.template(), way: ti.template(), pose: ti.template(), p):
        self.put(self.state, b, self.FIRST, pose.one.times(on.kept))
        self.put(self.state, b, self.SECOND, pose.zeta.times(on.kept))
        self.state[b, self.TOUCHED] = on.now
