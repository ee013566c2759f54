"""One pass over the contacts between grains: pointers, loads, losses, a block at a time."""

import taichi as ti

from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.lanes import vec3
from dusttaichi.physics.contact import asperities, normal, rolling, sliding, twisting

FORMING, BREAKING, DAMPING, ROLLING, SLIDING, TWISTING, ASPERITIES = range(7)


@ti.func
def step01(a):
    """1.0 where a > 0, else 0.0, by arithmetic (a comparison would break the lanes up)."""
    return ti.min(ti.max(a * 1e20, 0.0), 1.0)  # no infinity in single precision either


@ti.func
def add_to(field: ti.template(), row, column: ti.template(), value):
    """field[row, column] grows by value. (`+=` on a field is atomic in Taichi, and slow.)"""
    field[row, column] = field[row, column] + value


def make_book(layout):
    """Returns `book(loss, tile, channel, value)`: adds to a loss of the ledger."""

    @ti.func
    def book(loss: ti.template(), tile, channel: ti.template(), value):
        if ti.static(layout.ledger):
            add_to(loss, tile, channel, value)

    return book


def make_law(layout):
    """Functions that make lanes, and 3-vectors of lanes, numbers of the force law: `law`, `law3`.

    Where law and geometry have one precision they do nothing.
    """
    V3, real, same = vec3(layout.width, layout.law), layout.law, layout.law == layout.geometry

    @ti.func
    def law(a):
        return a if ti.static(same) else ti.cast(a, real)

    @ti.func
    def law3(a):
        return a if ti.static(same) else V3(law(a.x), law(a.y), law(a.z))

    return law, law3


def make_access(fields, layout):
    """Functions that read and write 3-vectors of lanes."""
    W = layout.width
    V3 = vec3(W, layout.geometry)
    state, load = fields["state"], fields["load"]

    @ti.func
    def gather(field: ti.template(), index):
        return V3(
            ti.Vector([field[index[k]][0] for k in ti.static(range(W))]),
            ti.Vector([field[index[k]][1] for k in ti.static(range(W))]),
            ti.Vector([field[index[k]][2] for k in ti.static(range(W))]),
        )

    @ti.func
    def get_state(b, first: ti.template()):
        return V3(state[b, first], state[b, first + 1], state[b, first + 2])

    @ti.func
    def put(field: ti.template(), b, first: ti.template(), a):
        field[b, first] = a.x
        field[b, first + 1] = a.y
        field[b, first + 2] = a.z

    return V3, gather, get_state, put, state, load


def make_touch(effects):
    """The part that pairs and walls share: the normal direction."""
    contact_radius = normal.contact_radius(effects.newton_steps)

    @ti.func
    def touch(overlap, u, was, dt, p):
        """Lanes that touch now, that just formed, broke, were kept; s = sqrt(a/a0).

        A lane that breaks in this step has its s evaluated where it was a step ago: that is the
        potential that is lost.
        """
        d = overlap * p.inv_delta0
        now = step01(d + was * normal.PULL_OFF)
        kept = now * was
        formed, broken = now - kept, was - kept
        s = contact_radius(d + broken * u * (dt * p.inv_delta0))
        return now, formed, broken, kept, s

    @ti.func
    def jump(s, u, formed, broken, dt, p):
        """Force of the spring, and the energy lost on forming and on breaking: the potential, less
        what the half kick of the step has done with it."""
        force = p.F4 * normal.force_lanes(s)
        potential = p.U4 * normal.energy_lanes(s)
        half_kick = 0.5 * dt * u * force
        return force, -formed * (potential + half_kick), broken * (potential - half_kick)

    @ti.func
    def damp(s, u, was, before, struck, f_before, now, dt, p):
        """Damping force of now (the speed carried on by half a step), and the work of the last.

        struck: the speed before, with what the impulse of a first touch has made of it.
        """
        ahead = u + 0.5 * was * (u - struck)
        f = now * ti.static(effects.damping)(s, p) * ahead
        return f, 0.5 * dt * f_before * (before + u)

    return touch, jump, damp


def make_flatten(state, loss, layout):
    """Returns `flatten` and `last_impulse(b)`, of first touches (physics.asperities)."""
    SPEED, IMPULSE = layout.graze, layout.graze + 1
    book, (law, _) = make_book(layout), make_law(layout)

    @ti.func
    def last_impulse(b):
        return law(state[b, IMPULSE])

    @ti.func
    def flatten(tile, b, after, u, push, formed, dt, p):
        """Force along n_c that lanes which have just formed feel in this step: impulse over dt.

        u: speed along n_c half a step back. after: speed now along the n_c of the last step, whose
        impulse is booked with it: the work it really did, whatever else pulled at the grains.
        Contacts that exist at the start (dt = 0) have touched before.
        """
        book(loss, tile, ASPERITIES, -0.5 * state[b, IMPULSE] * (state[b, SPEED] + after))
        impulse = 0.0 * u
        first = formed * step01(dt)
        if first.max() > 0.0:  # powers are dear, and first touches rare
            impulse = first * asperities.impulse(u, push * (dt / p.mass), p)
        state[b, SPEED], state[b, IMPULSE] = first * u, impulse
        return impulse * (1.0 / ti.max(dt, 1e-30))

    return flatten, last_impulse


def make_pointers(loss, effects, layout):
    """The part of a pair that the contact pointers carry: rolling and sliding.

    Displacements are geometry, what they cause is law.
    """
    book, (law, law3), poly = make_book(layout), make_law(layout), layout.poly
    displacement = sliding.displacement_unequal if poly else sliding.displacement
    correct_sliding = sliding.correct_unequal if poly else sliding.correct
    correct_rolling = rolling.correct_unequal if poly else rolling.correct

    @ti.func
    def slip(tile, n1, n2, nc, p):
        """Pointers put back to the limits, of unit length; the losses of the tile."""
        m1, m2 = n1, n2
        if ti.static(effects.rolling):
            xi = rolling.displacement(n1, n2, p)
            c1, c2, lost = correct_rolling(xi, n1, n2, p)
            m1, m2 = m1.plus(xi.times(c1)), m2.plus(xi.times(c2))
            book(loss, tile, ROLLING, lost)
        if ti.static(effects.sliding):
            zeta, _ = displacement(n1, n2, nc, p)
            c1, c2, lost = correct_sliding(zeta, n1, n2, p)
            m1, m2 = m1.plus(zeta.times(c1)), m2.plus(zeta.times(c2))
            book(loss, tile, SLIDING, lost)
        return m1.unit(), m2.unit()

    @ti.func
    def springs(n1, n2, nc, inv, p):
        """Force on the first grain, torques on both, energy stored."""
        stored = law(0.0 * inv)
        shear = law3(nc).times(stored)
        a1, a2 = shear, shear
        if ti.static(effects.rolling):
            xi = law3(rolling.displacement(n1, n2, p))
            stored += rolling.energy(xi, p)
            a1 = xi.times(law(rolling.pull(p)))
            a2 = a1
        if ti.static(effects.sliding):
            across, lever = displacement(n1, n2, nc, p)
            zeta = law3(across)
            stored += sliding.energy(zeta, p)
            shear = zeta.times(sliding.push(law(lever), law(inv), p))
            if ti.static(poly):
                pull1, pull2 = sliding.pull_unequal(p)
                a1, a2 = a1.plus(zeta.times(law(pull1))), a2.minus(zeta.times(law(pull2)))
            else:
                pull = zeta.times(law(sliding.pull(p)))
                a1, a2 = a1.plus(pull), a2.minus(pull)
        return shear, a1.cross(law3(n1)), a2.cross(law3(n2)), stored

    return slip, springs


def make_virial(table):
    """Returns `add_virial(tile, branch, force, dt)`: sums branch x force over time (T19 eq 23)."""

    @ti.func
    def add_row(tile, first: ti.template(), way, force):
        add_to(table, tile, first, way * force.x)
        add_to(table, tile, first + 1, way * force.y)
        add_to(table, tile, first + 2, way * force.z)

    @ti.func
    def add_virial(tile, branch, force, dt):
        add_row(tile, 0, branch.x * dt, force)
        add_row(tile, 3, branch.y * dt, force)
        add_row(tile, 6, branch.z * dt, force)

    return add_virial


def make_pair_pass(fields, layout, effects):
    """Returns `pair_block(b, tile, params, step, frame)`: updates block b and the sums of its tile.

    step: the time step.
    frame: of a periodic cell (kernels.cell); anything in a scene without.
    """
    V3, gather, get_state, put, state, load = make_access(fields, layout)
    touch, jump, damp = make_touch(effects)
    x, v, w, loss = fields["x"], fields["v"], fields["w"], fields["loss"]
    slip, springs = make_pointers(loss, effects, layout)
    book, (law, law3) = make_book(layout), make_law(layout)
    pair_i, pair_j = fields["pair_i"], fields["pair_j"]
    N1, N2, TWIST, APPROACH = layout.pointer, layout.second, layout.twist, layout.approach
    flatten, last_impulse = make_flatten(state, loss, layout)
    _, across, power = make_cell(fields, layout)
    face_work = fields.get("face_work")
    add_virial = make_virial(fields.get("virial"))

    @ti.func
    def pair_block(b, tile, p, step, frame):
        i, j = pair_i[b], pair_j[b]
        dt = law(step)
        d = gather(x, i).minus(gather(x, j))
        dv = gather(v, i).minus(gather(v, j))
        if ti.static(layout.periodic):
            d, dv = across(b, d, 0, frame), across(b, dv, 1, frame)
        long = ti.cast(step, layout.geometry)
        turn_i, turn_j = gather(w, i).times(long), gather(w, j).times(long)
        square = d.dot(d)
        inv = 1.0 / ti.sqrt(square)
        nc = d.times(inv)
        # speed and n_c of half a step ago, where v and w are: second order in dt
        back = d.minus(dv.times(0.5 * long)).times(inv + 0.5 * long * dv.dot(nc) * inv * inv)
        u = law(dv.dot(back))
        n1, n2 = get_state(b, N1), get_state(b, N2)
        was = law(step01(n1.dot(n1) - 0.5))
        now, formed, broken, kept, s = touch(law(p.touch - square * inv), u, was, dt, p)
        push, lost_forming, lost_breaking = jump(s, u, formed, broken, dt, p)
        push = now * push
        if ti.static(effects.damped):
            before = law(state[b, APPROACH])
            struck = before
            if ti.static(effects.asperities):
                struck += last_impulse(b) * (1.0 / p.mass)
            f, lost = damp(s, u, was, before, struck, law(state[b, APPROACH + 1]), now, dt, p)
            push -= f
            state[b, APPROACH], state[b, APPROACH + 1] = now * u, f
            book(loss, tile, DAMPING, lost)
        if ti.static(effects.asperities):
            then = d.minus(dv.times(long))  # where n_c of the last step pointed
            after = law(dv.dot(then) / ti.sqrt(then.dot(then)))
            push += flatten(tile, b, after, law(dv.dot(nc)), push, formed, dt, p)

        # pointers and twist of lanes that did not touch a step ago are zero, and so are their loads
        n1, n2 = n1.turned(turn_i), n2.turned(turn_j)
        n1, n2 = slip(tile, n1, n2, nc, p)
        put(state, b, N1, n1.times(kept).minus(nc.times(formed)))
        put(state, b, N2, n2.times(kept).plus(nc.times(formed)))

        shear, t1, t2, stored = springs(n1, n2, nc, inv, p)
        if ti.static(effects.twisting):
            way = turn_i.minus(turn_j).dot(back)
            twist, lost = twisting.correct(was * (state[b, TWIST] + way), p)
            phi = law(twist)
            stored += twisting.energy(phi, p)
            state[b, TWIST] = kept * twist
            book(loss, tile, TWISTING, lost)
            torque = law3(nc).times(twisting.torque(phi, p))
            t1, t2 = t1.plus(torque), t2.minus(torque)
        # a spring that breaks has worked for half a step less than its displacement says
        work = law(dt * shear.dot(dv) + t1.dot(turn_i) + t2.dot(turn_j))
        force = law3(nc).times(push).plus(shear.times(kept))
        put(load, b, 0, force)
        put(load, b, 3, t1.times(kept))
        put(load, b, 6, t2.times(kept))
        if ti.static(layout.periodic):
            face_work[tile] = face_work[tile] + step * power(b, force, frame)
        if ti.static(layout.stress):
            add_virial(tile, d, force, step)
        book(loss, tile, FORMING, lost_forming)
        book(loss, tile, BREAKING, lost_breaking + broken * (stored + 0.5 * work))

    return pair_block
