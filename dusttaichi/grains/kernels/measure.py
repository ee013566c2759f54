"""Sums over the state at an output: energies, contacts, extremes. Partial sums by tile and chunk,
added up by NumPy in their order, so that the result does not depend on the threads."""

import taichi as ti

from dusttaichi.compute.scan import CHUNK, whole
from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.contacts import make_access, step01
from dusttaichi.grains.kernels.grains import make_gather, make_push
from dusttaichi.grains.kernels.gravity import make_gravity
from dusttaichi.grains.kernels.params import params_type
from dusttaichi.grains.kernels.polydisperse import make_numbers
from dusttaichi.grains.kernels.sphere import make_sphere
from dusttaichi.grains.kernels.store import (
    FIRST_SPHERE,
    FIRST_WALL,
    GRAINS,
    PAIRS,
    WALL_BLOCKS,
    capacity,
    sphere_capacity,
)
from dusttaichi.grains.kernels.walls import TOP, Walls

# columns of a contact sum
NORMAL, ROLLING, SLIDING, TWISTING, CONTACTS, PENDING, DEEPEST, FACES = range(8)
STRIKING = 8  # with asperities: half of the work of the touches of this step
STRAIN = 9  # largest overlap over the smaller radius, where grains have radii of their own
# columns of a grain sum; kinetic energies of v, w at the time of the positions; what they exceed
# m v(n-1/2).v(n+1/2)/2 by, the kinetic energy whose change in a step is the work of the mean force
LINEAR, ANGULAR, FASTEST, FASTEST_SPIN, KICK = range(5)


def columns_of(layout):
    """Columns of a contact sum that a scene has."""
    return 10 if layout.polydisperse else 8 + layout.asperities


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
    if layout.sphere:
        tiles = sphere_capacity(grains, layout) // layout.tile
        sums["sphere_sum"] = ti.field(ti.f64, shape=(tiles, columns))
        sums["sphere_load"] = ti.field(ti.f64, shape=6)
    return sums


@ti.data_oriented
class ContactSums:
    """Energies, counts and extremes of a block of contacts, added to its tile of a table."""

    def __init__(self, fields, layout, laws):
        access = make_access(fields, layout)
        self.Wide, self.gather, self.get = access.Wide, access.gather, access.get
        self.V3 = access.V3
        self.laws, self.layout, self.width = laws, layout, layout.width
        self.x, self.state, self.load = fields["x"], fields["state"], fields["load"]
        self.contact_radius = laws.normal.contact_radius(laws.newton_steps)
        self.FIRST, self.SECOND, self.TWIST = layout.first, layout.second, layout.twist
        self.APPROACH, self.GRAZE, self.TOUCHED = layout.approach, layout.graze, layout.touched
        self.deviations = layout.deviations
        self.columns, self.polydisperse = columns_of(layout), layout.polydisperse
        for effect in ("rolling", "sliding", "twisting", "damping", "asperities"):
            setattr(self, f"has_{effect}", getattr(laws, effect) is not None)

    @ti.func
    def kept(self, b):
        """What the contacts of a block have kept, and 1 where they touch: pointers, or deviations,
        of which the laws make the same displacements."""
        first, second = self.get(b, self.FIRST), self.get(b, self.SECOND)
        now = 0.0 * first.x
        if ti.static(self.deviations):
            now = self.state[b, self.TOUCHED]
        else:
            now = step01(first.dot(first) - 0.5)
        return first, second, now

    @ti.func
    def clear(self, table: ti.template(), tile):
        for k in ti.static(range(self.columns)):
            table[tile, k] = 0.0

    @ti.func
    def add(self, table: ti.template(), tile, column, lanes):
        for k in ti.static(range(self.width)):
            table[tile, column] = table[tile, column] + lanes[k]

    @ti.func
    def force(self, b):
        """Force on the first grain of each lane."""
        return self.V3(self.load[b, 0], self.load[b, 1], self.load[b, 2])

    @ti.func
    def normal(self, table: ti.template(), at: ti.template(), p):
        """Of the normal direction. at: tile, b, overlap, nc, now (1 where lanes touch), dt."""
        tile, b = at.tile, at.b
        s = self.contact_radius(at.overlap * p.inv_delta0)
        self.add(table, tile, NORMAL, at.now * p.U4 * self.laws.normal.energy(s))
        self.add(table, tile, CONTACTS, at.now)
        if ti.static(self.has_damping):
            # half of the damping work of this step belongs to the time before it
            work = self.state[b, self.APPROACH] * self.state[b, self.APPROACH + 1]
            self.add(table, tile, PENDING, 0.5 * at.dt * work)
        if ti.static(self.has_asperities):
            # half of the impulse of this step has acted, in half of the change of speed
            impulse = self.state[b, self.GRAZE + 1]
            change = (0.25 * at.dt / p.mass) * self.force(b).dot(at.nc)
            self.add(table, tile, STRIKING, -0.5 * impulse * (self.state[b, self.GRAZE] + change))
        for k in ti.static(range(self.width)):
            table[tile, DEEPEST] = ti.max(table[tile, DEEPEST], at.now[k] * at.overlap[k])
        if ti.static(self.polydisperse):
            for k in ti.static(range(self.width)):
                # the smaller radius; on a wall inv_r2 is 0
                strain = at.now[k] * at.overlap[k] * ti.max(p.inv_r1[k], p.inv_r2[k])
                table[tile, STRAIN] = ti.max(table[tile, STRAIN], strain)

    @ti.func
    def springs(self, table: ti.template(), at: ti.template(), arm, p):
        """Of the other springs. at: also n1, n2, weight (of these springs); arm: of sliding."""
        if ti.static(self.has_rolling):
            xi = self.laws.rolling.displacement(at.n1, at.n2, p)
            self.add(table, at.tile, ROLLING, at.weight * self.laws.rolling.energy(xi, p))
        if ti.static(self.has_sliding):
            zeta = self.laws.sliding.displacement(arm, at.nc, p)
            self.add(table, at.tile, SLIDING, at.weight * self.laws.sliding.energy(zeta, p))
        if ti.static(self.has_twisting):
            energy = self.laws.twisting.energy(self.state[at.b, self.TWIST], p)
            self.add(table, at.tile, TWISTING, at.weight * energy)


def make_measure(fields, sums, layout, laws, walls):
    """Kernels that fill `sums`: grains(mass, inertia, kick, turn), pairs(p, step, dt), walls(box,
    time, p, dt) or None, sphere(p, step, dt) or None.

    Where grains have masses of their own (layout.polydisperse) mass and inertia are units of them.
    """
    contacts = ContactSums(fields, layout, laws)
    measure_walls = make_measure_walls(fields, sums, layout, contacts) if walls else None
    measure_pairs, measure_sphere = make_measure_pairs(fields, sums, layout, contacts)
    measure_grains = make_measure_grains(fields, sums, layout)
    return measure_grains, measure_pairs, measure_walls, measure_sphere


def make_measure_grains(fields, sums, layout):
    """Kernel of the sums over grains."""
    v, w, counts, grain_sum = fields["v"], fields["w"], fields["counts"], sums["grain_sum"]
    total, pushed = make_gather(fields, layout), make_push(fields, layout)
    masses, inertias = fields.get("mass"), fields.get("inertia")
    falls = make_gravity(fields, layout, fields.get("free"))

    @ti.func
    def own(table: ti.template(), g):
        """Mass or moment of inertia of a grain in units of the kernel's."""
        out = ti.cast(1.0, ti.f64)
        if ti.static(layout.polydisperse):
            out = table[g]
        return out

    @ti.kernel
    def measure_grains(mass: ti.f64, inertia: ti.f64, half_kick: ti.f64, half_turn: ti.f64):
        grains = counts[GRAINS]
        for chunk in range(whole(grains, CHUNK)):
            zero = ti.cast(0.0, ti.f64)
            linear, angular, fastest, spin = zero, zero, zero, zero
            kicked, turned = zero, zero
            for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, grains)):
                m, i = own(masses, g), own(inertias, g)
                force, torque = total(g)
                force, torque = pushed(g, force, torque)
                kick, turn = half_kick * (force / m), half_turn * (torque / i)
                if ti.static(layout.falls):
                    kick += half_kick * mass * falls(g)
                now, turning = v[g] + kick, w[g] + turn
                linear += m * now.dot(now)
                angular += i * turning.dot(turning)
                kicked += m * kick.dot(kick)
                turned += i * turn.dot(turn)
                fastest = ti.max(fastest, now.dot(now))
                spin = ti.max(spin, turning.dot(turning))
            grain_sum[chunk, LINEAR] = 0.5 * mass * linear
            grain_sum[chunk, ANGULAR] = 0.5 * inertia * angular
            grain_sum[chunk, FASTEST] = ti.sqrt(fastest)
            grain_sum[chunk, FASTEST_SPIN] = ti.sqrt(spin)
            grain_sum[chunk, KICK] = 0.5 * (mass * kicked + inertia * turned)

    return measure_grains


def make_measure_pairs(fields, sums, layout, contacts):
    """Kernels of the sums over contacts between grains, and over those with the sphere (or None)
    with the loads on it."""
    W, T = layout.width, layout.tile
    ContactParams = params_type(contacts.laws, layout.geometry, layout.law)
    counts, pair_sum, sphere_sum = fields["counts"], sums["pair_sum"], sums.get("sphere_sum")
    pair_i, pair_j = fields["pair_i"], fields["pair_j"]
    frame, across, power = make_cell(fields, layout)
    numbers, _ = make_numbers(fields, layout, contacts.laws)

    @ti.func
    def measure_block(table: ti.template(), tile, b, p, dt, frame):
        d = contacts.gather(contacts.x, pair_i[b]).minus(contacts.gather(contacts.x, pair_j[b]))
        if ti.static(layout.periodic):
            d = across(b, d, 0, frame)
            contacts.add(table, tile, FACES, power(b, contacts.force(b), frame))
        distance = ti.sqrt(d.dot(d))
        n1, n2, now = contacts.kept(b)
        at = ti.Struct(
            tile=tile, b=b, overlap=p.touch - distance, nc=d.times(1.0 / distance),
            now=now, dt=dt, n1=n1, n2=n2, weight=1.0,
        )  # fmt: skip
        contacts.normal(table, at, p)
        contacts.springs(table, at, n1.times(p.r1).minus(n2.times(p.r2)), p)

    @ti.kernel
    def measure_pairs(p: ContactParams, step: ti.i64, dt: ti.f64):
        for tile in range((counts[PAIRS] + W * T - 1) // (W * T)):
            contacts.clear(pair_sum, tile)
            here = frame(step, dt)
            for b in range(tile * T, (tile + 1) * T):
                measure_block(pair_sum, tile, b, numbers(b, p), dt, here)

    if not layout.sphere:
        return measure_pairs, None
    sphere, sphere_load = make_sphere(fields, layout), sums["sphere_load"]

    @ti.kernel
    def measure_sphere(p: ContactParams, step: ti.i64, dt: ti.f64):
        for tile in range(sphere.tiles()):
            contacts.clear(sphere_sum, tile)
            here, first = frame(step, dt), counts[FIRST_SPHERE]
            for b in range(first + tile * T, first + (tile + 1) * T):
                measure_block(sphere_sum, tile, b, numbers(b, p), dt, here)
        for _ in range(1):
            force, torque = sphere.loads()
            for k in ti.static(range(3)):
                sphere_load[k], sphere_load[3 + k] = force[k], torque[k]

    return measure_pairs, measure_sphere


def make_measure_walls(fields, sums, layout, contacts):
    """Kernel of the sums over contacts with walls, and of the force of each wall."""
    W, T = layout.width, layout.tile
    ContactParams = params_type(contacts.laws, layout.geometry, layout.law)
    counts, table, wall_force = fields["counts"], sums["wall_sum"], sums["wall_force"]
    wall_grain, wall_gap, wall_of = fields["wall_grain"], fields["wall_gap"], fields["wall_of"]
    load = fields["load"]
    _, numbers = make_numbers(fields, layout, contacts.laws)

    @ti.func
    def measure_block(tile, c, box: ti.template(), time, p, dt):
        b, k = counts[FIRST_WALL] + c, wall_of[c]
        place = contacts.gather(contacts.x, wall_grain[c])
        one = 1.0 + 0.0 * place.x
        nw = contacts.Wide(one * box.normal[k, 0], one * box.normal[k, 1], one * box.normal[k, 2])
        distance = place.dot(nw) - box.offset[k] - box.speed[k] * time + wall_gap[c]
        if k == TOP:  # foot points stand where they do on the wall
            place.x -= box.slid + box.along * time
        n1, second, now = contacts.kept(b)
        n2, arm = nw, second
        if ti.static(layout.deviations):
            n2 = nw.times(0.0)
        else:
            arm = place.plus(n1.times(p.r1)).minus(second)
        at = ti.Struct(
            tile=tile, b=b, overlap=p.touch - distance, nc=nw,
            now=now, dt=dt, n1=n1, n2=n2, weight=box.strength[k] * now,
        )  # fmt: skip
        contacts.normal(table, at, p)
        contacts.springs(table, at, arm, p)

    @ti.kernel
    def measure_walls(box: Walls, time: ti.f64, p: ContactParams, dt: ti.f64):
        for tile in range((counts[WALL_BLOCKS] + T - 1) // T):
            contacts.clear(table, tile)
            for c in range(tile * T, ti.min((tile + 1) * T, counts[WALL_BLOCKS])):
                measure_block(tile, c, box, time, numbers(counts[FIRST_WALL] + c, p), dt)
        for n in range(6):
            for a in ti.static(range(3)):
                force = ti.cast(0.0, ti.f64)
                for c in range(counts[WALL_BLOCKS]):
                    if wall_of[c] == n:
                        for k in ti.static(range(W)):
                            force += load[counts[FIRST_WALL] + c, a][k]
                wall_force[n, a] = force

    return measure_walls
