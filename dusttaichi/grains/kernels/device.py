"""The step on a device: two launches, and none of them waits for the host.

What kernels need to know is in fields, and so is how far the steps have come: a launch finds out
itself which step it makes, and whether a search is due, after which it and all launches behind it
do nothing. The host launches LOOK steps and looks once how many of them were made.
"""

from dusttaichi.compute.blocks import THREADS, BlockSums, on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.launching import LOOK, Launch, PassOnChange, Progress
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.phases import DONE, DUE, StepNumbers
from dusttaichi.grains.kernels.threads import Threads, place_planes, put_planes

# places in `sync`: the step that has begun, and 1 where no further one may begin. A launch writes
# none of those that it reads.
BEGUN, STOP = DUE + 1, DUE + 2


class DeviceSteps:
    """`advance(steps, first, pending, workers, numbers, box)` of a device: see kernels of step."""

    def __init__(self, phases, layout):
        known = DeviceFields(phases, layout)
        begin, pass_numbers = make_begin(known)
        self._begin, self._pass_numbers = begin, PassOnChange(pass_numbers)
        self._prepare = Launch(make_prepare(known)) if known.prepared else None
        kick, touch = (by_threads if on_device() else by_tiles)(known)
        self._kick, self._touch = Launch(kick), Launch(touch)
        self._progress = Progress(known.sync, DONE, STOP)

    def __call__(self, steps, first, pending, _workers, *arguments):
        """Returns how many steps it has made."""
        self._pass_numbers(*arguments)
        self._begin(first, pending)
        launched = 0
        while launched < steps:
            if self._prepare is not None:
                self._prepare()
            for _ in range(min(LOOK, steps - launched)):
                if not pending:
                    self._kick()
                pending = 0
                self._touch()
                launched += 1
            done, stopped = self._progress()
            if stopped:
                break
        return done


class DeviceFields:
    """Fields of the steps to come on a device, and the functions that fill and use them."""

    def __init__(self, phases, layout):
        self.phases, self.layout, self.sync = phases, layout, phases.sync
        self.numbers = StepNumbers.field(shape=())
        self.first = ti.field(ti.i64, shape=())
        self.planes = place_planes()
        self.prepared = bool(layout.periodic) or layout.stress
        # of the cell: its frame, and its rates, at each step between two looks
        self.frames = ti.field(ti.f64, shape=(LOOK, 3, 4)) if self.prepared else None
        self.rates = ti.field(ti.f64, shape=(LOOK, 4)) if self.prepared else None
        self.box = Walls.field(shape=()) if not on_device() else None


def make_begin(known):
    """Kernels `begin(first, pending)` and `pass_numbers(numbers, box)`, before the steps of a call.

    The second where the numbers have changed.
    """
    sync, numbers, first_step, planes = known.sync, known.numbers, known.first, known.planes
    box_of, by_box = known.box, known.box is not None

    @ti.kernel
    def begin(first: ti.i64, pending: ti.i32):
        first_step[None] = first
        sync[BEGUN], sync[DONE], sync[DUE], sync[STOP] = pending, 0, 0, 0

    @ti.kernel
    def pass_numbers(new: StepNumbers, box: Walls):
        numbers[None] = new
        put_planes(planes, box)
        if ti.static(by_box):
            box_of[None] = box

    return begin, pass_numbers


def make_prepare(known):
    """Kernel `prepare()`: frames and rates of the cell at the steps up to the next look.

    A step has the row of its number in the call.
    """
    phases, layout, sync = known.phases, known.layout, known.sync
    frames, rates = known.frames, known.rates

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


def make_may_touch(known):
    """Function `may_touch()`: true if the contacts of the step that has begun may be computed.

    No search must come before.
    """
    sync, numbers, first_step = known.sync, known.numbers, known.first

    @ti.func
    def may_touch():
        return sync[DUE] == 0 and first_step[None] + sync[BEGUN] < numbers[None].wall_due

    return may_touch


def by_threads(known):
    """Kernels `kick_and_drift()` and `touch()` of a device.

    Lengths of loops are known when they are compiled: else a launch of their own would find them
    first.
    """
    phases, layout, sync = known.phases, known.layout, known.sync
    numbers, first_step, may_touch = known.numbers, known.first, make_may_touch(known)
    threads = Threads(phases, layout, known.frames, known.rates, known.planes)
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
            if sync[STOP] == 0:
                if g < grain_threads:
                    if threads.grain(g, (sync[DONE] + 1) % LOOK, numbers[None]) == 1:
                        sync[DUE] = 1
                    if g == 0:
                        sync[BEGUN] = sync[DONE] + 1
                if ti.static(phases.has_sphere):
                    if g >= grain_threads:
                        move_sphere(g - grain_threads)

    @ti.kernel
    def touch():
        ti.loop_config(block_dim=THREADS)
        for b in range(threads.contact_threads):
            begun, go_on = sync[BEGUN], may_touch()
            if go_on:
                step = first_step[None] + begun
                threads.contact(b, begun % LOOK, step, numbers[None].dt)
            if b == 0:
                if go_on:
                    sync[DONE] = begun
                else:
                    sync[STOP] = 1

    return kick_and_drift, touch


def by_tiles(known):
    """The kernels of `by_threads` on the cores of a CPU, to test the loop.

    A part of the grains or a tile of contacts at a time.
    """
    phases, sync, numbers = known.phases, known.sync, known.numbers
    first_step, box, may_touch = known.first, known.box, make_may_touch(known)

    @ti.kernel
    def kick_and_drift():
        for part in range(phases.parts()):
            if sync[STOP] == 0:
                step = first_step[None] + sync[DONE] + 1
                if phases.move_part(part, step, numbers[None]) == 1:
                    sync[DUE] = 1
        for _ in range(1):
            if sync[STOP] == 0:
                sync[BEGUN] = sync[DONE] + 1
                if ti.static(phases.has_sphere):
                    if phases.sphere.move(numbers[None].dt, numbers[None].reach2) == 1:
                        sync[DUE] = 1

    @ti.kernel
    def touch():
        for tile in range(phases.pair_tiles()):
            if may_touch():
                step, dt = first_step[None] + sync[BEGUN], numbers[None].dt
                phases.touch_pairs(tile, dt, phases.frame(step, dt))
        if ti.static(phases.has_sphere):
            for tile in range(phases.sphere.tiles()):
                if may_touch():
                    step, dt = first_step[None] + sync[BEGUN], numbers[None].dt
                    phases.touch_sphere(tile, dt, phases.frame(step, dt))
        if ti.static(phases.has_walls):
            for tile in range(phases.wall_tiles()):
                if may_touch():
                    step, dt = first_step[None] + sync[BEGUN], numbers[None].dt
                    phases.touch_walls(tile, step, dt, box[None])
        for _ in range(1):
            if may_touch():
                sync[DONE] = sync[BEGUN]
            else:
                sync[STOP] = 1

    return kick_and_drift, touch
