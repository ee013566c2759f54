"""The phases of a step: of one grain or tile, and the share that one worker has of all of them."""

import taichi as ti

from dusttaichi.compute.scan import CHUNK, first_of, whole
from dusttaichi.compute.workers import OWN
from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.deviations import DeviationPairs, DeviationWalls
from dusttaichi.grains.kernels.grains import make_flux, make_grain_pass
from dusttaichi.grains.kernels.on_request import ContactLosses
from dusttaichi.grains.kernels.params import params_type
from dusttaichi.grains.kernels.pointers import PointerPairs, PointerWalls
from dusttaichi.grains.kernels.polydisperse import make_numbers
from dusttaichi.grains.kernels.sphere import make_sphere
from dusttaichi.grains.kernels.store import (
    FIRST_SPHERE,
    FIRST_WALL,
    GRAINS,
    ON_SPHERE,
    PAIRS,
    WALL_BLOCKS,
)

StepNumbers = ti.types.struct(
    dt=ti.f64,
    kick=ti.f64,  # dt / m
    turn=ti.f64,  # dt / I
    reach2=ti.f64,  # square of the way a grain may go before a new search
    wall_due=ti.i64,  # step at which a wall has gone that way
)

DONE, DUE = OWN, OWN + 1  # places in the `sync` field


@ti.data_oriented
class Phases:
    """What a step does with a part of the grains, and with a tile of pairs or of wall contacts.

    ContactParams: type of the numbers of a contact; has_walls, has_sphere: there are contacts with
    walls, with the sphere.
    """

    def __init__(self, fields, layout, laws, walls):
        self.counts, self.sync = fields["counts"], fields["sync"]
        self.width, self.tile, self.stress = layout.width, layout.tile, layout.stress
        self.ContactParams = params_type(laws, layout.geometry, layout.law)
        self.move, self.frame = make_grain_pass(fields, layout), make_cell(fields, layout)[0]
        self.pair_i = fields["pair_i"]
        self.add_flux = make_flux(fields, layout) if layout.stress else None
        # a stress is summed by chunks of grains, so that its bits do not depend on the workers
        self.part_size = CHUNK if layout.stress else 1
        pairs, on_walls = PointerPairs, PointerWalls
        if layout.deviations:
            pairs, on_walls = DeviationPairs, DeviationWalls
        self.pairs, self.has_walls = pairs(fields, layout, laws), walls
        self.walls = on_walls(fields, layout, laws) if walls else None
        self.sphere, self.has_sphere = make_sphere(fields, layout), layout.sphere
        self.of_pairs, self.of_walls = make_numbers(fields, layout, laws)
        self.contact_loss = layout.contact_loss
        if layout.contact_loss:
            self.lost = ContactLosses(fields, layout, fields["loss"])
            self.lost_on_walls = (
                ContactLosses(fields, layout, fields["wall_loss"]) if walls else None
            )

    # -- how much there is -----------------------------------------------------------------------

    @ti.func
    def parts(self):
        return whole(self.counts[GRAINS], self.part_size)

    @ti.func
    def pair_tiles(self):
        return whole(self.counts[PAIRS], self.width * self.tile)

    @ti.func
    def wall_tiles(self):
        return whole(self.counts[WALL_BLOCKS], self.tile)

    # -- parts and tiles -------------------------------------------------------------------------

    @ti.func
    def move_part(self, part, step, numbers):
        """Kicks and drifts the grains of a part; 1 if one has gone so far that a search is due.

        step: that at whose end the grains arrive.
        """
        due = 0
        if ti.static(self.stress):
            due = self.add_flux(part, self.move, step, numbers)
        else:
            due, _, _ = self.move(part, numbers.kick, numbers.turn, numbers.dt, numbers.reach2)
        return due

    @ti.func
    def touch_pairs(self, tile, dt, pair, frame):
        """Turns the pointers of a tile of pairs and computes their loads."""
        last = ti.min((tile + 1) * self.tile, whole(self.counts[PAIRS], self.width))
        self.touch_blocks(tile * self.tile, last, tile, dt, pair, frame)

    @ti.func
    def touch_sphere(self, tile, dt, sphere, frame):
        """The same of contacts with the sphere."""
        first, blocks = self.counts[FIRST_SPHERE], whole(self.counts[ON_SPHERE], self.width)
        last = first + ti.min((tile + 1) * self.tile, blocks)
        own = first // self.tile + tile
        self.touch_blocks(first + tile * self.tile, last, own, dt, sphere, frame)

    @ti.func
    def touch_blocks(self, first, last, tile, dt, pair, frame):
        """The blocks from `first` to before `last`, all of them of one tile."""
        self.pairs.begin_tile(tile)
        for b in range(first, last):
            if ti.static(self.contact_loss):
                self.lost.before(b, tile)
            self.pairs.block(b, tile, self.of_pairs(b, pair), dt, frame)
            if ti.static(self.contact_loss):
                self.lost.after(b, tile)
        if ti.static(self.pairs.settles):
            if self.pairs.any_ends(tile):
                for b in range(first, last):
                    if self.pairs.has_ends(b):
                        self.pairs.settle(b, tile, self.of_pairs(b, pair), dt, frame)
        self.pairs.end_tile(tile)

    @ti.func
    def touch_walls(self, tile, step, dt, wall, box):
        """The same of wall contacts."""
        first, last = (
            tile * self.tile,
            ti.min((tile + 1) * self.tile, self.counts[WALL_BLOCKS]),
        )
        self.walls.begin_tile(tile)
        for c in range(first, last):
            plane, b = self.walls.plane(c, box, dt * step), self.counts[FIRST_WALL] + c
            if ti.static(self.contact_loss):
                self.lost_on_walls.before(b, tile)
            self.walls.block(c, tile, plane, self.of_walls(b, wall), dt)
            if ti.static(self.contact_loss):
                self.lost_on_walls.after(b, tile)
        for c in range(first, last):
            self.walls.add_impulse(c, dt)
        self.walls.end_tile(tile)

    # -- the share of one worker -----------------------------------------------------------------

    @ti.func
    def first_part(self, me, workers):
        """Where the grains of a worker begin: with the first of its pairs, whose loads they gather,
        so that few lines of the cache go from core to core; near an even share at least, where
        some grains have many pairs and others few."""
        n, tiles = self.parts(), self.pair_tiles()
        even, most = first_of(me, workers, n), n // (8 * workers)
        part = even
        if 0 < me < workers and tiles >= workers:
            own = self.pair_i[first_of(me, workers, tiles) * self.tile][0] // self.part_size
            part = ti.max(even - most, ti.min(own, even + most))
        return part

    @ti.func
    def kick_and_drift(self, me, workers, step, numbers):
        due = 0
        for part in range(self.first_part(me, workers), self.first_part(me + 1, workers)):
            due = ti.max(due, self.move_part(part, step, numbers))
        if ti.static(self.has_sphere):
            if me == 0:
                due = ti.max(due, self.sphere.move(numbers.dt, numbers.reach2))
        if due == 1:
            self.sync[DUE] = 1

    @ti.func
    def search_is_due(self, step, numbers):
        """Whether a grain, or a wall at that step, has gone as far as the lists allow."""
        return self.sync[DUE] == 1 or step >= numbers.wall_due

    @ti.func
    def turn_and_touch(self, me, workers, step, dt, pair, sphere, wall, box):
        n, here = self.pair_tiles(), self.frame(step, dt)
        for tile in range(first_of(me, workers, n), first_of(me + 1, workers, n)):
            self.touch_pairs(tile, dt, pair, here)
        if ti.static(self.has_sphere):
            k = self.sphere.tiles()
            for tile in range(first_of(me, workers, k), first_of(me + 1, workers, k)):
                self.touch_sphere(tile, dt, sphere, here)
        if ti.static(self.has_walls):
            m = self.wall_tiles()
            for tile in range(first_of(me, workers, m), first_of(me + 1, workers, m)):
                self.touch_walls(tile, step, dt, wall, box)
