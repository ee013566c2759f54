"""Loops in chunks of a fixed size: prefix sums and maxima over them.

No result depends on the number of threads, since the size of a chunk does not.
"""

from dusttaichi.compute.engine import settings, ti

CHUNK = 256  # numbers of a chunk: the unit of the parallel scans and of sums over particles
FEW = 16384  # particles


def is_short(particles):
    """True if a loop with little work for each of that many particles runs in one thread.

    An argument of `ti.loop_config(serialize=...)`: on a CPU it ends before other threads have woken
    up.
    """
    return settings().arch == ti.cpu and particles <= FEW


@ti.func
def first_item(worker, workers, n):
    """First of n items of a worker, whose items end before the first one of the next worker."""
    return n * worker // workers


@ti.func
def count_blocks(n: ti.template(), size: ti.template()):
    """Number of groups of this size for n items; a constant of the kernel if both are."""
    return (n + size - 1) // size


@ti.data_oriented
class Scan:
    """Exclusive prefix sums; chunk_sum: a field of at least `scan_capacity` numbers.

    On a device they are formed in parallel. One core is as fast as the memory (four million numbers
    in 3 ms, no less with two threads), and one loop compiles much faster than five.
    """

    def __init__(self, chunk_sum):
        self.chunk_sum, self.serial = chunk_sum, settings().arch == ti.cpu

    @ti.func
    def exclusive(self, values: ti.template(), starts: ti.template(), n: ti.template()):
        """Set starts[k] to the sum of the values before k, for the first n of them.

        To be called outside of the loops of a kernel.
        """
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
            for _ in range(1):
                total = 0
                for k in range(n):
                    value = values[k]
                    starts[k] = total
                    total += value
        else:
            self.by_chunks(values, starts, n)

    @ti.func
    def by_chunks(self, values: ti.template(), starts: ti.template(), n: ti.template()):
        """Sums of chunks, of groups of chunks, and prefix sums of these; then back to the numbers.

        All five loops are parallel but the middle one over n / CHUNK^2 numbers.
        """
        sums = ti.static(self.chunk_sum)
        for chunk in range(count_blocks(n, CHUNK)):
            total = 0
            for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
                total += values[k]
            sums[chunk] = total
        for group in range(count_blocks(count_blocks(n, CHUNK), CHUNK)):
            total, end = 0, count_blocks(n, CHUNK)
            for k in range(group * CHUNK, ti.min((group + 1) * CHUNK, end)):
                total += sums[k]
            sums[end + group] = total
        for _ in range(1):
            running_sum, end = 0, count_blocks(n, CHUNK)
            for k in range(end, end + count_blocks(end, CHUNK)):
                value = sums[k]
                sums[k] = running_sum
                running_sum += value
        for group in range(count_blocks(count_blocks(n, CHUNK), CHUNK)):
            end = count_blocks(n, CHUNK)
            start = sums[end + group]
            for k in range(group * CHUNK, ti.min((group + 1) * CHUNK, end)):
                value = sums[k]
                sums[k] = start
                start += value
        for chunk in range(count_blocks(n, CHUNK)):
            start = sums[chunk]
            for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
                value = values[k]
                starts[k] = start
                start += value


def scan_capacity(n):
    """Numbers that a Scan of n numbers stores: sums of chunks and of groups of chunks."""
    chunks = -(-n // CHUNK)
    return chunks + -(-chunks // CHUNK)


@ti.data_oriented
class Largest:
    """The largest number of each column of a table, without atomics.

    Row 0 is that of all rows from 1 on, which has one for each chunk of particles.

    table: a field of 1 + `scan_capacity` rows; chunks: their largest number.
    """

    def __init__(self, table, chunks):
        self.table, self.columns, self.chunks = table, table.shape[1], chunks
        self.groups, self.serial = -(-chunks // CHUNK), settings().arch == ti.cpu

    @ti.func
    def find(self, used: ti.template()):
        """Set row 0; used: number of chunks.

        A device reduces the rows of all chunks, by groups. To be called outside of the loops of a
        kernel.
        """
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
            for _ in range(1):
                self.join(1, used + 1, 0)
        else:
            for group in range(self.groups):
                end = ti.min((group + 1) * CHUNK, self.chunks)
                self.join(1 + group * CHUNK, 1 + end, 1 + self.chunks + group)
            for _ in range(1):
                self.join(1 + self.chunks, 1 + self.chunks + self.groups, 0)

    @ti.func
    def join(self, first, end, to):
        """Write the largest numbers of the rows from `first` to before `end` to another row."""
        for k in ti.static(range(self.columns)):
            largest = self.table[first, k]
            for row in range(first + 1, end):
                largest = ti.max(largest, self.table[row, k])
            self.table[to, k] = largest
