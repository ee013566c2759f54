"""The step loop of every method: workers or launches carry out the phases of its steps.

A phase is a function `run(share, shares, step, numbers, outside)` of one share of its work.

Workers: Taichi wakes and joins its threads for every parallel loop (50-70 us). Here many steps are
one kernel, a parallel loop over workers, each of which computes its share of every phase; a barrier
between two phases takes less than a microsecond. If the system runs too few of them, `assemble`
lets the first one continue alone, with bitwise identical results.

Launches, for a device: a kernel a phase, none of which waits for the host. Their arguments and the
progress of the steps are in fields: once a search is due or the requested steps are done, all
further launches do nothing. The host launches up to LOOK steps and then reads the progress.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from typing import Any

from dusttaichi.compute.engine import ti
from dusttaichi.compute.taichi_internals.launching import LOOK, Launch

# A parallel loop is cut into runs of at least 512 iterations: one of each run works.
STRIDE = 512
PATIENCE = 20_000_000  # tries (some 0.1-0.4 s) before the first worker continues alone
CLOSED = 1_000_000

# places in the `sync` field, each in a line of the cache that the next is not fetched with: what
# workers wait at must not share one with what others read meanwhile
_APART = 32
MEET, MET, PRESENT = 0, _APART, 2 * _APART
# 1 where a search is due; steps done; 1 where the next one would have no end; of launches also: why
# no further step may begin, number of requested steps, the step that has begun
DUE, DONE, STUCK, STOP, REQUESTED, BEGUN = range(3 * _APART, 3 * _APART + 6)
SYNC = 4 * _APART  # length of the field
HALT, ENDLESS = 1, 2  # in STOP: search due or all done; STUCK
REASONS = 3  # numbers in STOP are below this


@dataclass(frozen=True)
class Steps:
    """The phases of a step, in order, as Taichi functions.

    before_search, after_search: phases before and after a possible search; there is no barrier
    between the phases of a tuple. is_due(step, numbers): true where the search must come first.
    count_steps(done): steps done at the end of one. Numbers, Outside: types of the arguments of
    that name. sync: the field of SYNC integers.
    """

    sync: Any
    before_search: tuple
    is_due: Callable
    after_search: tuple
    count_steps: Callable
    Numbers: Any
    Outside: Any


def advance_by(execution, step_phases, by_threads):
    """`advance` of Steps by "workers" (CPU), or by "launches" of kernels: by_threads()."""
    return by_workers(step_phases) if execution == "workers" else by_threads()


# -- workers ---------------------------------------------------------------------------------------


@ti.func
def assemble(sync: ti.template(), workers):
    """(own number, how many workers there are) of this worker; 0 of them: it must leave.

    The first to arrive decides: all, if all arrive in time, else itself alone.
    """
    me = ti.atomic_add(sync[MEET], 1)
    present = 0
    if me == 0:
        attempts = 0
        while ti.atomic_add(sync[MEET], 0) < workers and attempts < PATIENCE:
            attempts += 1
        present = 1
        if ti.atomic_add(sync[MEET], CLOSED) == workers:
            present = workers
        ti.atomic_add(sync[PRESENT], present)
    else:
        while ti.atomic_add(sync[PRESENT], 0) == 0:
            pass
        if ti.atomic_add(sync[PRESENT], 0) == workers and me < workers:
            present = workers
    return me, present


@ti.func
def barrier(sync: ti.template(), target):
    """Wait until `target` arrivals have been counted."""
    ti.atomic_add(sync[MET], 1)
    while ti.atomic_add(sync[MET], 0) < target:
        pass


def by_workers(step_phases):
    """Kernel `advance(steps, first, pending, workers, numbers, outside)` of Steps.

    It computes up to `steps` steps from number `first`; with `pending` the phases `before_search`
    of the first one are done already (a search followed them). It ends early when a search is due
    or a step is stuck; sync[DONE] has the number done.
    """
    sync, is_due, count_steps = step_phases.sync, step_phases.is_due, step_phases.count_steps
    before_search, after_search = _runs(step_phases.before_search), _runs(step_phases.after_search)
    Numbers, Outside = step_phases.Numbers, step_phases.Outside

    @ti.kernel
    def advance(
        steps: ti.i32,
        first: ti.i64,
        pending: ti.i32,
        workers: ti.i32,
        numbers: Numbers,
        outside: Outside,
    ):
        ti.loop_config(serialize=True)
        for k in range(SYNC):
            sync[k] = 0
        for slot in range(workers * STRIDE):
            if slot % STRIDE == 0:
                me, present = assemble(sync, workers)
                steps_done, met, drifted = 0, 0, pending
                while steps_done < steps and present > 0:
                    step = first + steps_done + 1
                    if drifted == 0:
                        for runs in ti.static(before_search):
                            for run in ti.static(runs):
                                run(me, present, step, numbers, outside)
                            met += present
                            barrier(sync, met)
                        if is_due(step, numbers):
                            break
                    drifted = 0
                    for runs in ti.static(after_search):
                        for run in ti.static(runs):
                            run(me, present, step, numbers, outside)
                        met += present
                        barrier(sync, met)
                    steps_done = count_steps(steps_done)
                    if sync[STUCK] == 1:
                        break
                if me == 0:
                    sync[DONE] = steps_done

    return advance


def _runs(phases):
    return tuple(phase if isinstance(phase, tuple) else (phase,) for phase in phases)


# -- launches --------------------------------------------------------------------------------------


class Arguments:
    """Arguments of the phases on a device, in fields: numbers, outside, number of the first step.

    note(outside): Taichi function that derives further fields from `outside`, or None.
    """

    def __init__(self, step_phases, note=None):
        sync, numbers = step_phases.sync, step_phases.Numbers.field(shape=())
        outside, first = step_phases.Outside.field(shape=()), ti.field(ti.i64, shape=())
        Numbers, Outside, derives = step_phases.Numbers, step_phases.Outside, note is not None
        self.sync, self.is_due, self.first = sync, step_phases.is_due, first
        self.numbers, self.outside = numbers, outside

        @ti.kernel
        def begin(steps: ti.i32, first_step: ti.i64, pending: ti.i32):
            first[None] = first_step
            sync[DUE], sync[DONE], sync[STUCK], sync[STOP] = 0, 0, 0, 0
            sync[REQUESTED], sync[BEGUN] = steps, pending

        @ti.kernel
        def pass_numbers(new_numbers: Numbers, new_outside: Outside):
            numbers[None], outside[None] = new_numbers, new_outside
            if ti.static(derives):
                note(new_outside)

        self.begin, self._pass, self._passed = begin, pass_numbers, (None, None)

    def pass_numbers(self, *arguments):
        """Write numbers and outside to their fields, but for the objects of the last call."""
        if any(a is not b for a, b in zip(arguments, self._passed, strict=True)):
            self._pass(*arguments)
            self._passed = arguments


class Launches:
    """`advance` of a device, as of `by_workers`; it returns (steps done, 1 where one is stuck).

    before_search, after_search: kernels of the phases; prepare: kernel before those of up to LOOK
    steps, or None. divided: a step may take several passes of them, as many as in the call before.
    """

    def __init__(self, arguments, before_search, after_search, prepare=None, *, divided=False):
        self.numbers, self._divided = arguments.numbers, divided
        self._begin, self.pass_numbers = arguments.begin, arguments.pass_numbers
        self._prepare = None if prepare is None else Launch(prepare)
        self._before_search, self._after_search = (
            [Launch(k) for k in kernels] for kernels in (before_search, after_search)
        )
        self._launches_per_step, sync = 1.0, arguments.sync

        @ti.kernel
        def progress() -> ti.i32:
            return REASONS * sync[DONE] + sync[STOP]

        self._progress = Launch(progress)

    def __call__(self, steps, first, pending, _workers, *arguments):
        self.pass_numbers(*arguments)
        self._begin(steps, first, pending)
        launched, steps_done, stopped = 0, 0, 0
        while not stopped:
            expected = ceil((steps - steps_done) * self._launches_per_step)
            batch = max(1, min(LOOK, expected))
            steps_done, stopped = self.launch(batch, pending)
            launched, pending = launched + batch, 0
        if self._divided:
            self._launches_per_step = launched / max(1, steps_done)
        return steps_done, stopped == ENDLESS

    def launch(self, steps, pending=0):
        """Launch the kernels of that many steps, LOOK at most; (steps done so far, STOP)."""
        if self._prepare is not None:
            self._prepare()
        for _ in range(steps):
            for kernel in (
                self._after_search if pending else (*self._before_search, *self._after_search)
            ):
                kernel()
            pending = 0
        return divmod(self._progress(), REASONS)


@ti.func
def conclude(sync: ti.template()):
    """Set STOP where no step may follow that which has ended."""
    if sync[STUCK] == 1:
        sync[STOP] = ENDLESS
    elif sync[DONE] >= sync[REQUESTED]:
        sync[STOP] = HALT
