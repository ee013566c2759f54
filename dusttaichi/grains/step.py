"""The time step: leapfrog, one screen. Gather, kick, drift; search when it is due; contacts.

Between two calls the state is x and the history of contacts at time n, the loads of time n, and
v, w at n - 1/2. A step gathers the loads of each grain, kicks v, w to n + 1/2 and drifts x to
n + 1; then it carries the history of contacts with the spins of n + 1/2 and computes the loads of
n + 1 where grains touch. Positions, velocities, spins, rolling, sliding and twisting displacements
are all second order in dt (S12 sect. 4).

`advance(steps, first, pending, workers, numbers, box)` makes up to `steps`
steps from step number `first`; with `pending` the first one has drifted already and lacks its
contacts (a search came between). It ends early when a search is due. It returns how many it has
made, or None where sync[DONE] has that number.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.workers import STRIDE, SYNC, assemble, barrier
from dusttaichi.grains.kernels.device import DeviceSteps
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.phases import DONE, StepNumbers
from dusttaichi.grains.kernels.store import FIRST_WALL, WALL_BLOCKS


def make_advance(phases, layout, kind):
    """`advance` over Phases: by "workers" (CPU), or by "launches" of a kernel a phase (GPU)."""
    return by_workers(phases) if kind == "workers" else DeviceSteps(phases, layout)


def by_workers(phases):
    """Many steps in one kernel: workers that pass their share of every phase (compute.workers)."""
    sync = phases.sync

    @ti.kernel
    def advance(
        steps: ti.i32,
        first: ti.i64,
        pending: ti.i32,
        workers: ti.i32,
        numbers: StepNumbers,
        box: Walls,
    ):
        ti.loop_config(serialize=True)
        for k in range(SYNC):
            sync[k] = 0
        for q in range(workers * STRIDE):
            if q % STRIDE == 0:
                me, present = assemble(sync, workers)
                done, met, drifted = 0, 0, pending
                while done < steps and present > 0:
                    step = first + done + 1
                    if drifted == 0:
                        phases.kick_and_drift(me, present, step, numbers)
                        met += present
                        barrier(sync, met)
                        if phases.search_is_due(step, numbers):
                            break
                    drifted = 0
                    phases.touch(me, present, step, numbers.dt, box)
                    met += present
                    barrier(sync, met)
                    done += 1
                if me == 0:
                    sync[DONE] = done

    return advance


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
