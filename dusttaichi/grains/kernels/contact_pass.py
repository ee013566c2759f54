"""The pass over contacts, a tile of blocks at a time.

Their motion is gathered, their history updated, their loads computed, their losses summed. One pass
for pairs, walls and the sphere.

Conditions under which LLVM turns the loop over the lanes of a block into vectors: gathers are in a
loop of their own (kernels.gather); results are stored straight into rows of the two fields of
contacts; the numbers of a contact are values, not arguments in memory; the number of a block is
masked, as Taichi's integers may overflow; sums are in a local array for each column, as LLVM
examines a hundred uses of an array at most before it takes it for one that others may know, and the
nine of the stress are values; there is no branch.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import count_blocks, first_item
from dusttaichi.grains.kernels.contact_changes import ContactChanges
from dusttaichi.grains.kernels.contact_numbers import PAIR, RIGID_SPHERE, WALL
from dusttaichi.grains.kernels.store import (
    FIRST_SPHERE,
    FIRST_WALL,
    ON_SPHERE,
    PAIRS,
    WALL_BLOCKS,
)
from dusttaichi.physics.contact.kinematics import point_as_kept

# places in `counts` of the number of contacts of a kind (of walls: blocks), and of their first
# block
PLACES = {
    PAIR: (PAIRS, None),
    RIGID_SPHERE: (ON_SPHERE, FIRST_SPHERE),
    WALL: (WALL_BLOCKS, FIRST_WALL),
}


@ti.data_oriented
class ContactPass(ContactChanges):
    """Contacts of one gatherer: their number, and their part in a step.

    Empty lanes are computed as well: their grains are far away.
    """

    def __init__(self, fields, layout, mechanics, gatherer):
        super().__init__(fields, layout, mechanics, gatherer)
        self.round = gatherer.flat and bool(layout.curved)
        self.impulses = layout.impulses
        self.counts, (self.number, self.begin) = fields["counts"], PLACES[gatherer.contact_kind]
        self.per_tile, self.per_block = layout.tile, 1 if gatherer.flat else layout.width
        self.stress, self.virial = layout.stress, fields.get(self.prefix + "virial")
        self.faces = bool(layout.periodic) and not gatherer.flat
        self.face_work, self.impulse = fields.get("face_work"), fields.get("impulse")
        channels = layout.channels
        laws = layout.model.laws
        self.channels = tuple(enumerate(channels.index(law.CHANNEL) for law in laws))
        self.radial = len(layout.model.radial)
        # columns of the local sums: losses by law, work of the faces, changes
        self.FACES = len(laws)
        self.CHANGES = self.FACES + self.faces

    # -- sizes ----------------------------------------------------------------------------------

    @ti.func
    def first(self):
        """The first block; pairs begin with block 0."""
        out = 0
        if ti.static(self.contact_kind != PAIR):
            out = self.counts[self.begin]
        return out

    @ti.func
    def blocks(self):
        """Number of blocks."""
        out = self.counts[self.number]
        if ti.static(not self.flat):
            out = count_blocks(out, self.width)
        return out

    @ti.func
    def tiles(self):
        """Number of tiles."""
        return count_blocks(self.counts[self.number], ti.static(self.per_block * self.per_tile))

    @ti.func
    def span(self, tile):
        """First block of a tile and the one behind its last."""
        first, end = tile * self.per_tile, ti.min((tile + 1) * self.per_tile, self.blocks())
        if ti.static(self.contact_kind != PAIR):
            first, end = self.first() + first, self.first() + end
        return first, end

    @ti.func
    def row(self, tile):
        """Row of a tile in the tables of sums, of which pairs and the sphere have the same."""
        out = tile
        if ti.static(self.contact_kind == RIGID_SPHERE):
            out += self.first() // self.per_tile
        return out

    # -- a tile of contacts ----------------------------------------------------------------------

    @ti.func
    def run(self, me, workers, step, numbers, box: ti.template()):
        """Compute history, loads and losses of the contacts of a worker."""
        n, dt = self.tiles(), numbers.dt
        outside = self.gatherer.outside(step, dt, box)
        for tile in range(first_item(me, workers, n), first_item(me + 1, workers, n)):
            self.tile(tile, dt, outside, dt * step)

    @ti.func
    def tile(self, number, dt_wide, outside: ti.template(), time):
        """Update the contacts of a tile and compute their loads; outside: see the gatherers."""
        first, last = self.span(number)
        tile = self.row(number)
        sums = [ti.Vector.zero(self.dtype, self.width) for _ in ti.static(range(self.CHANGES + 1))]
        virial = ti.Vector.zero(self.dtype, 9)
        constants, dt = self.numbers.of_kind(self.contact_kind), ti.cast(dt_wide, self.dtype)
        for block in range(first, last):
            place = self.gatherer.place(block, outside, time)
            if ti.static(self.round):
                self.block(sums, virial, block, dt, self.numbers_at(place), place)
            else:
                self.block(sums, virial, block, dt, constants, place)
        totals = self.totals(sums)
        if totals[self.CHANGES] > 0.0:
            for block in range(first, last):
                boundary = self.gatherer.place(block, outside, time)
                if ti.static(self.round):
                    self.change_block(block, tile, dt, self.numbers_at(boundary), boundary)
                else:
                    self.change_block(block, tile, dt, constants, boundary)
        self.add_sums(totals, virial, tile)
        if ti.static(self.flat):
            for block in range(first, last):
                if ti.static(self.round):
                    place = self.gatherer.place(block, outside, time)
                    self.add_surface_impulse(block, dt_wide, place)
                else:
                    self.add_impulse(block, dt_wide)

    @ti.func
    def add_surface_impulse(self, block, dt, place):
        """`add_impulse` where there are surfaces: with their pressing and their power."""
        index, wall_block = block & self.mask, self.gatherer.wall_block(block)
        total = self.gatherer.load_of_block(index, place)
        for a in ti.static(range(self.impulses)):
            self.impulse[wall_block, a] = self.impulse[wall_block, a] + dt * total[a]

    @ti.func
    def add_impulse(self, block, dt):
        """Sum the force of a wall on a block of contacts over time."""
        index, wall_block = block & self.mask, self.gatherer.wall_block(block)
        for a in ti.static(range(3)):
            force = ti.cast(0.0, ti.f64)
            for lane in range(self.width):
                force += ti.cast(self.rows.load[index, a, lane], ti.f64)
            self.impulse[wall_block, a] = self.impulse[wall_block, a] + dt * force

    @ti.func
    def numbers_at(self, boundary):
        """Numbers of the contacts of a block with a wall that may be a surface."""
        return self.numbers.of_kind(self.gatherer.row(boundary))

    @ti.func
    def block_numbers(self, boundary):
        """Numbers of the contacts of a block, for passes without a step."""
        if ti.static(self.round):
            return self.numbers_at(boundary)
        else:
            return self.numbers.of_kind(self.contact_kind)

    @ti.func
    def block(self, sums: ti.template(), virial: ti.template(), block, dt, constants, boundary):
        """Gather and compute a block of contacts."""
        index = block & self.mask
        gathered = ti.Vector.zero(self.dtype, ti.static(self.gatherer.columns * self.width))
        for lane in range(self.width):
            self.gatherer.gather(gathered, index, lane, boundary)
        for lane in range(self.width):
            self.contact(sums, virial, gathered, index, lane, dt, constants, boundary)

    @ti.func
    def contact(
        self,
        sums: ti.template(),
        virial: ti.template(),
        gathered: ti.template(),
        block,
        lane,
        dt,
        kind_numbers,
        boundary,
    ):
        constants = self.numbers.of_contact(self.contact_kind, block, lane, kind_numbers)
        motion = self.gatherer.motion(gathered, lane, dt, constants, boundary)
        history = self.rows.history(block, lane)
        strength = self.gatherer.strength(boundary)
        self.mechanics.touch(motion, history, constants)
        lost = self.mechanics.update(motion, history, constants, dt, self.flat)
        load, _ = self.mechanics.evaluate(motion, history, constants, strength)
        # 2 where it has formed, -1 where it has broken: see `change`
        stays = motion.touches * motion.touched_before
        formed, broken = motion.touches - stays, motion.touched_before - stays
        history.touched = motion.touches + formed - broken
        history.zeta = history.zeta + motion.normal * motion.zeta_along
        # pointers begin on the line of centres; those of a breaking contact are still needed
        self.rows.write(block, lane, history, motion.touched_before)
        self.rows.put_loads(block, lane, load)
        self.book(sums, block, lane, lost, strength)
        if ti.static(self.stress):
            # from the second body to the first; gathered numbers are not read again after a store
            branch = motion.normal * ((constants.touch - motion.overlap) * dt)
            self.add_virial(virial, branch, load.force)
        if ti.static(self.faces):
            work = dt * self.gatherer.power_of_faces(gathered, lane, load.force, boundary)
            self.add(sums, self.FACES, lane, work)
        self.add(sums, self.CHANGES, lane, formed + broken)

    @ti.func
    def book(self, sums: ti.template(), block, lane, lost, strength):
        """Add the losses of a contact to the sums, and to its own where they are followed."""
        for n, channel in ti.static(self.channels):
            value = lost[n]
            if ti.static(n >= self.radial):
                value = value * strength
            if ti.static(self.ledger):
                self.add(sums, n, lane, value)
            self.follow(block, lane, channel, value)

    @ti.func
    def add(self, sums: ti.template(), column: ti.template(), lane, value):
        sums[column][lane] = sums[column][lane] + value

    @ti.func
    def add_virial(self, virial: ti.template(), branch, force):
        """Sum branch x force (T19 eq 23)."""
        for m in ti.static(range(3)):
            for n in ti.static(range(3)):
                virial[3 * m + n] += branch[m] * force[n]

    @ti.func
    def totals(self, sums: ti.template()):
        """Sums over the lanes, by column."""
        out = ti.Vector.zero(self.dtype, ti.static(self.CHANGES + 1))
        for lane in range(self.width):
            for n in ti.static(range(self.CHANGES + 1)):
                out[n] += sums[n][lane]
        return out

    @ti.func
    def add_sums(self, totals, virial, tile):
        """Add the sums of a tile and step, in the precision of the laws, to those of all steps.

        `+=` on a field is atomic in Taichi, and slow.
        """
        if ti.static(self.ledger):
            for n, channel in ti.static(self.channels):
                self.add_loss(tile, channel, totals[n])
        if ti.static(self.stress):
            for n in ti.static(range(9)):
                value = ti.cast(virial[n], ti.f64)
                self.virial[tile, n] = self.virial[tile, n] + value
        if ti.static(self.faces):
            work = ti.cast(totals[self.FACES], ti.f64)
            self.face_work[tile] = self.face_work[tile] + work

    # -- without a step --------------------------------------------------------------------------

    @ti.func
    def read_configuration(self, gathered: ti.template(), block, lane, kind_numbers, boundary):
        """(Motion, history, numbers) of a contact as it is, without a step."""
        constants = self.numbers.of_contact(self.contact_kind, block, lane, kind_numbers)
        motion = self.gatherer.motion(gathered, lane, ti.cast(0.0, self.dtype), constants, boundary)
        history = self.rows.history(block, lane)
        self.mechanics.touch(motion, history, constants)
        self.mechanics.press(motion, constants)
        point_as_kept(motion, history, constants, self.flat)
        return motion, history, constants

    @ti.func
    def gather_block(self, block, boundary):
        """The motion of a block of contacts."""
        gathered = ti.Vector.zero(self.dtype, ti.static(self.gatherer.columns * self.width))
        for lane in range(self.width):
            self.gatherer.gather(gathered, block, lane, boundary)
        return gathered

    @ti.func
    def evaluate(self, block, boundary):
        """Loads of a block of contacts in the present configuration, with the same history."""
        index, kind_numbers = block & self.mask, self.block_numbers(boundary)
        gathered = self.gather_block(index, boundary)
        for lane in range(self.width):
            motion, history, constants = self.read_configuration(
                gathered, index, lane, kind_numbers, boundary
            )
            load, _ = self.mechanics.evaluate(
                motion, history, constants, self.gatherer.strength(boundary)
            )
            self.rows.put_loads(index, lane, load)
