"""The time step: leapfrog. Gather, kick, drift; search when it is due; contacts.

Between two calls the state is x and the history of contacts at time n, the loads of time n, and
v, w at n - 1/2. A step gathers the loads of each grain, kicks v, w to n + 1/2 and drifts x to
n + 1; then it carries the history of contacts with the spins of n + 1/2 and computes the loads of
n + 1 where grains touch. Positions, velocities, spins, rolling, sliding and twisting displacements
are all second order in dt (S12 sect. 4).
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import DUE, Steps
from dusttaichi.compute.scan import CHUNK, count_blocks, first_item
from dusttaichi.grains.kernels.contact_numbers import PAIR, RIGID_SPHERE
from dusttaichi.grains.kernels.contact_pass import ContactPass
from dusttaichi.grains.kernels.gather import PairGatherer, SurfaceGatherer, WallGatherer, Walls
from dusttaichi.grains.kernels.grain_pass import GrainPass, KineticFlux
from dusttaichi.grains.kernels.polydisperse import make_numbers
from dusttaichi.grains.kernels.sphere_motion import SphereMotion
from dusttaichi.grains.kernels.store import GRAINS
from dusttaichi.physics.contact.model import Mechanics


def steps_of(phases):
    """The Steps of Phases: motion of grains and sphere, search, contacts of each kind."""
    motion = [phases.kick_and_drift] + [phases.move_sphere] * phases.has_sphere
    return Steps(
        phases.sync,
        before_search=(tuple(motion),),
        is_due=phases.search_is_due,
        after_search=(tuple(contacts.run for contacts in phases.contacts),),
        count_steps=phases.count_steps,
        Numbers=StepNumbers,
        Outside=Walls,
    )


StepNumbers = ti.types.struct(
    dt=ti.f64,
    kick=ti.f64,  # dt / m
    turn=ti.f64,  # dt / I
    reach2=ti.f64,  # square of the distance that a grain may move before a search
    wall_due=ti.i64,  # step at which a wall has moved as far
)


@ti.data_oriented
class Phases:
    """Phases of a step on a part of the grains, and the contacts of each kind.

    pairs, on_sphere, walls: Pass (ContactPass, on a device ContactThreads) of them, None where the
    scene has none. contacts: all that it has.
    """

    def __init__(self, fields, layout, walls, Pass=ContactPass):
        self.fields, self.counts, self.sync = fields, fields["counts"], fields["sync"]
        self.tile, self.stress = layout.tile, layout.stress
        self.grains, self.pair_i = GrainPass(fields, layout), fields["pair_i"]
        self.flux = KineticFlux(fields, layout) if layout.stress else None
        # a stress is summed by chunks of grains, so that its bits do not depend on the workers
        self.part_size = CHUNK if layout.stress else 1
        common = Mechanics(layout.model, layout.law), make_numbers(fields, layout)

        def make_pass(Gatherer, *contact_kind):
            gatherer = Gatherer(fields, layout, *common, *contact_kind)
            return Pass(fields, layout, common[0], gatherer)

        self.pairs = make_pass(PairGatherer, PAIR)
        self.on_sphere = make_pass(PairGatherer, RIGID_SPHERE) if layout.sphere else None
        self.walls = (
            make_pass(SurfaceGatherer if layout.curved else WallGatherer) if walls else None
        )
        every = self.pairs, self.on_sphere, self.walls
        self.contacts = [contacts for contacts in every if contacts is not None]
        self.has_sphere = layout.sphere
        self.sphere = SphereMotion(fields, layout) if layout.sphere else None

    @ti.func
    def move_part(self, section, step, numbers):
        """Kicks and drifts the grains of a part; 1 if one has moved so far that a search is due.

        step: that at whose end the grains arrive.
        """
        is_due = 0
        if ti.static(self.stress):
            is_due = self.flux.move_chunk(section, self.grains, step, numbers)
        else:
            n = numbers
            is_due, _, _ = self.grains.move(section, n.kick, n.turn, n.dt, n.reach2, step - 1)
        return is_due

    @ti.func
    def first_part(self, me, workers):
        """First grain of a worker: that of the first of its pairs, whose loads its grains gather.

        Few lines of the cache then go from core to core. It is near an even share at least, where
        some grains have many pairs and others few.
        """
        n, tiles = count_blocks(self.counts[GRAINS], self.part_size), self.pairs.tiles()
        even, margin = first_item(me, workers, n), n // (8 * workers)
        section = even
        if 0 < me < workers and tiles >= workers:
            pair_section = (
                self.pair_i[first_item(me, workers, tiles) * self.tile, 0] // self.part_size
            )
            section = ti.max(even - margin, ti.min(pair_section, even + margin))
        return section

    @ti.func
    def kick_and_drift(self, me, workers, step, numbers, box: ti.template()):
        """Gather the loads of the grains of a worker, kick and drift them."""
        is_due = 0
        for section in range(self.first_part(me, workers), self.first_part(me + 1, workers)):
            is_due = ti.max(is_due, self.move_part(section, step, numbers))
        if is_due == 1:
            self.sync[DUE] = 1

    @ti.func
    def move_sphere(self, me, workers, step, numbers, box: ti.template()):
        """Kick and drift the sphere."""
        if me == 0:
            if self.sphere.move(numbers.dt, numbers.reach2, step - 1) == 1:
                self.sync[DUE] = 1

    @ti.func
    def search_is_due(self, step, numbers):
        """True if a grain, or a wall at that step, has moved as far as the lists allow."""
        return self.sync[DUE] == 1 or step >= numbers.wall_due

    @ti.func
    def count_steps(self, steps_done):
        """Steps done at the end of one."""
        return steps_done + 1


def make_evaluate(phases):
    """Kernel `evaluate(step, dt, box)`: the loads of a configuration, without a step.

    The history of its contacts stays as it is.
    """

    @ti.kernel
    def evaluate(step: ti.i64, dt: ti.f64, box: Walls):
        for contacts in ti.static(phases.contacts):
            for k in range(contacts.blocks()):
                block = contacts.first() + k
                contacts.evaluate(block, contacts.gatherer.place_at_step(block, step, dt, box))

    return evaluate
