"""Sums over the state at an output: energies, contacts, extremes. Partial sums by tile and chunk,
added up by NumPy in their order, so that the result does not depend on the threads."""

import taichi as ti

from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.contacts import make_access, step01
from dusttaichi.grains.kernels.grains import make_gather, make_push
from dusttaichi.grains.kernels.params import params_type
from dusttaichi.grains.kernels.poly import make_lane_params
from dusttaichi.grains.kernels.store import CHUNK, FIRST_WALL, GRAINS, PAIRS, WALL_BLOCKS, capacity
from dusttaichi.grains.kernels.walls import Walls
from dusttaichi.physics.contact import normal, rolling, sliding, twisting

# columns of a contact sum
NORMAL, ROLLING, SLIDING, TWISTING, CONTACTS, PENDING, DEEPEST, FACES = range(8)
STRIKING = 8  # with asperities: half of the work of the touches of this step
STRAIN = 9  # largest overlap over the smaller radius, where grains have radii of their own
# columns of a grain sum; kinetic energies of v, w at the time of the positions; what they exceed
# m v(n-1/2).v(n+1/2)/2 by, the kinetic energy whose change in a step is the work of the mean force
LINEAR, ANGULAR, FASTEST, FASTEST_SPIN, KICK = range(5)


def columns_of(layout):
    """Columns of a contact sum that a scene has."""
    return 10 if layout.poly else 8 + layout.asperities


def place_measure(grains, layout, walls):
    pair_blocks, wall_blocks = capacity(grains, layout, walls)
    columns = columns_of(layout)
    sums = {
        "pair_sum": ti.field(ti.f64, shape=(pair_blocks // layout.tile, columns)),
        "grain_sum": ti.field(ti.f64, shape=(-(-grains // CHUNK), 5)),
    }
    if walls:
        sums["wall_sum"] = ti.field(ti.f64, shape=(wall_blocks // layout.tile, columns))
        sums["wall_force"] = ti.field(ti.f64, shape=(6, 3))
    return sums


def make_measure(fields, sums, layout, effects, walls):
    """Kernels that fill `sums`: grains(mass, inertia, kick, turn), pairs(p, dt), walls(...).

    Where grains have masses of their own (layout.poly) mass and inertia are units of them.
    """
    W, T = layout.width, layout.tile
    V3, gather, get_state, _, state, load = make_access(fields, layout)
    ContactParams = params_type(layout.geometry, layout.law)
    x, v, w, counts = fields["x"], fields["v"], fields["w"], fields["counts"]
    total, pushed = make_gather(fields, layout), make_push(fields, layout)
    pair_i, pair_j = fields["pair_i"], fields["pair_j"]
    pair_sum, grain_sum = sums["pair_sum"], sums["grain_sum"]
    N1, N2, TWIST, APPROACH = layout.pointer, layout.second, layout.twist, layout.approach

    frame, across, power = make_cell(fields, layout)
    displacement = sliding.displacement_unequal if layout.poly else sliding.displacement
    of_pairs, of_wall = make_lane_params(fields, layout) if layout.poly else (None, None)
    masses, inertias = fields.get("mass"), fields.get("inertia")
    columns = columns_of(layout)
    contact_radius = normal.contact_radius(effects.newton_steps)

    @ti.func
    def add(table: ti.template(), tile, column, lanes):
        for k in ti.static(range(W)):
            table[tile, column] = table[tile, column] + lanes[k]

    @ti.func
    def common(table: ti.template(), tile, b, overlap, along, now, p, dt):
        s = contact_radius(overlap * p.inv_delta0)
        add(table, tile, NORMAL, now * p.U4 * normal.energy_lanes(s))
        add(table, tile, CONTACTS, now)
        if ti.static(effects.damped):
            # half of the damping work of this step belongs to the time before it
            add(table, tile, PENDING, 0.5 * dt * state[b, APPROACH] * state[b, APPROACH + 1])
        if ti.static(effects.asperities):
            # half of the impulse of this step has acted, in half of the change of speed
            impulse = state[b, layout.graze + 1]
            change = (0.25 * dt / p.mass) * along
            add(table, tile, STRIKING, -0.5 * impulse * (state[b, layout.graze] + change))
        for k in ti.static(range(W)):
            table[tile, DEEPEST] = ti.max(table[tile, DEEPEST], now[k] * overlap[k])

    @ti.func
    def strain(table: ti.template(), tile, overlap, now, smaller):
        for k in ti.static(range(W)):
            table[tile, STRAIN] = ti.max(table[tile, STRAIN], now[k] * overlap[k] / smaller[k])

    @ti.func
    def clear(table: ti.template(), tile):
        for k in ti.static(range(columns)):
            table[tile, k] = 0.0

    @ti.kernel
    def measure_grains(mass: ti.f64, inertia: ti.f64, half_kick: ti.f64, half_turn: ti.f64):
        grains = counts[GRAINS]
        for chunk in range((grains + CHUNK - 1) // CHUNK):
            zero = ti.cast(0.0, ti.f64)
            linear, angular, fastest, spin = zero, zero, zero, zero
            kicked, turned = zero, zero
            for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, grains)):
                force, torque = total(g)
                force, torque = pushed(g, force, torque)
                if ti.static(layout.poly):
                    force, torque = force / masses[g], torque / inertias[g]
                kick, turn = half_kick * force, half_turn * torque
                now = v[g] + kick
                turning = w[g] + turn
                if ti.static(layout.poly):
                    linear += masses[g] * now.dot(now)
                    angular += inertias[g] * turning.dot(turning)
                    kicked += masses[g] * kick.dot(kick)
                    turned += inertias[g] * turn.dot(turn)
                else:
                    linear += now.dot(now)
                    angular += turning.dot(turning)
                    kicked += kick.dot(kick)
                    turned += turn.dot(turn)
                fastest = ti.max(fastest, now.dot(now))
                spin = ti.max(spin, turning.dot(turning))
            grain_sum[chunk, LINEAR] = 0.5 * mass * linear
            grain_sum[chunk, ANGULAR] = 0.5 * inertia * angular
            grain_sum[chunk, FASTEST] = ti.sqrt(fastest)
            grain_sum[chunk, FASTEST_SPIN] = ti.sqrt(spin)
            grain_sum[chunk, KICK] = 0.5 * (mass * kicked + inertia * turned)

    @ti.func
    def measure_pair_block(tile, b, p, dt, frame):
        d = gather(x, pair_i[b]).minus(gather(x, pair_j[b]))
        if ti.static(layout.periodic):
            d = across(b, d, 0, frame)
            add(pair_sum, tile, FACES, power(b, V3(load[b, 0], load[b, 1], load[b, 2]), frame))
        distance = ti.sqrt(d.dot(d))
        nc = d.times(1.0 / distance)
        n1, n2 = get_state(b, N1), get_state(b, N2)
        now = step01(n1.dot(n1) - 0.5)
        along = V3(load[b, 0], load[b, 1], load[b, 2]).dot(nc)
        common(pair_sum, tile, b, p.touch - distance, along, now, p, dt)
        if ti.static(layout.poly):
            strain(pair_sum, tile, p.touch - distance, now, ti.min(p.r1, p.r2))
        if ti.static(effects.rolling):
            add(pair_sum, tile, ROLLING, rolling.energy(rolling.displacement(n1, n2, p), p))
        if ti.static(effects.sliding):
            zeta, _ = displacement(n1, n2, nc, p)
            add(pair_sum, tile, SLIDING, sliding.energy(zeta, p))
        if ti.static(effects.twisting):
            add(pair_sum, tile, TWISTING, twisting.energy(state[b, TWIST], p))

    @ti.kernel
    def measure_pairs(p: ContactParams, step: ti.i64, dt: ti.f64):
        for tile in range((counts[PAIRS] + W * T - 1) // (W * T)):
            clear(pair_sum, tile)
            here = frame(step, dt)
            for b in range(tile * T, (tile + 1) * T):
                if ti.static(layout.poly):
                    measure_pair_block(tile, b, of_pairs(b), dt, here)
                else:
                    measure_pair_block(tile, b, p, dt, here)

    if not walls:
        return measure_grains, measure_pairs, None

    wall_sum, wall_force = sums["wall_sum"], sums["wall_force"]
    wall_grain, wall_gap, wall_of = fields["wall_grain"], fields["wall_gap"], fields["wall_of"]

    @ti.func
    def measure_wall_block(tile, c, box, time, p, dt):
        b, k = counts[FIRST_WALL] + c, wall_of[c]
        xi = gather(x, wall_grain[c])
        one = 1.0 + 0.0 * xi.x
        nw = V3(one * box.normal[k, 0], one * box.normal[k, 1], one * box.normal[k, 2])
        distance = xi.dot(nw) - box.offset[k] - box.speed[k] * time + wall_gap[c]
        n1, foot = get_state(b, N1), get_state(b, N2)
        now = step01(n1.dot(n1) - 0.5)
        strength = box.strength[k] * now
        along = V3(load[b, 0], load[b, 1], load[b, 2]).dot(nw)
        common(wall_sum, tile, b, p.touch - distance, along, now, p, dt)
        if ti.static(layout.poly):
            strain(wall_sum, tile, p.touch - distance, now, p.r)
        if ti.static(effects.rolling):
            add(
                wall_sum,
                tile,
                ROLLING,
                strength * rolling.energy(rolling.displacement(n1, nw, p), p),
            )
        if ti.static(effects.sliding):
            zeta = sliding.displacement_wall(xi, n1, foot, nw, p)
            add(wall_sum, tile, SLIDING, strength * sliding.energy(zeta, p))
        if ti.static(effects.twisting):
            add(wall_sum, tile, TWISTING, strength * twisting.energy(state[b, TWIST], p))

    @ti.kernel
    def measure_walls(box: Walls, time: ti.f64, p: ContactParams, dt: ti.f64):
        for tile in range((counts[WALL_BLOCKS] + T - 1) // T):
            clear(wall_sum, tile)
            for c in range(tile * T, ti.min((tile + 1) * T, counts[WALL_BLOCKS])):
                if ti.static(layout.poly):
                    measure_wall_block(tile, c, box, time, of_wall(counts[FIRST_WALL] + c), dt)
                else:
                    measure_wall_block(tile, c, box, time, p, dt)
        for n in range(6):
            for a in ti.static(range(3)):
                force = ti.cast(0.0, ti.f64)
                for c in range(counts[WALL_BLOCKS]):
                    if wall_of[c] == n:
                        for k in ti.static(range(W)):
                            force += load[counts[FIRST_WALL] + c, a][k]
                wall_force[n, a] = force

    return measure_grains, measure_pairs, measure_walls
