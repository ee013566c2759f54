"""Launches of a device on the cores of a CPU: what the host does for a device, without one."""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import DONE, HALT, STOP, Arguments, Launches, by_workers, conclude

SHARES = 8  # of a phase


def advance_by(kind, own, by_threads):
    """compute.loops.advance_by, but for launches, which here are those of the CPU."""
    return by_workers(own) if kind == "workers" else by_launches(own)


def by_launches(own):
    """Launches of Steps on the cores of a CPU: a share of a phase at a time."""
    known = Arguments(own)
    sync, numbers, outside, first = known.sync, known.numbers, known.outside, known.first
    is_due, made = own.is_due, own.made

    def kernel_of(run, may_wait):
        @ti.kernel
        def launch():
            for share in range(SHARES):
                step = first[None] + sync[DONE] + 1
                if sync[STOP] == 0:
                    if ti.static(may_wait):
                        if not is_due(step, numbers[None]):
                            run(share, SHARES, step, numbers[None], outside[None])
                    else:
                        run(share, SHARES, step, numbers[None], outside[None])

        return launch

    @ti.kernel
    def end():
        for _ in range(1):
            if sync[STOP] == 0:
                if is_due(first[None] + sync[DONE] + 1, numbers[None]):
                    sync[STOP] = HALT
                else:
                    sync[DONE] = made(sync[DONE])
                    conclude(sync)

    before = [kernel_of(run, False) for runs in own.before for run in _all(runs)]
    after = [kernel_of(run, True) for runs in own.after for run in _all(runs)]
    return Launches(known, before, [*after, end], divided=True)


def _all(phases):
    return phases if isinstance(phases, tuple) else (phases,)
