"""Members: independent pairs of bodies side by side in one simulation, none of which sees another.

The positions of a member are about an origin of its own, so that all its numbers have the bits that
they have alone; only the cells of the search are apart.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import count_blocks
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.grain_pass import make_gather
from dusttaichi.grains.kernels.measure import (
    ANGULAR,
    FASTEST,
    FASTEST_SPIN,
    KICK,
    LINEAR,
    Columns,
    ContactSums,
)

# further columns of the sums over a body: mass, and mass times place and velocity
MASS, PLACE, VELOCITY = 5, 6, 9
BODY_COLUMNS = 12


def place_member_sums(grains, layout):
    """Fields of the sums over bodies (two of each member) and over the contacts of members."""
    members = grains // 2 + 1
    return {
        "member_loss": ti.field(ti.f64, shape=(members, len(layout.channels))),
        "body_sum": ti.field(ti.f64, shape=(2 * members, BODY_COLUMNS)),
        "member_sum": ti.field(ti.f64, shape=(members, Columns(layout).count)),
    }


def make_stand_apart(fields, scratch):
    """Function `stand_apart(g)`: where the search sees grain g."""
    x, origin, apart = fields["x"], fields["origin"], scratch["apart"]

    @ti.func
    def stand_apart(g):
        apart[g] = ti.cast(x[g], ti.f64) + origin[g]

    return stand_apart


def make_measure_members(fields, sums, layout, contacts):
    """Kernels that fill the sums of the members whose `due` is 1, by name.

    measure_bodies(members, mass, inertia, kick, turn): as measure_grains of kernels.measure.
    measure_members(members, step, dt, box): of their contacts, a ContactPass.
    """
    v, w, x, body = fields["v"], fields["w"], fields["x"], fields["body"]
    first, is_due, total = fields["member_first"], fields["due"], make_gather(fields, layout)
    masses, inertias = fields.get("mass"), fields.get("inertia")
    pair_start, width, table = fields["pair_start"], layout.width, sums["body_sum"]
    of_contacts = ContactSums(contacts, layout, sums["member_sum"])
    gatherer, loss, grain_loss = contacts.gatherer, sums["member_loss"], fields["grain_loss"]
    contact, recent = fields["contact"], layout.rows["recent"][0]
    channels = len(layout.channels)

    @ti.func
    def add(row, column, value):
        table[row, column] = table[row, column] + ti.cast(value, ti.f64)

    @ti.func
    def most(row, column, value):
        table[row, column] = ti.max(table[row, column], ti.cast(value, ti.f64))

    @ti.func
    def add_grain(grain, row, mass, inertia, half_kick, half_turn):
        grain_mass, grain_inertia = mass, inertia
        force, torque = total(grain)
        kick, turn = half_kick * force, half_turn * torque
        if ti.static(layout.polydisperse):
            grain_mass, grain_inertia = mass * masses[grain], inertia * inertias[grain]
            kick, turn = kick / masses[grain], turn / inertias[grain]
        velocity, spin = v[grain] + kick, w[grain] + turn
        add(row, LINEAR, 0.5 * grain_mass * velocity.dot(velocity))
        add(row, ANGULAR, 0.5 * grain_inertia * spin.dot(spin))
        most(row, FASTEST, velocity.norm())
        most(row, FASTEST_SPIN, spin.norm())
        add(row, KICK, 0.5 * (grain_mass * kick.dot(kick) + grain_inertia * turn.dot(turn)))
        add(row, MASS, grain_mass)
        for axis in ti.static(range(3)):
            add(row, PLACE + axis, grain_mass * x[grain][axis])
            add(row, VELOCITY + axis, grain_mass * velocity[axis])

    @ti.func
    def sum_losses(member, begin, end):
        """Sum the losses of a member: those up to the last search and those since."""
        for channel in range(channels):
            lost = ti.cast(0.0, ti.f64)
            for grain in range(first[member], first[member + 1]):
                lost += grain_loss[grain, channel]
            for pair in range(begin, end):
                lost += ti.cast(contact[pair // width, recent + channel, pair % width], ti.f64)
            loss[member, channel] = lost

    @ti.kernel
    def measure_bodies(
        members: ti.i32, mass: ti.f64, inertia: ti.f64, half_kick: ti.f64, half_turn: ti.f64
    ):
        for member in range(members):
            if is_due[member] == 1:
                for n in range(2 * BODY_COLUMNS):
                    table[2 * member + n // BODY_COLUMNS, n % BODY_COLUMNS] = 0.0
                for grain in range(first[member], first[member + 1]):
                    row = 2 * member + (body[grain] & 1)
                    add_grain(grain, row, mass, inertia, half_kick, half_turn)

    @ti.kernel
    def measure_members(members: ti.i32, step: ti.i64, dt: ti.f64, box: Walls):
        for member in range(members):
            if is_due[member] == 1:
                of_contacts.clear(member)
                begin, end = pair_start[first[member]], pair_start[first[member + 1]]
                sum_losses(member, begin, end)
                for block in range(begin // width, count_blocks(end, width)):
                    boundary = gatherer.place_at_step(block, step, dt, box)
                    of_contacts.add_lanes(
                        member, block, dt, boundary, begin - block * width, end - block * width
                    )

    return {"measure_bodies": measure_bodies, "measure_members": measure_members}
