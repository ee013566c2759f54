"""Sums over the state at an output: energies, contacts, extremes.

Partial sums by tile and chunk, added up by NumPy in their order, so that the result does not depend
on the threads.
"""

from dusttaichi.compute.blocks import THREADS, BlockSums, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, whole
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.grains import make_gather, make_gravity, make_push
from dusttaichi.grains.kernels.store import (
    FIRST_SPHERE,
    FIRST_WALL,
    GRAINS,
    PAIRS,
    WALL_BLOCKS,
    capacity,
    sphere_capacity,
)
from dusttaichi.grains.kernels.wall_search import force_sums

# columns of a grain sum; kinetic energies of v, w at the time of the positions; what they exceed
# m v(n-1/2).v(n+1/2)/2 by, the kinetic energy whose change in a step is the work of the mean force
LINEAR, ANGULAR, FASTEST, FASTEST_SPIN, KICK = range(5)


class Columns:
    """Columns of a contact sum.

    Potential energies; energies of the present step that belong to the time before, by channel;
    counts and extremes; power of the faces of the cell.
    """

    def __init__(self, layout):
        potentials, channels = len(layout.model.potentials), len(layout.channels)
        self.potential = slice(0, potentials)
        self.pending = slice(potentials, potentials + channels)
        self.contacts = potentials + channels
        self.deepest, self.faces, self.strain = (self.contacts + n for n in (1, 2, 3))
        self.count = self.contacts + 4


def place_measure(grains, layout, walls):
    pair_blocks, wall_blocks = capacity(grains, layout, walls)
    columns = Columns(layout).count
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
    """Energies, counts and extremes of the contacts of one ContactPass, by tiles of a table."""

    def __init__(self, contacts, layout, table):
        self.own, self.table, self.columns = contacts, table, Columns(layout)
        self.width, self.faces = layout.width, contacts.faces
        self.potentials = len(layout.model.potentials)
        self.first_pending = self.columns.pending.start
        self.pending = tuple(
            (layout.channels.index(law.CHANNEL), law) for law in contacts.mechanics.pending
        )

    @ti.func
    def clear(self, tile):
        for n in ti.static(range(self.columns.count)):
            self.table[tile, n] = 0.0

    @ti.func
    def add(self, tile, column: ti.template(), value):
        self.table[tile, column] = self.table[tile, column] + ti.cast(value, ti.f64)

    @ti.func
    def most(self, tile, column: ti.template(), value):
        self.table[tile, column] = ti.max(self.table[tile, column], ti.cast(value, ti.f64))

    @ti.func
    def add_block(self, tile, block, dt_wide, place):
        """Add a block of contacts to its tile."""
        b, kind_numbers = block & self.own.mask, self.own.numbers.of_kind(self.own.kind)
        dt, g = ti.cast(dt_wide, self.own.real), self.own.gathered(b, place)
        for lane in range(self.width):
            k, h, p = self.own.configured(g, b, lane, kind_numbers, place)
            _, stored = self.own.mechanics.evaluate(k, h, p, self.own.gatherer.strength(place))
            for n in ti.static(range(self.potentials)):
                self.add(tile, n, stored[n])
            force = self.own.rows.force(b, lane)
            for channel, law in ti.static(self.pending):
                value = law.pending(k, h, p, dt, force.dot(k.normal))
                self.add(tile, self.first_pending + channel, value)
            self.add(tile, self.columns.contacts, k.now)
            # of the surfaces, which softened contacts do not wait for
            overlap = k.overlap - (p.touch - p.r1 - p.r2)
            self.most(tile, self.columns.deepest, k.now * overlap)
            # the smaller radius; on a wall inv_r2 is 0
            strain = k.now * overlap * ti.max(p.inv_r1, p.inv_r2)
            self.most(tile, self.columns.strain, strain)
            if ti.static(self.faces):
                power = self.own.gatherer.power_of_faces(g, lane, force, place)
                self.add(tile, self.columns.faces, power)


def make_measure(fields, sums, layout, phases):
    """Kernels that fill `sums`: grains, pairs, walls and sphere.

    grains(mass, inertia, kick, turn), pairs(step, dt), and, or None, walls(box, time, dt) and
    sphere(step, dt). Where grains have masses of their own (layout.polydisperse) mass and inertia
    are units of them.
    """
    measure_walls = make_measure_walls(fields, sums, layout, phases) if phases.walls else None
    measure_pairs, measure_sphere = make_measure_pairs(fields, sums, layout, phases)
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


def make_measure_pairs(fields, sums, layout, phases):
    """Kernels of the sums over contacts between grains, and over those with the sphere (or None).

    The latter with the loads on it.
    """
    W, T = layout.width, layout.tile
    counts, frame = fields["counts"], phases.frame
    pairs = ContactSums(phases.pairs, layout, sums["pair_sum"])

    @ti.kernel
    def measure_pairs(step: ti.i64, dt: ti.f64):
        for tile in range(whole(counts[PAIRS], W * T)):
            pairs.clear(tile)
            here = frame(step, dt)
            for block in range(tile * T, (tile + 1) * T):
                pairs.add_block(tile, block, dt, here)

    if not layout.sphere:
        return measure_pairs, None
    sphere, sphere_load = phases.sphere, sums["sphere_load"]
    on_sphere = ContactSums(phases.on_sphere, layout, sums["sphere_sum"])
    load_sums = BlockSums(6)

    @ti.kernel
    def measure_sphere(step: ti.i64, dt: ti.f64):
        for tile in range(sphere.tiles()):
            on_sphere.clear(tile)
            here, first = frame(step, dt), counts[FIRST_SPHERE]
            for block in range(first + tile * T, first + (tile + 1) * T):
                on_sphere.add_block(tile, block, dt, here)
        if ti.static(on_device()):
            ti.loop_config(block_dim=THREADS)
            for t in range(THREADS):
                total = load_sums.total(sphere.share(t, THREADS), t)
                if t < 6:
                    sphere_load[t] = total
        else:
            for _ in range(1):
                force, torque = sphere.loads()
                for k in ti.static(range(3)):
                    sphere_load[k], sphere_load[3 + k] = force[k], torque[k]

    return measure_pairs, measure_sphere


def make_measure_walls(fields, sums, layout, phases):
    """Kernel of the sums over contacts with walls, and of the force of each wall."""
    W, T, load = layout.width, layout.tile, fields["load"]
    counts, wall_force = fields["counts"], sums["wall_force"]
    wall_of, walls = fields["wall_of"], ContactSums(phases.walls, layout, sums["wall_sum"])
    forces = force_sums(fields, layout)

    @ti.kernel
    def measure_walls(box: Walls, time: ti.f64, dt: ti.f64):
        for tile in range(whole(counts[WALL_BLOCKS], T)):
            walls.clear(tile)
            for c in range(tile * T, ti.min((tile + 1) * T, counts[WALL_BLOCKS])):
                plane = walls.own.gatherer.plane(c, box, time)
                walls.add_block(tile, counts[FIRST_WALL] + c, dt, plane)
        if ti.static(on_device()):
            ti.loop_config(block_dim=THREADS)
            for t in range(6 * THREADS):
                wall, thread = t // THREADS, t % THREADS
                total = forces.of_wall(wall, thread)
                if thread < 3:
                    wall_force[wall, thread] = total
        else:
            for n, a in ti.ndrange(6, 3):
                force = ti.cast(0.0, ti.f64)
                for c in range(counts[WALL_BLOCKS]):
                    if wall_of[c] == n:
                        for k in range(W):
                            force += ti.cast(load[counts[FIRST_WALL] + c, a, k], ti.f64)
                wall_force[n, a] = force

    return measure_walls
