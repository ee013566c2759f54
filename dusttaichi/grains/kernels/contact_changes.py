"""Contacts that form and that break, and the losses that this books."""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.contact_rows import Rows
from dusttaichi.physics.contact.kinematics import point_as_kept

FORMING, BREAKING = range(2)  # channels of the ledger that belong to no single effect


@ti.data_oriented
class ContactChanges:
    """The contacts of one gatherer, as they change from one step to the next."""

    def __init__(self, fields, layout, mechanics, gatherer):
        self.rows, self.mechanics, self.gatherer = Rows(fields, layout), mechanics, gatherer
        self.numbers, self.contact_kind = gatherer.numbers, gatherer.contact_kind
        self.flat = gatherer.flat
        self.width, self.mask, self.dtype = layout.width, layout.mask, layout.law
        self.ledger, self.forming = layout.ledger, mechanics.forming
        self.prefix = "wall_" if gatherer.flat else ""  # of the names of its sums by tile
        self.loss, rows = fields[self.prefix + "loss"], self.rows
        # first rows of the losses that each contact keeps
        self.followed = tuple(row for row in (rows.lost, rows.recent) if row >= 0)

    @ti.func
    def change_block(self, block, tile: ti.template(), dt, kind_numbers, boundary):
        """Change the contacts of a block that have formed or broken.

        Few steps have any: so this is no part of the loop over all contacts, and gathers everything
        again.
        """
        index = block & self.mask
        gathered = ti.Vector.zero(self.dtype, ti.static(self.gatherer.columns * self.width))
        for lane in range(self.width):
            state = self.rows.table[index, self.rows.touched, lane]
            if state > 1.5 or state < -0.5:
                self.gatherer.gather(gathered, index, lane, boundary)
                self.change(gathered, index, lane, tile, dt, kind_numbers, boundary, state)

    @ti.func
    def change(
        self,
        gathered: ti.template(),
        block,
        lane,
        tile: ti.template(),
        dt,
        kind_numbers,
        boundary,
        state,
    ):
        """Losses of a contact that has formed (state 2) or broken (-1).

        Its potential, less the work of the half kick of the step. A breaking contact is evaluated
        at its position of the previous step, and its history is cleared.
        """
        constants = self.numbers.of_contact(self.contact_kind, block, lane, kind_numbers)
        motion = self.gatherer.motion(gathered, lane, dt, constants, boundary)
        history = self.rows.history(block, lane)
        motion.touched_before, motion.touches = ti.cast(0.0, self.dtype), ti.cast(1.0, self.dtype)
        if state < 0.0:
            motion.overlap += motion.speed * dt
            motion.touched_before, motion.touches = 1.0, 0.0
        elastic = self.mechanics.respond(motion, constants)
        half_kick = 0.5 * dt * motion.speed * elastic.force
        if state > 0.0:
            self.lose(tile, block, lane, FORMING, -(elastic.energy + half_kick))
            if dt > 0.0:  # contacts of the start have touched before
                self.form(block, lane, motion, history, constants, dt)
            self.rows.table[block, self.rows.touched, lane] = 1.0
        else:
            self.lose(tile, block, lane, BREAKING, elastic.energy - half_kick)
            self.release(tile, block, lane, motion, history, constants, dt, boundary)
            for row in ti.static(range(self.rows.history_rows)):
                self.rows.table[block, row, lane] = 0.0

    @ti.func
    def form(self, block, lane, motion: ti.template(), history: ti.template(), constants, dt):
        """Impulses of a first touch: forces along n_c during this step."""
        for law in ti.static(self.forming):
            force_before = self.rows.force(block, lane)
            force = force_before + motion.normal * law.form(
                motion, history, constants, dt, force_before.dot(motion.normal)
            )
            self.rows.put_force(block, lane, force)
            self.rows.write(block, lane, history, 0.0)

    @ti.func
    def release(
        self,
        tile: ti.template(),
        block,
        lane,
        motion: ti.template(),
        history: ti.template(),
        constants,
        dt,
        boundary,
    ):
        """Energy stored in the springs of a breaking contact.

        A breaking spring has done work for half a step less than its displacement implies.
        """
        strength = self.gatherer.strength(boundary)
        point_as_kept(motion, history, constants, self.flat)
        load, stored = self.mechanics.springs_of(motion, history, constants, strength)
        spun = load.torque_1.dot(motion.rotation_1) + load.torque_2.dot(motion.rotation_2)
        work = dt * load.force.dot(motion.velocity) + spun
        self.lose(tile, block, lane, BREAKING, stored.sum() + 0.5 * work)

    @ti.func
    def lose(self, tile: ti.template(), block, lane, channel: ti.template(), value):
        if ti.static(self.ledger):
            self.add_loss(tile, channel, value)
        self.follow(block, lane, channel, value)

    @ti.func
    def add_loss(self, tile: ti.template(), channel: ti.template(), value):
        self.loss[tile, channel] = self.loss[tile, channel] + ti.cast(value, ti.f64)

    @ti.func
    def follow(self, block, lane, channel: ti.template(), value):
        for first in ti.static(self.followed):
            self.rows.add(block, first + channel, lane, value)
