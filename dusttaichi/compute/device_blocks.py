"""Threads of a device in blocks: sums and maxima over a block in its shared memory.

Numbers are added in an order that depends on the number of threads in a block alone, so that the
same input gives the same bits.
"""

from dusttaichi.compute.engine import settings, ti
from dusttaichi.compute.scan import count_blocks

THREADS = 128  # of a block, by default
_PADDING = 8  # numbers between the rows of two sums, which then begin in different memory banks


def on_device():
    """True if kernels run on a device, with blocks of threads, and not on the cores of a CPU."""
    return settings().arch != ti.cpu


@ti.func
def loop_length(count: ti.template(), capacity: ti.template()):
    """Length of a parallel loop over `count` items of at most `capacity`.

    On a device it is the capacity, a constant of the kernel: a length in a field takes a launch of
    its own before the loop, which then starts as many blocks as the device can hold.
    """
    return capacity if ti.static(on_device()) else count


@ti.func
def is_idle(k, count: ti.template()):
    """True if iteration k of such a loop is beyond the `count` items.

    The loop continues with the next one then: Taichi moves nothing out of a loop that is within an
    `if`.
    """
    return k >= count if ti.static(on_device()) else 0


def pad_to_blocks(capacity, threads=THREADS):
    """Length of a loop over at most `capacity` items in whole blocks.

    All threads of a block meet at barriers, so that each needs the same number of iterations.
    """
    return -(-capacity // threads) * threads


@ti.data_oriented
class BlockSums:
    """Sums of `count` numbers over the threads of a block, of a float type."""

    def __init__(self, count, threads=THREADS, dtype=ti.f64):
        if count > threads:
            raise ValueError(f"{count} sums for {threads} threads")
        self.count, self.threads, self.dtype = count, threads, dtype
        # threads that form partial sums of each number: a power of two that divides the threads
        self.lanes = min(2 ** ((threads // count).bit_length() - 1), threads & -threads)
        self.row = threads + _PADDING

    @ti.func
    def combine(self, a, b):
        return a + b

    @ti.func
    def total(self, values: ti.template(), thread):
        """Sum number `thread` of the `count` numbers of every thread; 0 for further threads.

        All threads of the block must call it, each with its number.
        """
        pad = ti.simt.block.SharedArray((ti.static(self.count * self.row),), self.dtype)
        for k in ti.static(range(self.count)):
            pad[k * self.row + thread] = values[k]
        ti.simt.block.sync()
        number, lane = thread // self.lanes, thread % self.lanes
        if number < self.count:
            partial = ti.cast(0.0, self.dtype)
            for n in range(count_blocks(self.threads, self.lanes)):
                partial = self.combine(partial, pad[number * self.row + lane + n * self.lanes])
            pad[number * self.row + lane] = partial
        ti.simt.block.sync()
        out = ti.cast(0.0, self.dtype)
        if thread < self.count:
            for n in range(self.lanes):
                out = self.combine(out, pad[thread * self.row + n])
        ti.simt.block.sync()  # the next iteration writes here again
        return out


@ti.data_oriented
class BlockMaxima(BlockSums):
    """Maxima instead of sums, of numbers of which none is negative."""

    @ti.func
    def combine(self, a, b):
        return ti.max(a, b)


@ti.func
def largest_of_block(value, thread, threads: ti.template()):
    """The largest of the values of the threads of a block, returned to all of them; f64."""
    pad = ti.simt.block.SharedArray((threads,), ti.f64)
    pad[thread] = value
    ti.simt.block.sync()
    for n in ti.static(range(threads.bit_length() - 1)):
        half = ti.static(threads >> (n + 1))
        if thread < half:
            pad[thread] = ti.max(pad[thread], pad[thread + half])
        ti.simt.block.sync()
    out = pad[0]
    ti.simt.block.sync()
    return out
