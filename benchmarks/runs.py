"""Time of whole runs, with output, guards and searches (`python -m benchmarks runs`).

With one thread, with all cores, and with `threads: auto`.
"""

import time
from statistics import median

from benchmarks.task import Stopwatch
from dusttaichi.processes import usable_cores
from dusttaichi.studies.bench import Timed, machine

SCENE = "omni_box"
SIZES, ROUNDS = (1000, 3000, 11_000), 3
QUICK_STEPS = 200_000_000  # grain-steps of a run with --quick, about a quarter of a minute


def main(*, quick=False, sizes=SIZES, rounds=ROUNDS, log=print) -> str:
    """A table of the time of the same steps by number of threads, in turn, `rounds` times.

    quick: the first quarter of a minute of each run, else all of it.
    """
    threads = ("auto", *sorted({1, usable_cores()}))
    lines = [machine(), "", f"{SCENE}, {'its first steps' if quick else 'whole runs'}"]
    for grains in sizes:
        steps = QUICK_STEPS // grains if quick else None
        found = {n: [] for n in threads}
        for number in range(rounds):
            for each in threads:
                log(f"{grains} grains, threads {each}, round {number + 1} of {rounds}")
                with Timed(f"{__name__}:answer") as process:
                    found[each].append(process.ask("run", grains=grains, threads=each, steps=steps))
        lines += ["", f"{grains:,} grains, {found['auto'][0]['steps']:,} steps", *_rows(found)]
    return "\n".join(lines)


def _rows(found):
    best = min(median(run["seconds"] for run in runs) for n, runs in found.items() if n != "auto")
    for n, runs in found.items():
        seconds = [run["seconds"] for run in runs]
        share = 100.0 * median(run["search"] / run["seconds"] for run in runs)
        cores = median(run["processor"] / run["seconds"] for run in runs)
        rates = ", ".join(f"{run['steps'] / run['seconds']:,.0f}" for run in runs)
        yield (
            f"  threads {n!s:<5} {rates} steps/s; {median(seconds) / best:.3f} of the best fixed "
            f"number's time; searches {share:.1f} %, {1e3 * _each(runs):.2f} ms each; "
            f"{cores:.2f} cores"
        )


def _each(runs):
    return median(run["search"] / max(1, run["searches"]) for run in runs)


def answer(parent, *, do, grains, threads, steps):
    """Answer of the worker. do: "run"."""
    from dusttaichi.run.interface import simulate
    from dusttaichi.scene import load

    scene = load(SCENE).with_value("sample.grains", grains).with_value("numerics.threads", threads)
    with simulate(scene, log=lambda text: None) as run:
        run.advance(10)  # loads the kernels
        search = run._run.sim.sim.search
        search.around, first = Stopwatch(), search.count
        began, used = time.perf_counter(), time.process_time()
        if steps is None:
            run.run()
        else:
            run.advance(steps)
        return {
            "steps": run.step,
            "seconds": time.perf_counter() - began,
            "processor": time.process_time() - used,
            "search": search.around.seconds,
            "searches": search.count - first,
        }
