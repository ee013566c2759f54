"""What the pass over pairs and the pass over walls have in common, a block of lanes at a time.

The laws (physics.contact) say what a displacement costs; here their displacements are formed, their
limits kept, their forces added up and their losses put into the ledger sums.
"""

from types import SimpleNamespace
from typing import NamedTuple

import taichi as ti

from dusttaichi.grains.kernels.lanes import vec3
from dusttaichi.physics.contact.constants import PULL_OFF

FORMING, BREAKING, DAMPING, ROLLING, SLIDING, TWISTING, ASPERITIES = range(7)


@ti.func
def step01(a):
    """1.0 where a > 0, else 0.0, by arithmetic (a comparison would break the lanes up)."""
    return ti.min(ti.max(a * 1e20, 0.0), 1.0)  # no infinity in single precision either


@ti.func
def add_to(field: ti.template(), row, column: ti.template(), value):
    """field[row, column] grows by value. (`+=` on a field is atomic in Taichi, and slow.)"""
    field[row, column] = field[row, column] + value


def make_access(fields, layout):
    """Functions that read and write 3-vectors of lanes, and make them numbers of the laws.

    gather(field, index): of the grains of a block, in the precision of positions; one(a), three(a):
    a number and a 3-vector of lanes in the precision of the laws, as they are where that is the
    same; get(b, first), put(field, b, first, a): columns of the state, and of the state or the
    loads. Wide, V3: the types of what is gathered and of what is kept of a contact.
    """
    W, state, law = layout.width, fields["state"], layout.law
    Wide, V3 = vec3(W, layout.geometry), vec3(W, law)

    @ti.func
    def gather(field: ti.template(), index):
        return Wide(
            ti.Vector([field[index[k]][0] for k in ti.static(range(W))]),
            ti.Vector([field[index[k]][1] for k in ti.static(range(W))]),
            ti.Vector([field[index[k]][2] for k in ti.static(range(W))]),
        )

    @ti.func
    def one(a):
        return ti.cast(a, law)

    @ti.func
    def three(a):
        return V3(ti.cast(a.x, law), ti.cast(a.y, law), ti.cast(a.z, law))

    @ti.func
    def get(b, first: ti.template()):
        return V3(state[b, first], state[b, first + 1], state[b, first + 2])

    @ti.func
    def put(field: ti.template(), b, first: ti.template(), a):
        field[b, first] = a.x
        field[b, first + 1] = a.y
        field[b, first + 2] = a.z

    return SimpleNamespace(Wide=Wide, V3=V3, gather=gather, one=one, three=three, get=get, put=put)


class SumTables(NamedTuple):
    """Tables that a pass adds to by tiles: loss, of the ledger; virial, of the stress, from column
    `first` on."""

    loss: object
    virial: object
    first: int = 0


@ti.data_oriented
class ContactPass:
    """What pairs and walls share: touch, normal force, limits, springs, twist.

    at: of a block,
    the struct that the passes make: b and tile (numbers of the block and of its tile), dt, overlap,
    u (speed along the normal half a step ago), u_now, u_then (along the normal of now and of the
    last step), was (1 where the lanes touched a step ago), weight (of the springs but the normal
    one). on: the struct that `touch` returns. w1, w2: spins.
    settles: what forming and breaking cost is entered afterwards, for the few blocks where they
    happen.
    """

    settles = False

    def __init__(self, fields, layout, laws, tables):
        self.laws = laws
        self.loss, self.virial, self.VIRIAL = tables.loss, tables.virial, tables.first
        self.state, self.load = fields["state"], fields["load"]
        self.x, self.v, self.w = fields["x"], fields["v"], fields["w"]
        access = make_access(fields, layout)
        self.Wide, self.V3, self.gather = access.Wide, access.V3, access.gather
        self.one, self.three, self.get, self.put = access.one, access.three, access.get, access.put
        self.contact_radius = laws.normal.contact_radius(laws.newton_steps)
        self.FIRST, self.SECOND, self.TWIST = layout.first, layout.second, layout.twist
        self.APPROACH, self.GRAZE = layout.approach, layout.graze
        self.ledger, self.stress = layout.ledger, layout.stress
        for effect in ("rolling", "sliding", "twisting", "asperities"):
            setattr(self, f"has_{effect}", getattr(laws, effect) is not None)
        self.damped = laws.damping is not None

    @ti.func
    def lose(self, tile, channel: ti.template(), value):
        """Add to a loss of the ledger."""
        if ti.static(self.ledger):
            add_to(self.loss, tile, channel, value)

    @ti.func
    def touch(self, at: ti.template(), p):
        """Lanes that touch now, that just formed, broke, were kept; s = sqrt(a/a0); hold: those
        whose springs are written down.

        A lane that breaks in this step has its s evaluated where it was a step ago: that is the
        potential that is lost. Where that is entered afterwards (`settles`) its springs are
        written down until then.
        """
        d = at.overlap * p.inv_delta0
        now = step01(d + at.was * PULL_OFF)
        kept = now * at.was
        formed, broken, hold, back = now - kept, at.was - kept, kept, d
        if ti.static(self.settles):
            hold = at.was
        else:
            back = d + broken * at.u * (at.dt * p.inv_delta0)
        s = self.contact_radius(back)
        return ti.Struct(now=now, formed=formed, broken=broken, kept=kept, hold=hold, s=s)

    @ti.func
    def push(self, at: ti.template(), on: ti.template(), p):
        """Force along the normal: spring, damping, first touches. Losses go into the ledger."""
        spring = p.F4 * self.laws.normal.force(on.s)
        if ti.static(not self.settles):
            self.begin_and_end(at, on, spring, p)
        force = on.now * spring
        if ti.static(self.damped):
            force -= self.damp(at, on, p)
        if ti.static(self.has_asperities):
            force += self.flatten(at, on, force, p)
        return force

    @ti.func
    def begin_and_end(self, at: ti.template(), on: ti.template(), spring, p):
        """What forming and breaking cost: the potential, less what the half kick of the step has
        done with it."""
        potential = p.U4 * self.laws.normal.energy(on.s)
        half_kick = 0.5 * at.dt * at.u * spring
        self.lose(at.tile, FORMING, -on.formed * (potential + half_kick))
        self.lose(at.tile, BREAKING, on.broken * (potential - half_kick))

    @ti.func
    def damp(self, at: ti.template(), on: ti.template(), p):
        """Damping force of now: the speed carried on by half a step; the work of the last goes
        into the ledger.

        struck: the speed before, with what the impulse of a first touch has made of it.
        """
        before = self.state[at.b, self.APPROACH]
        struck = before
        if ti.static(self.has_asperities):
            struck += self.state[at.b, self.GRAZE + 1] * (1.0 / p.mass)
        force_before = self.state[at.b, self.APPROACH + 1]
        ahead = at.u + 0.5 * at.was * (at.u - struck)
        force = on.now * self.laws.damping.coefficient(on.s, p) * ahead
        self.state[at.b, self.APPROACH] = on.now * at.u
        self.state[at.b, self.APPROACH + 1] = force
        self.lose(at.tile, DAMPING, 0.5 * at.dt * force_before * (before + at.u))
        return force

    @ti.func
    def flatten(self, at: ti.template(), on: ti.template(), push, p):
        """Force that lanes which have just formed feel in this step (physics.contact.asperities):
        impulse over dt.

        The impulse of the last step is entered with the speed of now along the n_c of that step:
        the work it really did, whatever else pulled at the grains. Contacts that exist at the start
        (dt = 0) have touched before.
        """
        done = self.state[at.b, self.GRAZE] + at.u_then
        self.lose(at.tile, ASPERITIES, -0.5 * self.state[at.b, self.GRAZE + 1] * done)
        impulse = 0.0 * at.u_now
        first = on.formed * step01(at.dt)
        if first.max() > 0.0:  # powers are dear, and first touches rare
            change = push * (at.dt / p.mass)
            impulse = first * self.laws.asperities.impulse(at.u_now, change, p)
        self.state[at.b, self.GRAZE] = first * at.u_now
        self.state[at.b, self.GRAZE + 1] = impulse
        return impulse * (1.0 / ti.max(at.dt, 1e-30))

    @ti.func
    def slip(self, at: ti.template(), zeta, rate, p):
        """How far sliding is past its limit; what that costs goes into the ledger."""
        past = self.laws.sliding.correct(zeta, rate, p)
        self.lose(at.tile, SLIDING, at.weight * past.lost)
        return past

    @ti.func
    def springs(self, pose: ti.template(), p):
        """Struct of the force on the first grain, the torques on both, the energy stored.

        pose: pointers n1, n2; one, two: the pointers or their deviations, of which a law of rolling
        makes the same; zeta; lean: (r1 n1 - r2 n2).n_c over the distance of the centres (S12 eq
        13), -1 on a wall.
        """
        stored = 0.0 * pose.n1.x
        force = pose.n1.times(stored)
        a1, a2 = force, force
        if ti.static(self.has_rolling):
            xi = self.laws.rolling.displacement(pose.one, pose.two, p)
            stored += self.laws.rolling.energy(xi, p)
            a1 = xi.times(p.R * self.laws.rolling.stiffness(xi, p))
            a2 = a1
        if ti.static(self.has_sliding):
            k = self.laws.sliding.stiffness(pose.zeta, p)
            stored += self.laws.sliding.energy(pose.zeta, p)
            force = pose.zeta.times(k * pose.lean)
            a1 = a1.plus(pose.zeta.times(p.r1 * k))
            a2 = a2.minus(pose.zeta.times(p.r2 * k))
        torque1, torque2 = a1.cross(pose.n1), a2.cross(pose.n2)
        return ti.Struct(force=force, torque1=torque1, torque2=torque2, stored=stored)

    @ti.func
    def twist(self, at: ti.template(), on: ti.template(), way, rate, p):
        """(torque along the normal, energy stored), the twist carried on by `way` and put back to
        its limit; what that costs goes into the ledger."""
        past = self.laws.twisting.correct(at.was * (self.state[at.b, self.TWIST] + way), rate, p)
        phi = past.phi
        self.state[at.b, self.TWIST] = on.hold * phi
        self.lose(at.tile, TWISTING, at.weight * past.lost)
        return -self.laws.twisting.stiffness(phi, p) * phi, self.laws.twisting.energy(phi, p)

    @ti.func
    def add_virial(self, tile, branch, force, dt):
        """Sum branch x force over time (T19 eq 23)."""
        self.add_row(tile, self.VIRIAL, branch.x * dt, force)
        self.add_row(tile, self.VIRIAL + 3, branch.y * dt, force)
        self.add_row(tile, self.VIRIAL + 6, branch.z * dt, force)

    @ti.func
    def add_row(self, tile, first: ti.template(), way, force):
        add_to(self.virial, tile, first, way * force.x)
        add_to(self.virial, tile, first + 1, way * force.y)
        add_to(self.virial, tile, first + 2, way * force.z)

    @ti.func
    def begin_tile(self, tile):
        """What a pass over a tile begins with."""

    @ti.func
    def end_tile(self, tile):
        """What it ends with."""
