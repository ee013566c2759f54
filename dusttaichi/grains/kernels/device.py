"""The step on a device: a thread for each grain, and one for each contact.

Two launches, none of which waits for the host (compute.loops): a launch finds out itself which step
it makes, and writes nothing that it reads. Blocks of threads for contacts are as long as tiles
(backend.loops_of), so that each row of a table of sums belongs to one block: what its threads sum
is added up in a fixed order (compute.device_blocks).
"""

from types import SimpleNamespace

from dusttaichi.compute.device_blocks import THREADS, BlockSums, pad_to_blocks
from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import BEGUN, DONE, DUE, HALT, STOP, Arguments, Launches, conclude
from dusttaichi.compute.scan import CHUNK
from dusttaichi.compute.taichi_internals.launching import LOOK
from dusttaichi.grains.kernels.contact_pass import ContactPass
from dusttaichi.grains.kernels.store import GRAINS


@ti.data_oriented
class ContactThreads(ContactPass):
    """The pass over contacts by a thread for each of them.

    Its sums are losses by channel, branch x force (9 numbers), work of the faces of the cell.
    """

    def __init__(self, fields, layout, mechanics, gatherer):
        super().__init__(fields, layout, mechanics, gatherer)
        if layout.width != 1:
            raise ValueError("a thread of a device has one contact")
        self.LOSSES = len(layout.channels) * layout.ledger
        self.WORK = self.LOSSES + 9 * layout.stress
        self.SUMS = self.WORK + bool(layout.periodic)

    @ti.func
    def add_loss(self, block_sums: ti.template(), channel: ti.template(), value):
        block_sums[channel] = block_sums[channel] + ti.cast(value, ti.f64)

    @ti.func
    def thread(self, block_sums: ti.template(), block, dt_wide, boundary):
        """The contact of a block, which has one; its sums are added to `block_sums`."""
        sums = [ti.Vector.zero(self.dtype, self.width) for _ in ti.static(range(self.CHANGES + 1))]
        virial = ti.Vector.zero(self.dtype, 9)
        constants, dt = self.block_numbers(boundary), ti.cast(dt_wide, self.dtype)
        self.block(sums, virial, block, dt, constants, boundary)
        totals = self.totals(sums)
        if ti.static(self.ledger):
            for n, channel in ti.static(self.channels):
                self.add_loss(block_sums, channel, totals[n])
        if ti.static(self.stress):
            for n in ti.static(range(9)):
                block_sums[self.LOSSES + n] = ti.cast(virial[n], ti.f64)
        if ti.static(self.faces):
            block_sums[self.WORK] = ti.cast(totals[self.FACES], ti.f64)
        if totals[self.CHANGES] > 0.0:
            # numbers are read again: to keep them takes registers of every thread
            again = self.block_numbers(boundary)
            self.change_block(block, block_sums, dt, again, boundary)
        if ti.static(self.round):
            self.add_surface_impulse(block, dt_wide, boundary)
        elif ti.static(self.flat):
            self.add_impulse(block, dt_wide)

    @ti.func
    def put(self, tile, number, total):
        """Add a sum over a block of threads to the row of its tile."""
        if number < self.LOSSES:
            self.loss[tile, number] = self.loss[tile, number] + total
        if ti.static(self.stress):
            if number >= self.LOSSES and number < self.WORK:
                n = number - self.LOSSES
                self.virial[tile, n] = self.virial[tile, n] + total
        if ti.static(self.faces):
            if number == self.WORK:
                self.face_work[tile] = self.face_work[tile] + total


@ti.data_oriented
class Threads:
    """Work of a thread on its grain, its contact, its share of the contacts with the sphere.

    phases: Phases of the same scene. frames, rates, planes: fields of cell and walls at the next
    steps.
    """

    def __init__(self, phases, layout, frames, rates, planes):
        self.phases, self.layout, self.counts = phases, layout, phases.counts
        self.frames, self.rates, self.planes = frames, rates, planes
        self.tilted, self.periodic, self.stress = layout.tilted, layout.periodic, layout.stress
        # blocks of a scene with stress are as long as the chunks of its sums
        self.grain_block = CHUNK if layout.stress else THREADS
        self._grain_sums = BlockSums(6, CHUNK) if layout.stress else None
        self._flux_table = phases.fields.get("flux")
        self.contacts = tuple(enumerate(phases.contacts))
        self.sums = phases.pairs.SUMS
        self._contact_sums = BlockSums(self.sums, layout.tile) if self.sums else None

    @ti.func
    def grain(self, grain, row, step, numbers):
        """Kick and drift a grain from a step to the next; 1 if a search is due. row: of `rates`."""
        is_due, thread = 0, grain % self.grain_block
        if grain - thread < self.counts[GRAINS]:  # the same for all threads of a block
            flux = ti.Vector.zero(ti.f64, 6)
            if grain < self.counts[GRAINS]:
                n = numbers
                is_due, position, velocity = self.phases.grains.move(
                    grain, n.kick, n.turn, n.dt, n.reach2, step
                )
                if ti.static(self.stress):
                    rate = ti.Vector([self.rates[row, k] for k in ti.static(range(4))])
                    flux = self.phases.flux.of_grain(grain, position, velocity, n.dt, rate)
            if ti.static(self.stress):
                total, at = self._grain_sums.total(flux, thread), grain // CHUNK
                if thread < 6:
                    self._flux_table[at, thread] = self._flux_table[at, thread] + numbers.dt * total
        return is_due

    @ti.func
    def frame(self, row):
        """The frame of the cell (kernels.cell_kinematics) at the step of that row of `frames`."""
        out = ti.Matrix.zero(ti.f64, 3, 3 + self.tilted)
        if ti.static(len(self.periodic) > 0):
            for m in ti.static(range(3)):
                for n in ti.static(range(3 + self.tilted)):
                    out[m, n] = self.frames[row, m, n]
        return out

    @ti.func
    def contact(self, block, row, step, dt):
        """The contact of a block, of any kind, each of which begins with a whole tile."""
        thread, pass_number = block % self.layout.tile, -1
        first = block - thread
        block_sums = ti.Vector.zero(ti.f64, ti.static(max(1, self.sums)))
        for n, contact_pass in ti.static(self.contacts):
            end = contact_pass.first() + contact_pass.blocks()
            if first >= contact_pass.first() and first < end:
                pass_number = n
                if block < end:
                    if ti.static(contact_pass.flat):
                        contact_pass.thread(
                            block_sums,
                            block,
                            dt,
                            contact_pass.gatherer.place(block, self.planes, dt * step),
                        )
                    else:
                        contact_pass.thread(block_sums, block, dt, self.frame(row))
        if ti.static(self.sums > 0):
            if pass_number >= 0:  # the same for all threads of a block
                total = self._contact_sums.total(block_sums, thread)
                for n, contact_pass in ti.static(self.contacts):
                    if pass_number == n:
                        contact_pass.put(
                            contact_pass.row((first - contact_pass.first()) // self.layout.tile),
                            thread,
                            total,
                        )


# -- launches --------------------------------------------------------------------------------------


def by_threads(phases, layout, step_phases):
    """Launches of the Steps of Phases: a thread for each grain, then one for each contact."""
    prepared = bool(layout.periodic) or layout.stress
    # Walls in fields of their own: a thread would have a copy of all of them in its own memory
    own_numbers = {n: ti.field(ti.f64, shape=6) for n in ("offset", "speed", "strength", "along")}
    planes = SimpleNamespace(normal=ti.field(ti.f64, shape=(6, 3)), **own_numbers)
    # of the cell: its frame, and its rates, at each step between two readings of the progress
    frames = ti.field(ti.f64, shape=(LOOK, 3, 4)) if prepared else None
    rates = ti.field(ti.f64, shape=(LOOK, 4)) if prepared else None

    @ti.func
    def note(box: ti.template()):
        for k in ti.static(range(6)):
            for a in ti.static(range(3)):
                planes.normal[k, a] = box.normal[k, a]
            planes.offset[k], planes.speed[k] = box.offset[k], box.speed[k]
            planes.strength[k], planes.along[k] = box.strength[k], box.along[k]

    arguments = Arguments(step_phases, note)
    threads = Threads(phases, layout, frames, rates, planes)
    prepare = make_prepare(arguments, threads) if prepared else None
    return Launches(
        arguments, [make_kick(arguments, threads)], [make_touch(arguments, threads)], prepare
    )


def make_prepare(arguments, threads):
    """Kernel `prepare()`: frames and rates of the cell at the steps up to the next look.

    A step has the row of its number in the call.
    """
    phases, layout, sync = threads.phases, threads.layout, arguments.sync
    frames, rates = threads.frames, threads.rates

    @ti.kernel
    def prepare():
        for k in range(LOOK):
            number = sync[DONE] + 1 + k
            row, step, dt = (
                number % LOOK,
                arguments.first[None] + number,
                arguments.numbers[None].dt,
            )
            if ti.static(len(layout.periodic) > 0):
                frame = phases.pairs.gatherer.frame(step, dt)
                for m in ti.static(range(3)):
                    for n in ti.static(range(3 + layout.tilted)):
                        frames[row, m, n] = frame[m, n]
            if ti.static(layout.stress):
                cell_rates = phases.flux.rates.at_step(step, dt)
                for n in ti.static(range(4)):
                    rates[row, n] = cell_rates[n]

    return prepare


def make_kick(arguments, threads):
    """Kernel `kick_and_drift()`: a thread for each grain, a block of them for the sphere.

    Lengths of loops are known when they are compiled: else a launch of their own would find them
    first.
    """
    phases, sync, numbers = threads.phases, arguments.sync, arguments.numbers
    block = threads.grain_block
    grain_threads = pad_to_blocks(phases.fields["x"].shape[0], block)
    # the sphere has a block of its own, behind those of the grains
    sphere_threads, sphere_loads = block * phases.has_sphere, BlockSums(6, block)

    @ti.func
    def move_sphere(t):
        total = sphere_loads.total(phases.sphere.loads_of_thread(t, block), t)
        phases.sphere.put_load(t, total)
        ti.simt.block.sync()
        if t == 0:
            step, n = arguments.first[None] + sync[DONE], numbers[None]
            if phases.sphere.move_by_load(n.dt, n.reach2, step) == 1:
                sync[DUE] = 1

    @ti.kernel
    def kick_and_drift():
        ti.loop_config(block_dim=block)
        for thread in range(grain_threads + sphere_threads):
            if thread == 0:  # 0: no step has begun
                sync[BEGUN] = ti.select(sync[STOP] == 0, sync[DONE] + 1, 0)
            if sync[STOP] == 0:
                if thread < grain_threads:
                    step = arguments.first[None] + sync[DONE]
                    if threads.grain(thread, (sync[DONE] + 1) % LOOK, step, numbers[None]) == 1:
                        sync[DUE] = 1
                if ti.static(phases.has_sphere):
                    if thread >= grain_threads:
                        move_sphere(thread - grain_threads)

    return kick_and_drift


def make_touch(arguments, threads):
    """Kernel `touch()`: a thread for each contact, unless a search must come before."""
    sync, numbers, first, is_due = (
        arguments.sync,
        arguments.numbers,
        arguments.first,
        arguments.is_due,
    )
    tile = threads.layout.tile
    contact_threads = pad_to_blocks(threads.phases.fields["contact"].shape[0], tile)

    @ti.kernel
    def touch():
        ti.loop_config(block_dim=tile)
        for block in range(contact_threads):
            has_begun = sync[BEGUN]
            step = first[None] + has_begun
            go_on = has_begun > 0 and not is_due(step, numbers[None])
            if go_on:
                threads.contact(block, has_begun % LOOK, step, numbers[None].dt)
            if block == 0:
                if go_on:
                    sync[DONE] = has_begun
                    conclude(sync)
                else:
                    sync[STOP] = HALT

    return touch
