"""The time step: kick-drift-kick, one evaluation a step, one screen.

Between two calls the state is positions, densities, stresses and forces at time n, velocities at
n - 1/2. A step kicks and drifts to n + 1, updates the stress there with the velocities of n + 1/2
(density, path, deviator advance once), and computes the forces of n + 1.

The step of the run is an output step of fixed length, which the method divides into time steps
that fit the present speed of sound; it is stuck where it would take too many of them.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import DONE, DUE, Steps
from dusttaichi.compute.scan import first_item
from dusttaichi.continuum.kernels.store import APART

# costs of a block and of a particle near a surface over that of an entry of a list, measured
BLOCK_COST, TOUCH_COST = 20, 25


def steps_of(phases, StepNumbers):
    """The Steps of Phases: motion of bodies and particles, search, stresses, forces, next step."""
    return Steps(
        phases.sync,
        before_search=(phases.move_bodies, phases.kick_and_drift),
        is_due=phases.search_is_due,
        after_search=(phases.respond, phases.push, phases.end),
        count_steps=phases.count_steps,
        Numbers=StepNumbers,
        Outside=phases.rates.law.Material,
    )


@ti.data_oriented
class Phases:
    """The phases of a step on a share of the particles, in whole blocks."""

    def __init__(self, motion, rates, forces):
        self.motion, self.rates, self.forces = motion, rates, forces
        self.lists, self.blocks = motion.lists, rates.blocks
        self.sync, self.lanes = motion.lists.sync, rates.blocks.lanes

    @ti.func
    def share_of_blocks(self, worker, workers, numbers: ti.template()):
        """First block of a share of the passes, and the one behind its last."""
        first, behind = 0, self.blocks.count(numbers)
        if workers > 1:
            first = self.find_block(worker, workers, numbers)
            behind = self.find_block(worker + 1, workers, numbers)
        return first, behind

    @ti.func
    def find_block(self, worker, workers, numbers: ti.template()):
        """First block of a worker: all have about the same costs."""
        first, end = 0, self.blocks.count(numbers)
        before = self.cost_before(end, numbers) * worker // workers
        while first < end:
            middle = (first + end) // 2
            if self.cost_before(middle, numbers) < before:
                first = middle + 1
            else:
                end = middle
        return first

    @ti.func
    def cost_before(self, block, numbers: ti.template()):
        """Cost of the passes over all blocks before one, in that of an entry of their lists."""
        out = ti.cast(self.lists.first[block], ti.i64) + BLOCK_COST * block
        if ti.static(self.motion.layout.rigid):
            particle = ti.min(self.lanes * block, numbers.count)
            out += TOUCH_COST * ti.cast(self.lists.touch_first[particle], ti.i64)
        return out

    @ti.func
    def share_of_particles(self, worker, workers, numbers: ti.template()):
        """First particle of a share of their motion, and the one behind its last."""
        n = self.blocks.count(numbers)
        first, behind = first_item(worker, workers, n), first_item(worker + 1, workers, n)
        return self.lanes * first, ti.min(self.lanes * behind, numbers.count)

    @ti.func
    def move_bodies(self, worker, workers, step, numbers: ti.template(), material: ti.template()):
        """Kick and drift faces and rigid bodies."""
        if worker == 0:
            self.sync[DUE] = self.motion.move_bodies(numbers)

    @ti.func
    def kick_and_drift(
        self, worker, workers, step, numbers: ti.template(), material: ti.template()
    ):
        """Kick and drift the particles of a share."""
        begin, end = self.share_of_particles(worker, workers, numbers)
        for i in range(begin, end):
            if self.motion.kick_and_drift(i, numbers) == 1:
                self.sync[DUE] = 1

    @ti.func
    def search_is_due(self, step, numbers: ti.template()):
        """True if a particle or a body has gone as far as the lists allow."""
        return self.sync[DUE] == 1

    @ti.func
    def respond(self, worker, workers, step, numbers: ti.template(), material: ti.template()):
        """Stresses of the particles of a share, and its fastest signal."""
        first, behind = self.share_of_blocks(worker, workers, numbers)
        fastest = 0.0
        for block in range(first, behind):
            fastest = ti.max(fastest, self.rates.pass_over(block, numbers, material))
        for i in range(self.lanes * first, ti.min(self.lanes * behind, numbers.count)):
            self.motion.show_others(i, numbers)
        self.lists.most[APART * worker] = fastest

    @ti.func
    def push(self, worker, workers, step, numbers: ti.template(), material: ti.template()):
        """Forces on the particles of a share."""
        first, behind = self.share_of_blocks(worker, workers, numbers)
        for block in range(first, behind):
            self.forces.pass_over(block, numbers)

    @ti.func
    def end(self, worker, workers, step, numbers: ti.template(), material: ti.template()):
        """Loads on faces and rigid bodies, and the length of the next step."""
        if worker == 0:
            self.motion.add_up(numbers)
            self.sync[DONE] += self.motion.next_step(workers, numbers)

    @ti.func
    def count_steps(self, steps_done):
        """Output steps done at the end of a step."""
        return self.sync[DONE]
