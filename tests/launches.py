"""Launches of a device on the cores of a CPU: what the host does for a device, without one."""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import DONE, HALT, STOP, Arguments, Launches, by_workers, conclude

SHARES = 8  # of a phase


def advance_by(execution, step_phases, by_threads):
    """compute.loops.advance_by, but for launches, which here are those of the CPU."""
    return by_workers(step_phases) if execution == "workers" else by_launches(step_phases)


def by_launches(step_phases):
    """Launches of Steps on the cores of a CPU: a share of a phase at a time."""
    arguments = Arguments(step_phases)
    sync, numbers, outside, first = (
        arguments.sync,
        arguments.numbers,
        arguments.outside,
        arguments.first,
    )
    is_due, count_steps = step_phases.is_due, step_phases.count_steps

    def kernel_of(run, may_wait):
        @ti.kernel
        def launch():
            for worker in range(SHARES):
                step = first[None] + sync[DONE] + 1
                if sync[STOP] == 0:
                    if ti.static(may_wait):
                        if not is_due(step, numbers[None]):
                            run(worker, SHARES, step, numbers[None], outside[None])
                    else:
                        run(worker, SHARES, step, numbers[None], outside[None])

        return launch

    @ti.kernel
    def end():
        for _ in range(1):
            if sync[STOP] == 0:
                if is_due(first[None] + sync[DONE] + 1, numbers[None]):
                    sync[STOP] = HALT
                else:
                    sync[DONE] = count_steps(sync[DONE])
                    conclude(sync)

    before_search = [
        kernel_of(run, False) for runs in step_phases.before_search for run in _all(runs)
    ]
    after_search = [kernel_of(run, True) for runs in step_phases.after_search for run in _all(runs)]
    return Launches(arguments, before_search, [*after_search, end], divided=True)


def _all(phases):
    return phases if isinstance(phases, tuple) else (phases,)
