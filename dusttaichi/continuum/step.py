"""The time step: kick-drift-kick, one evaluation a step, one screen.

Between two calls the state is positions, densities, stresses and forces at time n, velocities at
n - 1/2. A step kicks and drifts to n + 1, updates the stress there with the velocities of n + 1/2
(density, path, deviator advance once), and computes the forces of n + 1.

The step of the run is an output step of fixed length, which the method divides into time steps
that fit the present speed of sound. `advance(output_steps, pending, workers, numbers, material)`
makes up to that many; with `pending` the first time step has drifted already and lacks the rest (a
search came between). It ends early when a search is due, or where an output step would take too
many time steps (sync[STUCK]). sync[DONE] has the number done, unless both are returned. `most` has
the fastest signals of the step.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import first_of
from dusttaichi.compute.workers import STRIDE, SYNC, assemble, barrier
from dusttaichi.continuum.device import DeviceSteps
from dusttaichi.continuum.kernels.store import APART, DONE, DUE, ENDED, STUCK
from dusttaichi.physics.continuum.kernels import MATERIAL


def make_advance(phases, StepNumbers, kind):
    """Function `advance` over (Motion, Rates, Forces).

    By "workers" (CPU), or by "launches" of a kernel a phase (GPU).
    """
    make = by_workers if kind == "workers" else DeviceSteps
    return make(*phases, StepNumbers)


def by_workers(motion, rates, forces, StepNumbers):
    """Many steps in one kernel: each worker does its share of every phase (compute.workers)."""
    lists, blocks = motion.lists, rates.blocks
    sync, lanes = lists.sync, rates.blocks.lanes

    @ti.kernel
    def advance(
        output_steps: ti.i32,
        pending: ti.i32,
        workers: ti.i32,
        numbers: StepNumbers,
        material: MATERIAL,
    ):
        for k in range(SYNC):
            sync[k] = 0
        for q in range(workers * STRIDE):
            if q % STRIDE == 0:
                me, present = assemble(sync, workers)
                shares = ti.max(present, 1)
                first = first_of(me, shares, blocks.count(numbers))
                behind = first_of(me + 1, shares, blocks.count(numbers))
                begin, end = lanes * first, ti.min(lanes * behind, numbers.count)
                done, met, drifted = 0, 0, pending
                while done < output_steps and present > 0:
                    if drifted == 0:
                        if me == 0:
                            sync[DUE] = motion.move_bodies(numbers)
                        met += present
                        barrier(sync, met)
                        for i in range(begin, end):
                            if motion.kick_and_drift(i, numbers) == 1:
                                sync[DUE] = 1
                        met += present
                        barrier(sync, met)
                        if sync[DUE] == 1:
                            break
                    drifted = 0
                    fastest = 0.0
                    for block in range(first, behind):
                        fastest = ti.max(fastest, rates.pass_over(block, numbers, material))
                    for i in range(begin, end):
                        motion.show_others(i, numbers)
                    lists.most[APART * me] = fastest
                    met += present
                    barrier(sync, met)
                    for block in range(first, behind):
                        forces.pass_over(block, numbers)
                    met += present
                    barrier(sync, met)
                    if me == 0:
                        motion.add_up(numbers)
                        sync[ENDED] += motion.next_step(present, numbers)
                    met += present
                    barrier(sync, met)
                    done = sync[ENDED]
                    if sync[STUCK] == 1:
                        break
                if me == 0:
                    sync[DONE] = done

    return advance
