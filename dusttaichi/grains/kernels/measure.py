"""Sums over the state at an output: energies, contacts, extremes.

Partial sums by tile and chunk, added up by NumPy in their order, so that the result does not depend
on the threads.
"""

from dusttaichi.compute.device_blocks import THREADS, BlockSums, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, count_blocks
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.grain_pass import GrainLoads
from dusttaichi.grains.kernels.outside_kick import (
    ACCELERATION,
    ENERGIES,
    TURNING,
    OutsideKick,
    place_forces,
)
from dusttaichi.grains.kernels.store import GRAINS, SPHERE, capacity, sphere_capacity

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
    if layout.curved:
        sums["surface_load"] = ti.field(ti.f64, shape=(wall_blocks, layout.impulses))
    if layout.sphere:
        tiles = sphere_capacity(grains, layout) // layout.tile
        sums["sphere_sum"] = ti.field(ti.f64, shape=(tiles, columns))
        sums["sphere_load"] = ti.field(ti.f64, shape=6)
    if layout.forces:
        sums |= place_forces(grains + SPHERE + layout.sphere, layout)
    return sums


@ti.data_oriented
class RowSums:
    """Sums in the rows of a table, to each of which one thread adds."""

    def __init__(self, table):
        self.table, self.row_length = table, table.shape[1]

    @ti.func
    def clear(self, row):
        for n in ti.static(range(self.row_length)):
            self.table[row, n] = 0.0

    @ti.func
    def add(self, row, column: ti.template(), value):
        self.table[row, column] = self.table[row, column] + ti.cast(value, ti.f64)

    @ti.func
    def most(self, row, column: ti.template(), value):
        self.table[row, column] = ti.max(self.table[row, column], ti.cast(value, ti.f64))


@ti.data_oriented
class ContactSums(RowSums):
    """Energies, counts and extremes of the contacts of one ContactPass, by tiles of a table."""

    def __init__(self, contacts, layout, table):
        super().__init__(table)
        self.contacts, self.columns = contacts, Columns(layout)
        self.width, self.faces = layout.width, contacts.faces
        self.potentials = len(layout.model.potentials)
        self.first_pending = self.columns.pending.start
        self.pending = tuple(
            (layout.channels.index(law.CHANNEL), law) for law in contacts.mechanics.pending
        )

    @ti.func
    def add_block(self, tile, block, dt_wide, boundary):
        """Add a block of contacts to its tile."""
        self.add_lanes(tile, block, dt_wide, boundary, 0, self.width)

    @ti.func
    def add_lanes(self, tile, block, dt_wide, boundary, begin, end):
        """Add the lanes of a block from `begin` to before `end`, as far as it has them."""
        index, kind_numbers = (
            block & self.contacts.mask,
            self.contacts.block_numbers(boundary),
        )
        dt, gathered = (
            ti.cast(dt_wide, self.contacts.dtype),
            self.contacts.gather_block(index, boundary),
        )
        for lane in range(ti.max(0, begin), ti.min(self.width, end)):
            motion, history, constants = self.contacts.read_configuration(
                gathered, index, lane, kind_numbers, boundary
            )
            _, stored = self.contacts.mechanics.evaluate(
                motion, history, constants, self.contacts.gatherer.strength(boundary)
            )
            for n in ti.static(range(self.potentials)):
                self.add(tile, n, stored[n])
            force = self.contacts.rows.force(index, lane)
            for channel, law in ti.static(self.pending):
                value = law.pending(motion, history, constants, dt, force.dot(motion.normal))
                self.add(tile, self.first_pending + channel, value)
            self.add(tile, self.columns.contacts, motion.touches)
            # of the surfaces; softened contacts form before these meet
            overlap = motion.overlap - (constants.touch - constants.r1 - constants.r2)
            self.most(tile, self.columns.deepest, motion.touches * overlap)
            # the smaller radius; on a wall inv_r2 is 0
            strain = motion.touches * overlap * ti.max(constants.inv_r1, constants.inv_r2)
            self.most(tile, self.columns.strain, strain)
            if ti.static(self.faces):
                power = self.contacts.gatherer.power_of_faces(gathered, lane, force, boundary)
                self.add(tile, self.columns.faces, power)


def make_measure(fields, sums, layout, phases):
    """Kernels that fill `sums`, by name: of the grains and of each kind of contact of the scene.

    measure_grains(mass, inertia, kick, turn): where grains have masses of their own
    (layout.polydisperse) mass and inertia are units of them. measure_pairs, measure_walls and
    measure_sphere(step, dt, box): the last one with the load on the sphere. measure_surfaces(step,
    dt, box): loads of surfaces by blocks. evaluate_forces: see make_evaluate_forces.
    """
    out = {"measure_grains": make_measure_grains(fields, sums, layout)}
    out["measure_pairs"] = make_measure_contacts(phases.pairs, layout, sums["pair_sum"])
    if phases.walls is not None:
        out["measure_walls"] = make_measure_contacts(phases.walls, layout, sums["wall_sum"])
    if layout.curved:
        out["measure_surfaces"] = make_measure_surfaces(phases.walls, sums["surface_load"])
    if phases.on_sphere is not None:
        loads = make_sphere_load(phases.sphere, sums)
        on_sphere = make_measure_contacts(phases.on_sphere, layout, sums["sphere_sum"], loads)
        out["measure_sphere"] = on_sphere
    if layout.forces:
        out["evaluate_forces"] = make_evaluate_forces(fields, sums, layout)
    return out


def make_measure_grains(fields, sums, layout):
    """Kernel of the sums over grains."""
    v, w, counts, grain_sum = fields["v"], fields["w"], fields["counts"], sums["grain_sum"]
    loads = GrainLoads(fields, layout)
    masses, inertias = fields.get("mass"), fields.get("inertia")
    forces = OutsideKick(fields, layout)

    @ti.func
    def own(table: ti.template(), grain):
        """Mass or moment of inertia of a grain in units of the kernel's."""
        out = ti.cast(1.0, ti.f64)
        if ti.static(layout.polydisperse):
            out = table[grain]
        return out

    @ti.kernel
    def measure_grains(
        mass: ti.f64, inertia: ti.f64, half_kick: ti.f64, half_turn: ti.f64, step: ti.i64
    ):
        grains = counts[GRAINS]
        for chunk in range(count_blocks(grains, CHUNK)):
            zero = ti.cast(0.0, ti.f64)
            linear, angular, fastest, spin = zero, zero, zero, zero
            kicked, turned = zero, zero
            for grain in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, grains)):
                unit_mass, unit_inertia = own(masses, grain), own(inertias, grain)
                force, torque = loads.total(grain)
                force, torque = loads.add_push(grain, force, torque)
                kick, turn = half_kick * (force / unit_mass), half_turn * (torque / unit_inertia)
                if ti.static(bool(layout.forces)):
                    at, weight = forces.of_grain(grain, step), forces.weight_of(grain)
                    half = half_kick * mass
                    outside, turning_outside = forces.solve(at, weight, kick, turn, half)
                    kick += half * outside
                    turn += half * turning_outside
                v_now, turning = v[grain] + kick, w[grain] + turn
                linear += unit_mass * v_now.dot(v_now)
                angular += unit_inertia * turning.dot(turning)
                kicked += unit_mass * kick.dot(kick)
                turned += unit_inertia * turn.dot(turn)
                fastest = ti.max(fastest, v_now.dot(v_now))
                spin = ti.max(spin, turning.dot(turning))
            grain_sum[chunk, LINEAR] = 0.5 * mass * linear
            grain_sum[chunk, ANGULAR] = 0.5 * inertia * angular
            grain_sum[chunk, FASTEST] = ti.sqrt(fastest)
            grain_sum[chunk, FASTEST_SPIN] = ti.sqrt(spin)
            grain_sum[chunk, KICK] = 0.5 * (mass * kicked + inertia * turned)

    return measure_grains


def make_evaluate_forces(fields, sums, layout):
    """Kernel `evaluate_forces(step, half, present, kick, turn)`: fills `force_now`.

    present: 1 where velocities and spins in memory are those of the positions, 0 where they are
    half a step back. kick, turn: changes of velocity and spin of the sphere in half a step by its
    contacts.
    """
    out, forces = sums["force_now"], OutsideKick(fields, layout)
    loads = GrainLoads(fields, layout)
    counts, model, laws = fields["counts"], layout.forces, forces.laws
    v, w = fields["v"], fields["w"]
    vector = ti.types.vector(3, ti.f64)
    first_power = ENERGIES + len(model.potentials)

    @ti.func
    def write(body, at: ti.template(), weight, kick, turn, half):
        linear, angular = forces.solve(at, weight, kick, turn, half)
        for number in ti.static(range(3)):
            out[body, ACCELERATION + number], out[body, TURNING + number] = (
                linear[number],
                angular[number],
            )
        for number in ti.static(range(len(model.potentials))):
            out[body, ENERGIES + number] = weight * laws.potential(number, at)
        for number in ti.static(range(len(model.powers))):
            back, turned = ti.cast(v[body], ti.f64), ti.cast(w[body], ti.f64)
            out[body, first_power + number] = half * weight * laws.power(number, at, back, turned)

    @ti.kernel
    def evaluate_forces(step: ti.i64, half: ti.f64, present: ti.i32, kick: vector, turn: vector):
        for grain in range(counts[GRAINS]):
            at = forces.of_grain(grain, step)
            force, torque = loads.total(grain)
            force, torque = loads.add_push(grain, force, torque)
            half_step = ti.select(present == 1, 0.0, half)
            linear = ti.cast(half_step / at.mass * force, ti.f64)
            angular = ti.cast(half_step / at.inertia * torque, ti.f64)
            write(grain, at, forces.weight_of(grain), linear, angular, half_step)
        if ti.static(layout.sphere):
            for _ in range(1):
                half_step = ti.select(present == 1, 0.0, half)
                at, weight = forces.of_sphere(step), forces.weight_of_sphere()
                write(counts[GRAINS] + SPHERE, at, weight, kick, turn, half_step)

    return evaluate_forces


def make_measure_contacts(contacts, layout, table, loads=None):
    """Kernel of the sums over contacts of a kind. loads(): function called behind the loop."""
    sums, gatherer = ContactSums(contacts, layout, table), contacts.gatherer
    has_loads = loads is not None

    @ti.kernel
    def measure_contacts(step: ti.i64, dt: ti.f64, box: Walls):
        for tile in range(contacts.tiles()):
            sums.clear(tile)
            first, last = contacts.span(tile)
            for block in range(first, last):
                sums.add_block(tile, block, dt, gatherer.place_at_step(block, step, dt, box))
        if ti.static(has_loads):
            loads()

    return measure_contacts


def make_measure_surfaces(contacts, table):
    """Kernel of the loads of surfaces on the grains now: a row of `table` for each wall block."""
    gatherer, components = contacts.gatherer, table.shape[1]

    @ti.kernel
    def measure_surfaces(step: ti.i64, dt: ti.f64, box: Walls):
        for number in range(contacts.blocks()):
            block = contacts.first() + number
            boundary = gatherer.place_at_step(block, step, dt, box)
            total = gatherer.load_of_block(block & contacts.mask, boundary)
            for component in ti.static(range(components)):
                table[number, component] = total[component]

    return measure_surfaces


def make_sphere_load(sphere, sums):
    """Function that writes the load on the sphere."""
    sphere_load, block_sums = sums["sphere_load"], BlockSums(6)

    @ti.func
    def write_load():
        if ti.static(on_device()):
            ti.loop_config(block_dim=THREADS)
            for thread in range(THREADS):
                total = block_sums.total(sphere.loads_of_thread(thread, THREADS), thread)
                if thread < 6:
                    sphere_load[thread] = total
        else:
            for _ in range(1):
                force, torque = sphere.loads()
                for k in ti.static(range(3)):
                    sphere_load[k], sphere_load[3 + k] = force[k], torque[k]

    return write_load
