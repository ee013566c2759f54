"""The step on a device: kernels with one loop per phase (compute.loops).

A thread for each particle, a block of them for each surface. Lengths of loops are known when they
are compiled: else a launch of their own would find them first.
"""

from dusttaichi.compute.device_blocks import THREADS, BlockSums, largest_of_block, pad_to_blocks
from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import DONE, DUE, HALT, STOP, Arguments, Launches, conclude
from dusttaichi.continuum.kernels.store import BODIES, FACES, PARTS

ROWS = FACES + BODIES


def by_threads(phases, step_phases):
    """Launches of the Steps of Phases."""
    arguments, sums = Arguments(step_phases), BlockSums(PARTS)
    motion, rates, forces = phases.motion, phases.rates, phases.forces
    sync, numbers, material = arguments.sync, arguments.numbers, arguments.outside
    threads = pad_to_blocks(motion.f.mass.shape[0])
    # the fastest signal of each block of threads
    fastest = ti.field(ti.f64, shape=threads // THREADS)

    @ti.kernel
    def kick_and_drift():
        for b in range(ROWS):
            if sync[STOP] == 0 and b < FACES + numbers[None].bodies:
                if motion.move_body(b, numbers[None]) == 1:
                    sync[DUE] = 1
        ti.loop_config(block_dim=THREADS)
        for i in range(threads):
            if sync[STOP] == 0 and i < numbers[None].count:
                if motion.kick_and_drift(i, numbers[None]) == 1:
                    sync[DUE] = 1

    @ti.kernel
    def respond():
        ti.loop_config(block_dim=THREADS)
        for i in range(threads):
            if sync[STOP] == 0 and sync[DUE] == 0:
                value = ti.cast(0.0, ti.f64)
                if i < numbers[None].count:
                    value = rates.pass_over(i, numbers[None], material[None])
                    motion.show_others(i, numbers[None])
                block_largest = largest_of_block(value, i % THREADS, THREADS)
                if i % THREADS == 0:
                    fastest[i // THREADS] = block_largest

    @ti.kernel
    def push():
        ti.loop_config(block_dim=THREADS)
        for i in range(threads):
            if sync[STOP] == 0 and sync[DUE] == 0 and i < numbers[None].count:
                forces.pass_over(i, numbers[None])
        ti.loop_config(block_dim=THREADS)
        for t in range(ROWS * THREADS):
            row, thread = t // THREADS, t % THREADS
            if sync[STOP] == 0 and sync[DUE] == 0 and row < FACES + numbers[None].bodies:
                if thread == 0:
                    motion.clear_load(row, numbers[None])
                if ti.static(motion.layout.rigid):
                    load = motion.share_of_load(row, thread, THREADS, numbers[None])
                    motion.add_load(row, thread, sums.total(load, thread))

    end_step = make_end(motion, arguments, fastest)
    return Launches(arguments, [kick_and_drift], [respond, push, end_step], divided=True)


def make_end(motion, arguments, fastest):
    """Kernel `end_step()`: the length of the next step, and whether there is one."""
    sync, numbers, lists = arguments.sync, arguments.numbers, motion.lists
    blocks = fastest.shape[0]
    turns = -(-blocks // THREADS)

    @ti.kernel
    def end_step():
        ti.loop_config(block_dim=THREADS)
        for t in range(THREADS):
            if sync[STOP] == 0:
                value = ti.cast(0.0, ti.f64)
                for n in range(turns):
                    if n * THREADS + t < blocks:
                        value = ti.max(value, fastest[n * THREADS + t])
                block_largest = largest_of_block(value, t, THREADS)
                if t == 0:
                    lists.most[0] = block_largest
                    if sync[DUE] == 1:
                        sync[STOP] = HALT
                    else:
                        sync[DONE] = sync[DONE] + motion.next_step(1, numbers[None])
                        conclude(sync)

    return end_step
