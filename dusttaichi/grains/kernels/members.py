"""Members: independent pairs of bodies side by side in one simulation, none of which sees another.

The positions of a member are about an origin of its own, so that all its numbers have the bits that
they have alone; only the cells of the search stand apart.
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
    first, due, total = fields["member_first"], fields["due"], make_gather(fields, layout)
    masses, inertias = fields.get("mass"), fields.get("inertia")
    pair_start, W, table = fields["pair_start"], layout.width, sums["body_sum"]
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
    def add_grain(g, row, mass, inertia, half_kick, half_turn):
        m, i = mass, inertia
        force, torque = total(g)
        kick, turn = half_kick * force, half_turn * torque
        if ti.static(layout.polydisperse):
            m, i = mass * masses[g], inertia * inertias[g]
            kick, turn = kick / masses[g], turn / inertias[g]
        now, spin = v[g] + kick, w[g] + turn
        add(row, LINEAR, 0.5 * m * now.dot(now))
        add(row, ANGULAR, 0.5 * i * spin.dot(spin))
        most(row, FASTEST, now.norm())
        most(row, FASTEST_SPIN, spin.norm())
        add(row, KICK, 0.5 * (m * kick.dot(kick) + i * turn.dot(turn)))
        add(row, MASS, m)
        for a in ti.static(range(3)):
            add(row, PLACE + a, m * x[g][a])
            add(row, VELOCITY + a, m * now[a])

    @ti.func
    def sum_losses(m, begin, end):
        """Sum the losses of a member: those up to the last search and those since."""
        for n in range(channels):
            lost = ti.cast(0.0, ti.f64)
            for g in range(first[m], first[m + 1]):
                lost += grain_loss[g, n]
            for c in range(begin, end):
                lost += ti.cast(contact[c // W, recent + n, c % W], ti.f64)
            loss[m, n] = lost

    @ti.kernel
    def measure_bodies(
        members: ti.i32, mass: ti.f64, inertia: ti.f64, half_kick: ti.f64, half_turn: ti.f64
    ):
        for m in range(members):
            if due[m] == 1:
                for n in range(2 * BODY_COLUMNS):
                    table[2 * m + n // BODY_COLUMNS, n % BODY_COLUMNS] = 0.0
                for g in range(first[m], first[m + 1]):
                    row = 2 * m + (body[g] & 1)
                    add_grain(g, row, mass, inertia, half_kick, half_turn)

    @ti.kernel
    def measure_members(members: ti.i32, step: ti.i64, dt: ti.f64, box: Walls):
        for m in range(members):
            if due[m] == 1:
                of_contacts.clear(m)
                begin, end = pair_start[first[m]], pair_start[first[m + 1]]
                sum_losses(m, begin, end)
                for block in range(begin // W, count_blocks(end, W)):
                    place = gatherer.now(block, step, dt, box)
                    of_contacts.add_lanes(m, block, dt, place, begin - block * W, end - block * W)

    return {"measure_bodies": measure_bodies, "measure_members": measure_members}
