"""The step on a device: two launches, and none of them waits for the host (compute.loops).

A launch finds out itself which step it makes, and writes nothing that it reads.
"""

from dusttaichi.compute.blocks import THREADS, BlockSums
from dusttaichi.compute.engine import ti
from dusttaichi.compute.launching import LOOK
from dusttaichi.compute.loops import BEGUN, DONE, DUE, HALT, STOP, Arguments, Launches, conclude
from dusttaichi.grains.kernels.threads import Threads, place_planes, put_planes


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
