"""The step on a device: kernels with one loop per phase, none of which waits for the host.

Arguments and progress of the steps are stored in fields: once a search is due or the requested
steps are done, all further launches do nothing. The host launches up to LOOK steps and then reads
the progress once.
"""

from math import ceil

from dusttaichi.compute.blocks import THREADS, BlockSums, largest_of_block, on_device, padded
from dusttaichi.compute.engine import ti
from dusttaichi.compute.launching import LOOK, Launch, PassOnChange, Progress
from dusttaichi.continuum.kernels.store import (
    BODIES,
    DUE,
    ENDED,
    FACES,
    PARTS,
    STUCK,
)
from dusttaichi.physics.continuum.kernels import MATERIAL

# entries of `sync`: reason why no further step may begin; number of requested output steps
STOP, REQUESTED = STUCK + 1, STUCK + 2
HALT, ENDLESS = 1, 2  # in STOP: search due or all done; output step of too many steps
ROWS = FACES + BODIES


class DeviceSteps:
    """`advance(output_steps, pending, workers, numbers, material)` of a device: see step.py."""

    def __init__(self, motion, rates, forces, StepNumbers):
        self.known = known = DeviceFields(motion, rates, forces, StepNumbers)
        begin, pass_numbers = make_begin(known, StepNumbers)
        self._begin, self.pass_numbers = begin, PassOnChange(pass_numbers)
        kick, respond, push = (by_threads if on_device() else by_particles)(known)
        self._kick, self._respond, self._push = Launch(kick), Launch(respond), Launch(push)
        self._end = Launch(make_end(known))
        self._progress = Progress(known.sync, ENDED, STOP)
        self._steps_per_output = 1.0

    def __call__(self, output_steps, pending, _workers, *arguments):
        """Advance; returns the number of output steps done.

        And a flag for a next one that would take too many time steps.
        """
        self.pass_numbers(*arguments)
        self._begin(output_steps)
        launched, ended, stopped = 0, 0, 0
        while not stopped:
            expected = ceil((output_steps - ended) * self._steps_per_output)
            for _ in range(max(1, min(LOOK, expected))):
                if not pending:
                    self._kick()
                pending = 0
                self._respond()
                self._push()
                self._end()
                launched += 1
            ended, stopped = self._progress()
        self._steps_per_output = launched / max(1, ended)
        return ended, stopped == ENDLESS


class DeviceFields:
    """Arguments of the kernels of a device, in fields, and the objects that they act on."""

    def __init__(self, motion, rates, forces, StepNumbers):
        self.motion, self.rates, self.forces = motion, rates, forces
        self.lists, self.sync = motion.lists, motion.lists.sync
        self.numbers, self.material = StepNumbers.field(shape=()), MATERIAL.field(shape=())
        self.threads = padded(motion.f.mass.shape[0])
        # the fastest signal of each block of threads
        blocks = self.threads // THREADS if on_device() else 1
        self.fastest = ti.field(ti.f64, shape=blocks)


def make_begin(known, StepNumbers):
    """Kernels `begin(output_steps)` and `pass_numbers(numbers, material)`, before steps of a call.

    The second where these have changed.
    """
    sync, numbers, material, fastest = known.sync, known.numbers, known.material, known.fastest

    @ti.kernel
    def begin(output_steps: ti.i32):
        sync[DUE], sync[ENDED], sync[STUCK] = 0, 0, 0
        sync[STOP], sync[REQUESTED] = 0, output_steps
        fastest[0] = 0.0

    @ti.kernel
    def pass_numbers(new: StepNumbers, dust: MATERIAL):
        numbers[None], material[None] = new, dust

    return begin, pass_numbers


def make_end(known):
    """Kernel `end_step()`: the length of the next step, and whether there is one."""
    motion, sync, numbers, lists = known.motion, known.sync, known.numbers, known.lists
    fastest, blocks, device = known.fastest, known.fastest.shape[0], on_device()
    turns = -(-blocks // THREADS)

    @ti.func
    def conclude():
        if sync[DUE] == 1:
            sync[STOP] = HALT
        else:
            sync[ENDED] = sync[ENDED] + motion.next_step(1, numbers[None])
            if sync[STUCK] == 1:
                sync[STOP] = ENDLESS
            elif sync[ENDED] >= sync[REQUESTED]:
                sync[STOP] = HALT

    @ti.kernel
    def end_step():
        if ti.static(device):
            ti.loop_config(block_dim=THREADS)
            for t in range(THREADS):
                if sync[STOP] == 0:
                    own = ti.cast(0.0, ti.f64)
                    for n in range(turns):
                        if n * THREADS + t < blocks:
                            own = ti.max(own, fastest[n * THREADS + t])
                    most = largest_of_block(own, t, THREADS)
                    if t == 0:
                        lists.most[0] = most
                        conclude()
        else:
            for _ in range(1):
                if sync[STOP] == 0:
                    lists.most[0] = fastest[0]
                    fastest[0] = 0.0
                    conclude()

    return end_step


def by_threads(known):
    """Kernels `kick_and_drift()`, `respond()` and `push()` of a device.

    A thread for each particle, a block of them for each surface. Lengths of loops are known when
    they are compiled: else a launch of their own would find them first.
    """
    motion, rates, forces = known.motion, known.rates, known.forces
    sync, numbers, material = known.sync, known.numbers, known.material
    fastest, threads, sums = known.fastest, known.threads, BlockSums(PARTS)

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
                own = ti.cast(0.0, ti.f64)
                if i < numbers[None].count:
                    own = rates.pass_over(i, numbers[None], material[None])
                    motion.show_others(i, numbers[None])
                most = largest_of_block(own, i % THREADS, THREADS)
                if i % THREADS == 0:
                    fastest[i // THREADS] = most

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
                    own = motion.share_of_load(row, thread, THREADS, numbers[None])
                    motion.add_load(row, thread, sums.total(own, thread))

    return kick_and_drift, respond, push


def by_particles(known):
    """The kernels of `by_threads` on the cores of a CPU, to test the loop."""
    motion, rates, forces = known.motion, known.rates, known.forces
    sync, numbers, material = known.sync, known.numbers, known.material
    fastest = known.fastest

    @ti.kernel
    def kick_and_drift():
        for _ in range(1):
            if sync[STOP] == 0:
                if motion.move_bodies(numbers[None]) == 1:
                    sync[DUE] = 1
        for i in range(numbers[None].count):
            if sync[STOP] == 0:
                if motion.kick_and_drift(i, numbers[None]) == 1:
                    sync[DUE] = 1

    @ti.kernel
    def respond():
        for i in range(numbers[None].count):
            if sync[STOP] == 0 and sync[DUE] == 0:
                # the largest of all is the same in whatever order they come
                ti.atomic_max(fastest[0], rates.pass_over(i, numbers[None], material[None]))
                motion.show_others(i, numbers[None])

    @ti.kernel
    def push():
        for i in range(numbers[None].count):
            if sync[STOP] == 0 and sync[DUE] == 0:
                forces.pass_over(i, numbers[None])
        for _ in range(1):
            if sync[STOP] == 0 and sync[DUE] == 0:
                motion.add_up(numbers[None])

    return kick_and_drift, respond, push
