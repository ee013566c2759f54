"""How loops are shared out: pieces of a fixed size, prefix sums and extremes over them.

No sum depends on the number of threads, since the size of a piece does not.
"""

from dusttaichi.compute.engine import settings, ti

CHUNK = 256  # numbers of a chunk: the unit of the parallel scans and of sums over particles
FEW = 16384  # particles


def little(room):
    """Whether a loop that does little for each of so many particles is left to one thread, as
    `ti.loop_config(serialize=...)` takes it: on a core it is over before others have woken up."""
    return settings().arch == ti.cpu and room <= FEW


@ti.func
def first_of(share, shares, n):
    """Where a share of n things begins; the next one begins where it ends."""
    return n * share // shares


@ti.func
def whole(n: ti.template(), size: ti.template()):
    """Pieces of this size that n things take; a number of Python where both are."""
    return (n + size - 1) // size


@ti.data_oriented
class Scan:
    """Exclusive prefix sums; chunk_sum: a field with room for the sums of `scan_room`.

    On a device they are formed in parallel. A core passes the numbers as fast as memory gives them
    (four million in 3 ms, by two threads no sooner), and one loop compiles much sooner than five.
    """

    def __init__(self, chunk_sum):
        self.chunk_sum, self.serial = chunk_sum, settings().arch == ti.cpu

    @ti.func
    def exclusive(self, values: ti.template(), starts: ti.template(), n: ti.template()):
        """starts[k]: the sum of the values before k, for the first n of them. To be called outside
        of the loops of a kernel."""
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
            for _ in range(1):
                before = 0
                for k in range(n):
                    here = values[k]
                    starts[k] = before
                    before += here
        else:
            self.by_chunks(values, starts, n)

    @ti.func
    def by_chunks(self, values: ti.template(), starts: ti.template(), n: ti.template()):
        """Sums of chunks, of chunks of these, and of all before each; then the same way back. Five
        parallel loops but for the middle one, whose numbers are n / CHUNK^2."""
        sums = ti.static(self.chunk_sum)
        for chunk in range(whole(n, CHUNK)):
            total = 0
            for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
                total += values[k]
            sums[chunk] = total
        for group in range(whole(whole(n, CHUNK), CHUNK)):
            total, end = 0, whole(n, CHUNK)
            for k in range(group * CHUNK, ti.min((group + 1) * CHUNK, end)):
                total += sums[k]
            sums[end + group] = total
        for _ in range(1):
            before, end = 0, whole(n, CHUNK)
            for k in range(end, end + whole(end, CHUNK)):
                here = sums[k]
                sums[k] = before
                before += here
        for group in range(whole(whole(n, CHUNK), CHUNK)):
            end = whole(n, CHUNK)
            start = sums[end + group]
            for k in range(group * CHUNK, ti.min((group + 1) * CHUNK, end)):
                here = sums[k]
                sums[k] = start
                start += here
        for chunk in range(whole(n, CHUNK)):
            start = sums[chunk]
            for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
                here = values[k]
                starts[k] = start
                start += here


def scan_room(n):
    """Numbers that a Scan of n numbers has to keep: sums of chunks, and of chunks of these."""
    chunks = -(-n // CHUNK)
    return chunks + -(-chunks // CHUNK)


@ti.data_oriented
class Largest:
    """The largest number of each column of a table, in any number of threads without atomics: row
    0, of the rows from 1 on, one for each chunk of particles.

    table: a field of 1 + `scan_room` of the particles rows; chunks: that there is room for.
    """

    def __init__(self, table, chunks):
        self.table, self.columns, self.chunks = table, table.shape[1], chunks
        self.groups, self.serial = -(-chunks // CHUNK), settings().arch == ti.cpu

    @ti.func
    def find(self, used: ti.template()):
        """Fill row 0; used: chunks that there are. A device passes all rows, by groups. To be
        called outside of the loops of a kernel."""
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
        """The largest numbers of the rows from `first` to before `end`, into another row."""
        for k in ti.static(range(self.columns)):
            most = self.table[first, k]
            for row in range(first + 1, end):
                most = ti.max(most, self.table[row, k])
            self.table[to, k] = most
