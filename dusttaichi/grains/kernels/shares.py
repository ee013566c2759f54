"""The share that one worker has of the phases of a step.

A step moves all numbers of its contacts through the cache. So that it does so once and not twice,
grains move within the pass over contacts: the pairs of a grain with those before it are in tiles
before its own, so that it has all its loads, and nobody reads its position any more, once its own
pairs are computed. Only those with a contact that another worker computes wait for it.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import first_of
from dusttaichi.grains.kernels.phases import DUE

NEAR = 32  # tiles of pairs after which a core still has the loads of the first in its cache


@ti.data_oriented
class Share:
    """Functions of worker `me`, one of `workers`, for the Phases of a scene."""

    def __init__(self, phases):
        self.phases, fields = phases, phases.fields
        self.sync, self.part_size = phases.sync, phases.part_size
        self.tile, self.tile_size = phases.tile, phases.tile * phases.width
        self.pair_i, self.pair_start = fields["pair_i"], fields["pair_start"]
        self.entry, self.entry_start = fields["entry"], fields["entry_start"]
        # parts of the grains that wait, those of a worker side by side
        self.waiting = ti.field(ti.i32, shape=fields["x"].shape[0])

    @ti.func
    def first_part(self, me, workers):
        """First grain of a worker: that of the first of its pairs, whose loads its grains gather.

        Few lines of the cache then go from core to core. It is near an even share at least, where
        some grains have many pairs and others few.
        """
        n, tiles = self.phases.parts(), self.phases.pair_tiles()
        even, most = first_of(me, workers, n), n // (8 * workers)
        part = even
        if 0 < me < workers and tiles >= workers:
            own = self.pair_i[first_of(me, workers, tiles) * self.tile, 0] // self.part_size
            part = ti.max(even - most, ti.min(own, even + most))
        return part

    @ti.func
    def list_all(self, me, workers):
        """List all parts of a worker in `waiting`; their number."""
        first = self.first_part(me, workers)
        end = self.first_part(me + 1, workers)
        for part in range(first, end):
            self.waiting[part] = part
        return end - first

    @ti.func
    def list_waiting(self, me, workers):
        """List in `waiting` the parts of a worker with a contact that another computes.

        Their number. The others move within the pass over contacts (`touch`).
        """
        first, count = self.first_part(me, workers), 0
        for part in range(first, self.first_part(me + 1, workers)):
            waits = 0
            for g in range(part * self.part_size, self.phases.end_of(part)):
                waits = ti.max(waits, self.waits(g, me, workers))
            if waits == 1:
                self.waiting[first + count] = part
                count += 1
        return count

    @ti.func
    def waits(self, g, me, workers):
        """1 if grain g has a contact that a worker does not compute, or computes after its tiles.

        Contacts of a grain with those before it are in tiles before its own pairs.
        """
        n, size = self.phases.pair_tiles(), self.tile_size
        first, last = first_of(me, workers, n) * size, first_of(me + 1, workers, n) * size
        own = first < last and self.pair_start[g] >= first and self.pair_start[g + 1] <= last
        e = self.entry_start[g]
        own = own and (self.entry[e] < 0 or self.entry[e] >= first)
        if ti.static(self.phases.has_walls or self.phases.has_sphere):
            # the loads on walls and sphere are shared out in another way
            own = own and (workers == 1 or self.entry[self.entry_start[g + 1] - 2] < 0)
        return ti.select(own, 0, 1)

    @ti.func
    def kick_and_drift(self, me, workers, count, step, numbers):
        """Move the first `count` parts in `waiting` of a worker."""
        due, first = 0, self.first_part(me, workers)
        for k in range(first, first + count):
            due = ti.max(due, self.phases.move_part(self.waiting[k], step, numbers))
        if ti.static(self.phases.has_sphere):
            if me == 0:
                due = ti.max(due, self.phases.sphere.move(numbers.dt, numbers.reach2))
        if due == 1:
            self.sync[DUE] = 1

    @ti.func
    def search_is_due(self, step, numbers):
        """True if a grain, or a wall at that step, has gone as far as the lists allow."""
        return self.sync[DUE] == 1 or step >= numbers.wall_due

    @ti.func
    def touch(self, me, workers, count, step, numbers, box, moving):
        """Contacts of a worker's share: current history, loads, losses.

        moving: 1 where its grains then make the kick and drift of the next step, but those of the
        first `count` parts in `waiting`: each as soon as its contacts are computed, whose loads are
        in the cache of the core still.
        """
        dt = numbers.dt
        n, here = self.phases.pair_tiles(), self.phases.frame(step, dt)
        if ti.static(self.phases.has_sphere):
            k = self.phases.sphere.tiles()
            for tile in range(first_of(me, workers, k), first_of(me + 1, workers, k)):
                self.phases.touch_sphere(tile, dt, here)
        if ti.static(self.phases.has_walls):
            m = self.phases.wall_tiles()
            for tile in range(first_of(me, workers, m), first_of(me + 1, workers, m)):
                self.phases.touch_walls(tile, step, dt, box)
        first, end = self.first_part(me, workers), self.first_part(me + 1, workers)
        part, next_waiting, due = first, first, 0
        last = first_of(me + 1, workers, n)
        for tile in range(first_of(me, workers, n), last):
            self.phases.touch_pairs(tile, dt, here)
            if moving == 1 and ((tile + 1) % NEAR == 0 or tile + 1 == last):
                # grains before that of the next pair have no further ones
                stop = end
                if tile + 1 < last:
                    stop = ti.min(end, self.pair_i[(tile + 1) * self.tile, 0] // self.part_size)
                while part < stop:
                    until = stop
                    if next_waiting < first + count:
                        until = ti.min(stop, self.waiting[next_waiting])
                    for p in range(part, until):
                        due = ti.max(due, self.phases.move_part(p, step + 1, numbers))
                    part = until
                    if until < stop:  # one that waits
                        part, next_waiting = until + 1, next_waiting + 1
        if due == 1:
            self.sync[DUE] = 1
