"""Many steps in one kernel call: persistent workers, with a barrier between the phases of a step.

Taichi wakes and joins its threads for every parallel loop (50-70 us). Here a kernel is one parallel
loop over workers, each of which computes its share of every phase; a barrier between two phases
takes less than a microsecond. If the system runs too few of them, `assemble` lets the first one
continue alone, with bitwise identical results.
"""

from dusttaichi.compute.engine import ti

# A parallel loop is cut into runs of at least 512 iterations: one of each run works.
STRIDE = 512
PATIENCE = 20_000_000  # tries (some 0.1-0.4 s) before the first worker continues alone
CLOSED = 1_000_000

# places in the `sync` field, each in a line of the cache that the next is not fetched with: what
# workers wait at must not share one with what others read meanwhile
_APART = 32
MEET, MET, PRESENT = 0, _APART, 2 * _APART
OWN, SYNC = 3 * _APART, 4 * _APART  # the first of the method's own places; length of the field


@ti.func
def assemble(sync: ti.template(), workers):
    """(own number, how many workers there are) of this worker; 0 of them: it must leave.

    The first to arrive decides: all, if all arrive in time, else itself alone.
    """
    me = ti.atomic_add(sync[MEET], 1)
    present = 0
    if me == 0:
        tries = 0
        while ti.atomic_add(sync[MEET], 0) < workers and tries < PATIENCE:
            tries += 1
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
