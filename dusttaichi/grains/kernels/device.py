"""The step on a device: a thread for each grain, and one for each contact.

Two launches, none of which waits for the host (compute.loops): a launch finds out itself which step
it makes, and writes nothing that it reads. Blocks of threads are as long as tiles
(backend.loops_of), so that each row of a table of sums belongs to one block: what its threads sum
is added up in a fixed order (compute.blocks).
"""

from dusttaichi.compute.blocks import THREADS, BlockSums, padded
from dusttaichi.compute.engine import ti
from dusttaichi.compute.launching import LOOK
from dusttaichi.compute.loops import BEGUN, DONE, DUE, HALT, STOP, Arguments, Launches, conclude
from dusttaichi.compute.scan import CHUNK
from dusttaichi.grains.kernels.contacts import ContactPass
from dusttaichi.grains.kernels.gather import WallGatherer
from dusttaichi.grains.kernels.store import (
    FIRST_SPHERE,
    FIRST_WALL,
    GRAINS,
    ON_SPHERE,
    PAIRS,
    WALL_BLOCKS,
)
from dusttaichi.physics.geometry import WALLS

# columns of a row of `planes`, what the device knows of a wall: unit normal, offset, speed along
# the normal, strength of the springs, speed along x (of the top wall)
NORMAL, OFFSET, SPEED, STRENGTH, ALONG = 0, 3, 4, 5, 6
PLANE = 7
TOP = WALLS.index("top")


def place_planes():
    """The field of what the device knows of the walls."""
    return ti.field(ti.f64, shape=(len(WALLS), PLANE))


@ti.func
def put_planes(planes: ti.template(), box: ti.template()):
    """Fill it from the arguments of kernels for the walls."""
    for k in ti.static(range(len(WALLS))):
        for a in ti.static(range(3)):
            planes[k, NORMAL + a] = box.normal[k, a]
        planes[k, OFFSET], planes[k, SPEED] = box.offset[k], box.speed[k]
        planes[k, STRENGTH] = box.strength[k]
        planes[k, ALONG] = ti.static(1.0 if k == TOP else 0.0) * box.along


@ti.data_oriented
class PlaneGatherer(WallGatherer):
    """The gatherer of wall contacts, which reads the walls from a field.

    A thread would have a copy of all of them in its own memory.
    """

    @ti.func
    def plane(self, c, planes: ti.template(), time):
        k = self.of[c]
        normal = self.place3(planes[k, NORMAL], planes[k, NORMAL + 1], planes[k, NORMAL + 2])
        velocity = normal * ti.cast(planes[k, SPEED], self.geometry)
        velocity[0] += ti.cast(planes[k, ALONG], self.geometry)
        return ti.Struct(
            normal=normal, offset=planes[k, OFFSET] + planes[k, SPEED] * time, velocity=velocity,
            strength=ti.cast(planes[k, STRENGTH], self.real),
        )  # fmt: skip


@ti.data_oriented
class ContactThreads(ContactPass):
    """The pass over contacts by a thread for each of them.

    Its sums are losses by channel, branch x force (9 numbers), work of the faces of the cell.
    """

    def __init__(self, fields, layout, mechanics, gatherer, where=""):
        super().__init__(fields, layout, mechanics, gatherer, where)
        self.LOSSES = len(layout.channels) * layout.ledger
        self.VIRIAL = self.LOSSES
        self.WORK = self.LOSSES + 9 * layout.stress

    @ti.func
    def add_loss(self, books: ti.template(), channel: ti.template(), value):
        books[channel] = books[channel] + ti.cast(value, ti.f64)

    @ti.func
    def thread(self, books: ti.template(), block, dt_wide, place):
        """The contact of a block, which has one; its sums are added to `books`."""
        sums = [ti.Vector.zero(self.real, self.width) for _ in ti.static(range(self.CHANGES + 1))]
        virial = ti.Vector.zero(self.real, 9)
        p, dt = self.numbers.of_kind(self.kind), ti.cast(dt_wide, self.real)
        self.block(sums, virial, block, dt, p, place)
        totals = self.totals(sums)
        if ti.static(self.ledger):
            for n, channel in ti.static(self.channels):
                self.add_loss(books, channel, totals[n])
        if ti.static(self.stress):
            for n in ti.static(range(9)):
                books[self.VIRIAL + n] = ti.cast(virial[n], ti.f64)
        if ti.static(self.faces):
            books[self.WORK] = ti.cast(totals[self.FACES], ti.f64)
        if totals[self.CHANGES] > 0.0:
            self.change_block(block, books, dt, p, place)


@ti.data_oriented
class Threads:
    """Work of a thread on its grain, its contact, its share of the contacts with the sphere.

    phases: Phases of the same scene. frames, rates, planes: fields of what is known of the cell and
    of the walls at the steps to come.
    """

    def __init__(self, phases, layout, frames, rates, planes):
        self.phases, self.layout, self.counts = phases, layout, phases.counts
        self.frames, self.rates, self.planes = frames, rates, planes
        self.tilted, self.periodic, self.stress = layout.tilted, layout.periodic, layout.stress
        # blocks of a scene with stress are as long as the chunks of its sums
        self.grain_block = CHUNK if layout.stress else THREADS
        self._grain_sums = BlockSums(6, CHUNK) if layout.stress else None
        self._flux_table = phases.fields.get("flux")
        self._take_contacts(phases, layout)

    def _take_contacts(self, phases, layout):
        """Passes and tables of the contacts."""
        fields, pairs = phases.fields, phases.pairs
        if layout.tile != THREADS or layout.width != 1:
            raise ValueError("a tile of the loops of a device is a block of threads")
        self.pairs = _threads_of(pairs, fields, layout)
        self.on_sphere = _threads_of(phases.on_sphere, fields, layout)
        self.walls, self.has_walls = None, phases.has_walls
        if phases.has_walls:
            own = phases.walls.gatherer
            gatherer = PlaneGatherer(fields, layout, phases.walls.mechanics, own.numbers)
            self.walls = _threads_of(phases.walls, fields, layout, gatherer)
        self.has_sphere = phases.has_sphere
        self.faces = self.pairs.faces
        self.LOSSES, self.WORK = self.pairs.LOSSES, self.pairs.WORK
        self.books = self.WORK + self.faces
        self._contact_sums = BlockSums(self.books) if self.books else None
        # of pairs, of walls
        self.loss = fields["loss"], fields.get("wall_loss")
        self.virial = fields.get("virial"), fields.get("wall_virial")
        self.face_work = fields.get("face_work")

    # -- how much there is -----------------------------------------------------------------------

    @property
    def grain_threads(self):
        """Threads of a launch over the capacity in grains."""
        return padded(self.phases.fields["x"].shape[0], self.grain_block)

    @property
    def contact_threads(self):
        """Threads of a launch over the capacity in contacts."""
        return padded(self.phases.fields["contact"].shape[0])

    # -- grains ----------------------------------------------------------------------------------

    @ti.func
    def grain(self, g, row, numbers):
        """Kick and drift grain g; 1 if it has gone so far that a search is due. row: of `rates`."""
        due, thread = 0, g % self.grain_block
        if g - thread < self.counts[GRAINS]:  # the same for all threads of a block
            flux = ti.Vector.zero(ti.f64, 6)
            if g < self.counts[GRAINS]:
                due, flux = self.moved(g, row, numbers)
            if ti.static(self.stress):
                total, at = self._grain_sums.total(flux, thread), g // CHUNK
                if thread < 6:
                    self._flux_table[at, thread] = self._flux_table[at, thread] + numbers.dt * total
        return due

    @ti.func
    def moved(self, g, row, numbers):
        """Kick and drift grain g; (1 if a search is due, its part of the kinetic stress)."""
        far, place, u = self.phases.move(g, numbers.kick, numbers.turn, numbers.dt, numbers.reach2)
        flux = ti.Vector.zero(ti.f64, 6)
        if ti.static(self.stress):
            rate = ti.Vector([self.rates[row, k] for k in ti.static(range(4))])
            flux = self.phases.flux.of_grain(g, place, u, numbers.dt, rate)
        return far, flux

    # -- contacts --------------------------------------------------------------------------------

    @ti.func
    def frame(self, row):
        """The frame of the cell at the step of that row of `frames`, as kernels.cell has it."""
        out = ti.Matrix.zero(ti.f64, 3, 3 + self.tilted)
        if ti.static(len(self.periodic) > 0):
            for m in ti.static(range(3)):
                for n in ti.static(range(3 + self.tilted)):
                    out[m, n] = self.frames[row, m, n]
        return out

    @ti.func
    def contact(self, b, row, step, dt):
        """The contact of block b, of any kind.

        Pairs are first, then those with the sphere, then those with walls, each kind from a whole
        tile on.
        """
        thread = b % THREADS
        first, kind = b - thread, -1
        books = ti.Vector.zero(ti.f64, ti.static(max(1, self.books)))
        if first < self.counts[PAIRS]:
            kind = 0
            if b < self.counts[PAIRS]:
                self.pairs.thread(books, b, dt, self.frame(row))
        if ti.static(self.has_sphere):
            behind = self.counts[FIRST_SPHERE]
            if first >= behind and first < behind + self.counts[ON_SPHERE]:
                kind = 0
                if b < behind + self.counts[ON_SPHERE]:
                    self.on_sphere.thread(books, b, dt, self.frame(row))
        if ti.static(self.has_walls):
            behind = self.counts[FIRST_WALL]
            if first >= behind and first < behind + self.counts[WALL_BLOCKS]:
                kind = 1
                if b < behind + self.counts[WALL_BLOCKS]:
                    plane = self.walls.gatherer.plane(b - behind, self.planes, dt * step)
                    self.walls.thread(books, b, dt, plane)
                    self.walls.add_impulse(b, dt)
        if ti.static(self.books > 0):
            if kind >= 0:  # the same for all threads of a block
                total = self._contact_sums.total(books, thread)
                tile = (first - kind * self.counts[FIRST_WALL]) // THREADS
                self.put(kind, tile, thread, total)

    @ti.func
    def put(self, kind, tile, number, total):
        """Add the sum of an account to the row of its tile; kind: 1 of walls."""
        if number < self.LOSSES:
            self.put_into(self.loss, kind, tile, number, total)
        if ti.static(self.stress):
            if number >= self.LOSSES and number < self.WORK:
                self.put_into(self.virial, kind, tile, number - self.LOSSES, total)
        if ti.static(self.faces):
            if number == self.WORK and kind == 0:
                self.face_work[tile] = self.face_work[tile] + total

    @ti.func
    def put_into(self, tables: ti.template(), kind, tile, column, total):
        """Into that of pairs, or that of walls."""
        if kind == 0:
            tables[0][tile, column] = tables[0][tile, column] + total
        if ti.static(self.has_walls):
            if kind == 1:
                tables[1][tile, column] = tables[1][tile, column] + total


def _threads_of(contacts, fields, layout, gatherer=None):
    """The ContactThreads of a ContactPass; None of None."""
    if contacts is None:
        return None
    gatherer = gatherer or contacts.gatherer
    where = "wall_" if contacts.flat else ""
    return ContactThreads(fields, layout, contacts.mechanics, gatherer, where)


# -- launches --------------------------------------------------------------------------------------


def by_threads(phases, layout, own):
    """Launches of the Steps of Phases: a thread for each grain, then one for each contact."""
    planes, prepared = place_planes(), bool(layout.periodic) or layout.stress
    # of the cell: its frame, and its rates, at each step between two looks
    frames = ti.field(ti.f64, shape=(LOOK, 3, 4)) if prepared else None
    rates = ti.field(ti.f64, shape=(LOOK, 4)) if prepared else None

    @ti.func
    def note(box: ti.template()):
        put_planes(planes, box)

    known = Arguments(own, note)
    threads = Threads(phases, layout, frames, rates, planes)
    prepare = make_prepare(known, threads) if prepared else None
    return Launches(known, [make_kick(known, threads)], [make_touch(known, threads)], prepare)


def make_prepare(known, threads):
    """Kernel `prepare()`: frames and rates of the cell at the steps up to the next look.

    A step has the row of its number in the call.
    """
    phases, layout, sync = threads.phases, threads.layout, known.sync
    frames, rates = threads.frames, threads.rates

    @ti.kernel
    def prepare():
        for k in range(LOOK):
            number = sync[DONE] + 1 + k
            row, step, dt = number % LOOK, known.first[None] + number, known.numbers[None].dt
            if ti.static(len(layout.periodic) > 0):
                here = phases.frame(step, dt)
                for m in ti.static(range(3)):
                    for n in ti.static(range(3 + layout.tilted)):
                        frames[row, m, n] = here[m, n]
            if ti.static(layout.stress):
                found = phases.flux.rates(step, dt)
                for n in ti.static(range(4)):
                    rates[row, n] = found[n]

    return prepare


def make_kick(known, threads):
    """Kernel `kick_and_drift()`: a thread for each grain, a block of them for the sphere.

    Lengths of loops are known when they are compiled: else a launch of their own would find them
    first.
    """
    phases, sync, numbers = threads.phases, known.sync, known.numbers
    block, grain_threads = threads.grain_block, threads.grain_threads
    # the sphere has a block of its own, behind those of the grains
    sphere_threads, sphere_loads = block * phases.has_sphere, BlockSums(6, block)

    @ti.func
    def move_sphere(t):
        total = sphere_loads.total(phases.sphere.share(t, block), t)
        phases.sphere.put_load(t, total)
        ti.simt.block.sync()
        if t == 0:
            if phases.sphere.move_by_load(numbers[None].dt, numbers[None].reach2) == 1:
                sync[DUE] = 1

    @ti.kernel
    def kick_and_drift():
        ti.loop_config(block_dim=block)
        for g in range(grain_threads + sphere_threads):
            if g == 0:  # 0: no step has begun
                sync[BEGUN] = ti.select(sync[STOP] == 0, sync[DONE] + 1, 0)
            if sync[STOP] == 0:
                if g < grain_threads:
                    if threads.grain(g, (sync[DONE] + 1) % LOOK, numbers[None]) == 1:
                        sync[DUE] = 1
                if ti.static(phases.has_sphere):
                    if g >= grain_threads:
                        move_sphere(g - grain_threads)

    return kick_and_drift


def make_touch(known, threads):
    """Kernel `touch()`: a thread for each contact, unless a search must come before."""
    sync, numbers, first, is_due = known.sync, known.numbers, known.first, known.is_due

    @ti.kernel
    def touch():
        ti.loop_config(block_dim=THREADS)
        for b in range(threads.contact_threads):
            begun = sync[BEGUN]
            step = first[None] + begun
            go_on = begun > 0 and not is_due(step, numbers[None])
            if go_on:
                threads.contact(b, begun % LOOK, step, numbers[None].dt)
            if b == 0:
                if go_on:
                    sync[DONE] = begun
                    conclude(sync)
                else:
                    sync[STOP] = HALT

    return touch
