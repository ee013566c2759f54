"""The time step: leapfrog, one screen. Gather, kick, drift; search when it is due; contacts.

Between two calls the state is x and the history of contacts at time n, the loads of time n, and
v, w at n - 1/2. A step gathers the loads of each grain, kicks v, w to n + 1/2 and drifts x to
n + 1; then it carries the history of contacts with the spins of n + 1/2 and computes the loads of
n + 1 where grains touch. Positions, velocities, spins, rolling, sliding and twisting displacements
are all second order in dt (S12 sect. 4).
"""

from functools import lru_cache

from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import DUE, Steps
from dusttaichi.compute.scan import CHUNK, first_of, whole
from dusttaichi.domain.walls import TOP
from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.contacts import ContactPass
from dusttaichi.grains.kernels.gather import PairGatherer, WallGatherer, Walls
from dusttaichi.grains.kernels.grains import make_flux, make_grain_pass
from dusttaichi.grains.kernels.numbers import ON_BALL, PAIR
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
from dusttaichi.physics.contact.model import Mechanics


def steps_of(phases):
    """The Steps of Phases: motion of grains and sphere, search, contacts of each kind."""
    motion, contacts = [phases.kick_and_drift], [phases.pass_pairs]
    if phases.has_sphere:
        motion.append(phases.move_sphere)
        contacts.append(phases.pass_sphere)
    if phases.has_walls:
        contacts.append(phases.pass_walls)
    return Steps(
        phases.sync,
        before=(tuple(motion),),
        is_due=phases.search_is_due,
        after=(tuple(contacts),),
        made=phases.made,
        Numbers=StepNumbers,
        Outside=Walls,
    )


StepNumbers = ti.types.struct(
    dt=ti.f64,
    kick=ti.f64,  # dt / m
    turn=ti.f64,  # dt / I
    reach2=ti.f64,  # square of the way a grain may go before a new search
    wall_due=ti.i64,  # step at which a wall has gone that way
)


@lru_cache(maxsize=4)
def walls_argument(box):
    """The walls of a Box, or of None, as kernels take them."""
    if box is None:
        return Walls()
    return Walls(
        normal=box.normal.tolist(),
        offset=box.offset.tolist(),
        speed=box.speed.tolist(),
        strength=box.strength.tolist(),
        along=float(box.along[TOP, 0]),
    )


@lru_cache(maxsize=1)
def step_numbers(dt, masses, wall_due, reach2):
    """The numbers of a step as kernels take them; masses: units of mass and moment of inertia."""
    mass, inertia = masses
    return StepNumbers(dt=dt, kick=dt / mass, turn=dt / inertia, reach2=reach2, wall_due=wall_due)


class Passes:
    """The ContactPass of each kind of contact that a scene has: pairs, walls and sphere, or None.

    Empty lanes are computed as well: their grains are far away.
    """

    def __init__(self, fields, layout, walls):
        mechanics, numbers = Mechanics(layout.model, layout.law), make_numbers(fields, layout)

        def of_pairs(kind):
            gatherer = PairGatherer(fields, layout, mechanics, numbers, kind)
            return ContactPass(fields, layout, mechanics, gatherer)

        self.pairs = of_pairs(PAIR)
        self.sphere = of_pairs(ON_BALL) if layout.sphere else None
        self.walls = None
        if walls:
            gatherer = WallGatherer(fields, layout, mechanics, numbers)
            self.walls = ContactPass(fields, layout, mechanics, gatherer, "wall_")


@ti.data_oriented
class Phases:
    """Phases of a step on a part of the grains, and on a tile of contacts of each kind."""

    def __init__(self, fields, layout, walls):
        self.fields, self.counts, self.sync = fields, fields["counts"], fields["sync"]
        self.width, self.tile, self.stress = layout.width, layout.tile, layout.stress
        self.move, self.frame = make_grain_pass(fields, layout), make_cell(fields, layout)[0]
        self.pair_i = fields["pair_i"]
        self.flux = make_flux(fields, layout) if layout.stress else None
        # a stress is summed by chunks of grains, so that its bits do not depend on the workers
        self.part_size = CHUNK if layout.stress else 1
        passes = Passes(fields, layout, walls)
        self.pairs, self.walls, self.on_sphere = passes.pairs, passes.walls, passes.sphere
        self.has_walls, self.has_sphere = walls, layout.sphere
        self.sphere = make_sphere(fields, layout)

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
            due = self.flux.add(part, self.move, step, numbers)
        else:
            due, _, _ = self.move(part, numbers.kick, numbers.turn, numbers.dt, numbers.reach2)
        return due

    @ti.func
    def blocks_of_pairs(self, tile):
        """First block of a tile of pairs and the one behind its last."""
        blocks = whole(self.counts[PAIRS], self.width)
        return tile * self.tile, ti.min((tile + 1) * self.tile, blocks)

    @ti.func
    def blocks_of_sphere(self, tile):
        """First block of a tile of contacts with the sphere and the one behind its last."""
        first, blocks = self.counts[FIRST_SPHERE], whole(self.counts[ON_SPHERE], self.width)
        return first + tile * self.tile, first + ti.min((tile + 1) * self.tile, blocks)

    @ti.func
    def touch_pairs(self, tile, dt, frame):
        """Update the contacts of a tile of pairs and compute their loads."""
        first, last = self.blocks_of_pairs(tile)
        self.pairs.tile(tile, first, last, dt, frame, 0.0)

    @ti.func
    def touch_sphere(self, tile, dt, frame):
        """Update a tile of contacts with the sphere, which are behind those of the pairs."""
        first, last = self.blocks_of_sphere(tile)
        tile += self.counts[FIRST_SPHERE] // self.tile
        self.on_sphere.tile(tile, first, last, dt, frame, 0.0)

    @ti.func
    def touch_walls(self, tile, step, dt, box):
        """Update a tile of wall contacts; the force of a wall is summed over time by its blocks."""
        first = self.counts[FIRST_WALL]
        last = first + ti.min((tile + 1) * self.tile, self.counts[WALL_BLOCKS])
        self.walls.tile(tile, first + tile * self.tile, last, dt, box, dt * step)

    # -- shares of all ---------------------------------------------------------------------------

    @ti.func
    def first_part(self, me, workers):
        """First grain of a worker: that of the first of its pairs, whose loads its grains gather.

        Few lines of the cache then go from core to core. It is near an even share at least, where
        some grains have many pairs and others few.
        """
        n, tiles = self.parts(), self.pair_tiles()
        even, most = first_of(me, workers, n), n // (8 * workers)
        part = even
        if 0 < me < workers and tiles >= workers:
            own = self.pair_i[first_of(me, workers, tiles) * self.tile, 0] // self.part_size
            part = ti.max(even - most, ti.min(own, even + most))
        return part

    @ti.func
    def kick_and_drift(self, me, workers, step, numbers, box: ti.template()):
        """Gather the loads of the grains of a share, kick and drift them."""
        due = 0
        for part in range(self.first_part(me, workers), self.first_part(me + 1, workers)):
            due = ti.max(due, self.move_part(part, step, numbers))
        if due == 1:
            self.sync[DUE] = 1

    @ti.func
    def move_sphere(self, me, workers, step, numbers, box: ti.template()):
        """Kick and drift the sphere."""
        if me == 0:
            if self.sphere.move(numbers.dt, numbers.reach2) == 1:
                self.sync[DUE] = 1

    @ti.func
    def search_is_due(self, step, numbers):
        """True if a grain, or a wall at that step, has gone as far as the lists allow."""
        return self.sync[DUE] == 1 or step >= numbers.wall_due

    @ti.func
    def pass_pairs(self, me, workers, step, numbers, box: ti.template()):
        """Contacts of two grains of a share: current history, loads, losses."""
        n, here = self.pair_tiles(), self.frame(step, numbers.dt)
        for tile in range(first_of(me, workers, n), first_of(me + 1, workers, n)):
            self.touch_pairs(tile, numbers.dt, here)

    @ti.func
    def pass_sphere(self, me, workers, step, numbers, box: ti.template()):
        """Contacts with the sphere of a share."""
        n, here = self.sphere.tiles(), self.frame(step, numbers.dt)
        for tile in range(first_of(me, workers, n), first_of(me + 1, workers, n)):
            self.touch_sphere(tile, numbers.dt, here)

    @ti.func
    def pass_walls(self, me, workers, step, numbers, box):
        """Contacts with the walls of a share."""
        n = self.wall_tiles()
        for tile in range(first_of(me, workers, n), first_of(me + 1, workers, n)):
            self.touch_walls(tile, step, numbers.dt, box)

    @ti.func
    def made(self, done):
        """Steps done at the end of one."""
        return done + 1


def make_evaluate(phases):
    """Kernel `evaluate(step, dt, box)`: the loads of a configuration, without a step.

    The history of its contacts stays as it is.
    """

    @ti.kernel
    def evaluate(step: ti.i64, dt: ti.f64, box: Walls):
        for tile in range(phases.pair_tiles()):
            first, last = phases.blocks_of_pairs(tile)
            for block in range(first, last):
                phases.pairs.evaluate(block, phases.frame(step, dt))
        if ti.static(phases.has_sphere):
            for tile in range(phases.sphere.tiles()):
                first, last = phases.blocks_of_sphere(tile)
                for block in range(first, last):
                    phases.on_sphere.evaluate(block, phases.frame(step, dt))
        if ti.static(phases.has_walls):
            for c in range(phases.counts[WALL_BLOCKS]):
                plane = phases.walls.gatherer.plane(c, box, dt * step)
                phases.walls.evaluate(phases.counts[FIRST_WALL] + c, plane)

    return evaluate
