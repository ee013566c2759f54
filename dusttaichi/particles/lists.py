"""Lists of all particles, one after another."""

from dusttaichi.compute.device_blocks import is_idle, loop_length
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import Scan, is_short


@ti.data_oriented
class Lists:
    """The lists of `listed`: that of particle k is from listed.first[k] to before first[k + 1].

    listed: an object with the functions count() of particles and entries(k, listing), the number of
    entries of one, which are written from first[k] on if `listing`, as far as there is room.
    tally: field, of one number more than the capacity in particles; chunk_sum: see Scan.
    """

    def __init__(self, listed, tally, chunk_sum):
        self.listed, self.tally, self.scan = listed, tally, Scan(chunk_sum)
        self.first, self.room = listed.first, tally.shape[0] - 1
        self.light = is_short(self.room)

    @ti.func
    def fill(self):
        """Write all lists. To be called outside of the loops of a kernel.

        One thread writes each behind the one before. Threads count first.
        """
        if ti.static(self.light):
            ti.loop_config(serialize=True)
            for _ in range(1):
                self.first[0] = 0
                for k in range(self.listed.count()):
                    self.first[k + 1] = self.first[k] + self.listed.entries(k, True)
        else:
            for k in range(loop_length(self.listed.count(), self.room)):
                if is_idle(k, self.listed.count()):
                    continue
                self.tally[k] = self.listed.entries(k, False)
            self.sum_up()
            for k in range(loop_length(self.listed.count(), self.room)):
                if is_idle(k, self.listed.count()):
                    continue
                self.listed.entries(k, True)

    @ti.func
    def sum_up(self):
        """First entries of all particles, and behind the last one the number of all."""
        end = loop_length(self.listed.count() + 1, self.room + 1)
        self.scan.exclusive(self.tally, self.first, end)
