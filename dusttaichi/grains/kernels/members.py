"""Members: independent pairs of bodies side by side in one simulation, none of which sees another.

The positions of a member are about an origin of its own, so that all its numbers have the bits that
they have alone; only the cells of the search are apart.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import count_blocks
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.grain_pass import GrainLoads
from dusttaichi.grains.kernels.measure import (
    ANGULAR,
    FASTEST,
    FASTEST_SPIN,
    KICK,
    LINEAR,
    Columns,
    ContactSums,
    RowSums,
)

# further columns of the sums over a body: mass, and mass times place and velocity
MASS, PLACE, VELOCITY = 5, 6, 9
BODY_COLUMNS = 12


def place_member_sums(grains, layout):
    """Fields of the sums over bodies (two of each member) and over the contacts of members.

    fragment: a number of each grain, the same for all that contacts connect.
    """
    members = grains // 2 + 1
    return {
        "member_loss": ti.field(ti.f64, shape=(members, len(layout.channels))),
        "body_sum": ti.field(ti.f64, shape=(2 * members, BODY_COLUMNS)),
        "member_sum": ti.field(ti.f64, shape=(members, Columns(layout).count)),
        "fragment": ti.field(ti.i32, shape=grains),
    }


def make_stand_apart(fields, scratch):
    """Function `stand_apart(g)`: where the search sees grain g."""
    x, origin, apart = fields["x"], fields["origin"], scratch["apart"]

    @ti.func
    def stand_apart(g):
        apart[g] = ti.cast(x[g], ti.f64) + origin[g]

    return stand_apart


@ti.data_oriented
class BodySums(RowSums):
    """Kinetic energies, extremes and motion of the two bodies of each member."""

    def __init__(self, fields, layout, table):
        super().__init__(table)
        self.x, self.v, self.w, self.body = (fields[name] for name in ("x", "v", "w", "body"))
        self.masses, self.inertias = fields.get("mass"), fields.get("inertia")
        self.polydisperse, self.loads = layout.polydisperse, GrainLoads(fields, layout)

    @ti.func
    def add_grain(self, member, grain, mass, inertia, half_kick, half_turn):
        row, grain_mass, grain_inertia = 2 * member + (self.body[grain] & 1), mass, inertia
        force, torque = self.loads.total(grain)
        kick, turn = half_kick * force, half_turn * torque
        if ti.static(self.polydisperse):
            grain_mass, grain_inertia = mass * self.masses[grain], inertia * self.inertias[grain]
            kick, turn = kick / self.masses[grain], turn / self.inertias[grain]
        velocity, spin = self.v[grain] + kick, self.w[grain] + turn
        self.add(row, LINEAR, 0.5 * grain_mass * velocity.dot(velocity))
        self.add(row, ANGULAR, 0.5 * grain_inertia * spin.dot(spin))
        self.most(row, FASTEST, velocity.norm())
        self.most(row, FASTEST_SPIN, spin.norm())
        self.add(row, KICK, 0.5 * (grain_mass * kick.dot(kick) + grain_inertia * turn.dot(turn)))
        self.add(row, MASS, grain_mass)
        for axis in ti.static(range(3)):
            self.add(row, PLACE + axis, grain_mass * self.x[grain][axis])
            self.add(row, VELOCITY + axis, grain_mass * velocity[axis])


@ti.data_oriented
class MemberLosses:
    """Losses of members by channel: those up to the last search and those since."""

    def __init__(self, fields, layout, table):
        self.table, self.first, self.width = table, fields["member_first"], layout.width
        self.grain_loss, self.contact = fields["grain_loss"], fields["contact"]
        self.recent, self.channels = layout.rows["recent"][0], len(layout.channels)

    @ti.func
    def sum_up(self, member, begin, end):
        """Fill the row of a member, whose pairs are those from `begin` to before `end`."""
        for channel in range(self.channels):
            lost = ti.cast(0.0, ti.f64)
            for grain in range(self.first[member], self.first[member + 1]):
                lost += self.grain_loss[grain, channel]
            for pair in range(begin, end):
                block, lane = pair // self.width, pair % self.width
                lost += ti.cast(self.contact[block, self.recent + channel, lane], ti.f64)
            self.table[member, channel] = lost


@ti.data_oriented
class MemberFragments:
    """Fragments of members: of each grain the first one that contacts connect it with."""

    def __init__(self, fields, layout, table):
        self.table, self.first, self.width = table, fields["member_first"], layout.width
        self.i, self.j, self.contact = fields["pair_i"], fields["pair_j"], fields["contact"]
        self.touched = layout.rows["touched"][0]

    @ti.func
    def find_root(self, grain):
        while self.table[grain] != grain:
            grain = self.table[grain]
        return grain

    @ti.func
    def connect(self, member, begin, end):
        """Fill the rows of a member's grains, whose pairs are those from `begin` to before `end`.

        That of its first grain is -1 where grains of another member are among its contacts.
        """
        low, behind, is_strange = self.first[member], self.first[member + 1], 0
        for grain in range(low, behind):
            self.table[grain] = grain
        for pair in range(begin, end):
            block, lane = pair // self.width, pair % self.width
            if self.contact[block, self.touched, lane] > 0.5:
                i, j = self.i[block, lane], self.j[block, lane]
                if ti.min(i, j) < low or ti.max(i, j) >= behind:
                    is_strange = 1
                else:
                    a, b = self.find_root(i), self.find_root(j)
                    self.table[ti.max(a, b)] = ti.min(a, b)
        for grain in range(low, behind):  # what its row refers to is before it
            self.table[grain] = self.table[self.table[grain]]
        if is_strange == 1:
            self.table[low] = -1


def make_measure_members(fields, sums, layout, contacts):
    """Kernels that fill the sums of the members that are `due`, by name.

    measure_bodies(members, mass, inertia, kick, turn): as measure_grains of kernels.measure.
    measure_members(members, step, dt, box): of their contacts, a ContactPass, where `due` is 2.
    """
    first, is_due, pair_start = fields["member_first"], fields["due"], fields["pair_start"]
    of_bodies = BodySums(fields, layout, sums["body_sum"])
    of_contacts = ContactSums(contacts, layout, sums["member_sum"])
    losses = MemberLosses(fields, layout, sums["member_loss"])
    fragments = MemberFragments(fields, layout, sums["fragment"])
    gatherer, width = contacts.gatherer, layout.width

    @ti.kernel
    def measure_bodies(
        members: ti.i32, mass: ti.f64, inertia: ti.f64, half_kick: ti.f64, half_turn: ti.f64
    ):
        for member in range(members):
            if is_due[member] > 0:
                for body in range(2):
                    of_bodies.clear(2 * member + body)
                for grain in range(first[member], first[member + 1]):
                    of_bodies.add_grain(member, grain, mass, inertia, half_kick, half_turn)

    @ti.kernel
    def measure_members(members: ti.i32, step: ti.i64, dt: ti.f64, box: Walls):
        for member in range(members):
            if is_due[member] == 2:
                of_contacts.clear(member)
                begin, end = pair_start[first[member]], pair_start[first[member + 1]]
                losses.sum_up(member, begin, end)
                fragments.connect(member, begin, end)
                for block in range(begin // width, count_blocks(end, width)):
                    boundary = gatherer.place_at_step(block, step, dt, box)
                    of_contacts.add_lanes(
                        member, block, dt, boundary, begin - block * width, end - block * width
                    )

    return {"measure_bodies": measure_bodies, "measure_members": measure_members}
