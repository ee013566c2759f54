"""The time step: leapfrog, one screen. Gather, kick, drift; search when it is due; contacts.

Between two calls the state is x and the history of contacts at time n, the loads of time n, and
v, w at n - 1/2. A step gathers the loads of each grain, kicks v, w to n + 1/2 and drifts x to
n + 1; then it carries the history of contacts with the spins of n + 1/2 and computes the loads of
n + 1 where grains touch. Positions, velocities, spins, rolling, sliding and twisting displacements
are all second order in dt (S12 sect. 4).
"""

from dusttaichi.compute.blocks import on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import Steps, by_launches, by_workers
from dusttaichi.grains.kernels.device import by_threads
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.phases import StepNumbers
from dusttaichi.grains.kernels.store import FIRST_WALL, WALL_BLOCKS


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


def make_advance(phases, layout, kind):
    """`advance(steps, first, pending, workers, numbers, box)` of compute.loops over Phases.

    By "workers" (CPU), or by "launches" of a kernel a phase (GPU).
    """
    own = steps_of(phases)
    if kind == "workers":
        return by_workers(own)
    return by_threads(phases, layout, own) if on_device() else by_launches(own)


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
