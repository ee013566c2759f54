"""One pass over the contacts between grains and walls, a block (of one wall) at a time."""

import taichi as ti

from dusttaichi.grains.kernels.contacts import (
    BREAKING,
    DAMPING,
    FORMING,
    ROLLING,
    SLIDING,
    TWISTING,
    add_to,
    make_access,
    make_book,
    make_flatten,
    make_law,
    make_touch,
    make_virial,
    step01,
)
from dusttaichi.physics.contact import rolling, sliding, twisting

Walls = ti.types.struct(
    normal=ti.types.matrix(6, 3, ti.f64),  # unit normals, into the sample
    offset=ti.types.vector(6, ti.f64),  # plane: x.n = offset + speed t
    speed=ti.types.vector(6, ti.f64),  # along the normal
    strength=ti.types.vector(6, ti.f64),  # of rolling, sliding, twisting
)


def make_wall_pass(fields, layout, effects):
    """Returns `wall_block(c, tile, first, plane, strength, params, step)`.

    c counts wall blocks; their state and loads stand behind those of the pairs, from block `first`.
    """
    V3, gather, get_state, put, state, load = make_access(fields, layout)
    touch, jump, damp = make_touch(effects)
    x, v, w, loss = fields["x"], fields["v"], fields["w"], fields["wall_loss"]
    wall_grain, wall_gap, impulse = fields["wall_grain"], fields["wall_gap"], fields["impulse"]
    N1, FOOT, TWIST, APPROACH = layout.pointer, layout.second, layout.twist, layout.approach
    flatten, last_impulse = make_flatten(state, loss, layout)
    add_virial = make_virial(fields.get("wall_virial"))
    book, (law, law3) = make_book(layout), make_law(layout)

    @ti.func
    def wall_block(c, tile, first, unit_normal, offset, speed, strength, p, step):
        b = first + c
        i = wall_grain[c]
        place = gather(x, i)
        dt, long = law(step), ti.cast(step, layout.geometry)
        turn = gather(w, i).times(long)
        one = ti.cast(1.0 + 0.0 * wall_gap[c], layout.geometry)
        nw = V3(one * unit_normal[0], one * unit_normal[1], one * unit_normal[2])
        distance = place.dot(nw) - offset + wall_gap[c]
        dv = gather(v, i).minus(nw.times(speed))
        u = law(dv.dot(nw))
        n1, foot = get_state(b, N1), get_state(b, FOOT)
        was = law(step01(n1.dot(n1) - 0.5))
        now, formed, broken, kept, s = touch(law(p.touch - distance), u, was, dt, p)
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
            push += flatten(tile, b, u, u, push, formed, dt, p)

        # the pointer of a lane that did not touch a step ago is zero: `strong` masks its springs
        strong = law(was * strength)
        turned = n1.turned(turn)
        n1 = turned
        if ti.static(effects.sliding):
            zeta = sliding.displacement_wall(place, turned, foot, nw, p)
            over, lost = sliding.correct_wall(zeta, p)
            foot = foot.plus(zeta.times(over))
            book(loss, tile, SLIDING, strong * lost)
        if ti.static(effects.rolling):
            xi = rolling.displacement(turned, nw, p)
            c1, lost = rolling.correct_wall(xi, turned, p)
            n1 = turned.plus(xi.times(c1))
            book(loss, tile, ROLLING, strong * lost)
        # the foot goes with the pointer: rolling must not load the sliding spring
        n1 = n1.unit()
        foot = foot.plus(n1.minus(turned).times(p.r))
        start = place.minus(nw.times(p.r))
        put(state, b, N1, n1.times(kept).minus(nw.times(formed)))
        put(state, b, FOOT, foot.times(kept).plus(start.times(formed)))

        stored = 0.0 * was
        shear = law3(nw).times(stored)
        a = shear
        if ti.static(effects.rolling):
            xi = law3(rolling.displacement(n1, nw, p))
            stored += rolling.energy(xi, p)
            a = xi.times(law(rolling.pull(p)))
        if ti.static(effects.sliding):
            zeta = law3(sliding.displacement_wall(place, n1, foot, nw, p))
            stored += sliding.energy(zeta, p)
            # force -k_s zeta: the lever of eq 13 is the distance itself on a wall
            shear = zeta.times(sliding.push(1.0, 1.0, p))
            a = a.plus(zeta.times(law(sliding.pull(p))))
        torque = a.cross(law3(n1))
        if ti.static(effects.twisting):
            twist, lost = twisting.correct(was * (state[b, TWIST] + turn.dot(nw)), p)
            phi = law(twist)
            stored += twisting.energy(phi, p)
            state[b, TWIST] = kept * twist
            book(loss, tile, TWISTING, strength * lost)
            torque = torque.plus(law3(nw).times(twisting.torque(phi, p)))
        # a spring that breaks has worked for half a step less than its displacement says
        work = law(dt * shear.dot(dv) + torque.dot(turn))
        weight = law(kept * strength)
        force = law3(nw).times(push).plus(shear.times(weight))
        put(load, b, 0, force)
        put(load, b, 3, torque.times(weight))
        add_to(impulse, c, 0, step * force.x)
        add_to(impulse, c, 1, step * force.y)
        add_to(impulse, c, 2, step * force.z)
        if ti.static(layout.stress):
            add_virial(tile, nw.times(distance), force, step)
        book(loss, tile, FORMING, lost_forming)
        book(loss, tile, BREAKING, lost_breaking + broken * strength * (stored + 0.5 * work))

    return wall_block
