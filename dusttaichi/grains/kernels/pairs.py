"""One pass over the contacts between grains: pointers, loads, losses, a block at a time."""

import taichi as ti

from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.contacts import BREAKING, ROLLING, ContactPass, step01
from dusttaichi.physics.contact.limit import restoring


@ti.data_oriented
class PairPass(ContactPass):
    """`block(b, tile, p, step, frame)` updates block b of pairs and the sums of its tile.

    p: the numbers of the contacts. step: the time step. frame: of a periodic cell (kernels.cell);
    anything in a scene without. ways: of a block, the struct of where its grains are and how they
    move.
    """

    def __init__(self, fields, layout, laws):
        super().__init__(fields, layout, laws, loss=fields["loss"], virial=fields.get("virial"))
        self.pair_i, self.pair_j = fields["pair_i"], fields["pair_j"]
        self.periodic, self.face_work = bool(layout.periodic), fields.get("face_work")
        _, self.across, self.power = make_cell(fields, layout)

    @ti.func
    def ways(self, b, step, frame):
        """Distance vector d and its rate dv, spins, n_c, 1/|d|, n_c of half a step ago (`back`)."""
        i, j = self.pair_i[b], self.pair_j[b]
        d = self.gather(self.x, i).minus(self.gather(self.x, j))
        dv = self.gather(self.v, i).minus(self.gather(self.v, j))
        if ti.static(self.periodic):
            d, dv = self.across(b, d, 0, frame), self.across(b, dv, 1, frame)
        w1, w2 = self.gather(self.w, i), self.gather(self.w, j)
        turn1, turn2 = w1.times(step), w2.times(step)
        square = d.dot(d)
        inv = 1.0 / ti.sqrt(square)
        nc = d.times(inv)
        # where v and w are: second order in dt
        back = d.minus(dv.times(0.5 * step)).times(inv + 0.5 * step * dv.dot(nc) * inv * inv)
        return ti.Struct(
            d=d, dv=dv, w1=w1, w2=w2, turn1=turn1, turn2=turn2, inv=inv, distance=square * inv,
            nc=nc, back=back,
        )  # fmt: skip

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
        m1, m2, tilt = self.roll(at, turn, p)
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
    def block(self, b, tile, p, step, frame):
        dt, long = self.law(step), ti.cast(step, self.geometry)
        way = self.ways(b, long, frame)
        u = self.law(way.dv.dot(way.back))
        n1, n2 = self.get(b, self.N1), self.get(b, self.N2)
        was = self.law(step01(n1.dot(n1) - 0.5))
        overlap = self.law(p.touch - way.distance)
        u_then = u
        if ti.static(self.has_asperities):
            then = way.d.minus(way.dv.times(long))  # where n_c of the last step pointed
            u_then = self.law(way.dv.dot(then) / ti.sqrt(then.dot(then)))
        at = ti.Struct(
            b=b, tile=tile, dt=dt, overlap=overlap, u=u, u_now=self.law(way.dv.dot(way.nc)),
            u_then=u_then, was=was, weight=1.0,
        )  # fmt: skip
        on = self.touch(at, p)
        push = self.push(at, on, p)

        # pointers and twist of lanes that did not touch a step ago are zero, and so are their loads
        turn = ti.Struct(n1=n1.turned(way.turn1), n2=n2.turned(way.turn2), w1=way.w1, w2=way.w2)
        turn.n1, turn.n2 = self.limit(at, turn, way, p)
        self.put(self.state, b, self.N1, turn.n1.times(on.kept).minus(way.nc.times(on.formed)))
        self.put(self.state, b, self.N2, turn.n2.times(on.kept).plus(way.nc.times(on.formed)))

        zeta, along = self.slide(turn.n1, turn.n2, way.nc, p)
        found = self.springs(turn, zeta, self.law(along) * self.law(way.inv), p)
        if ti.static(self.has_twisting):
            rate = way.w1.minus(way.w2).dot(way.back)
            angle = way.turn1.minus(way.turn2).dot(way.back)
            axial, stored = self.twist(at, on, angle, rate, p)
            torque = self.law3(way.nc).times(axial)
            found.torque1, found.torque2 = found.torque1.plus(torque), found.torque2.minus(torque)
            found.stored += stored
        # a spring that breaks has worked for half a step less than its displacement says
        spun = found.torque1.dot(way.turn1) + found.torque2.dot(way.turn2)
        work = self.law(dt * found.force.dot(way.dv) + spun)
        self.lose(tile, BREAKING, on.broken * (found.stored + 0.5 * work))
        force = self.law3(way.nc).times(push).plus(found.force.times(on.kept))
        self.put(self.load, b, 0, force)
        self.put(self.load, b, 3, found.torque1.times(on.kept))
        self.put(self.load, b, 6, found.torque2.times(on.kept))
        if ti.static(self.periodic):
            power = self.power(b, force, frame)
            self.face_work[tile] = self.face_work[tile] + step * power
        if ti.static(self.stress):
            self.add_virial(tile, way.d, force, step)
