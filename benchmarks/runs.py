"""Time of whole runs, with output, guards and searches (`python -m benchmarks runs`).

With one thread, with all cores, and with `threads: auto`.
"""

import time
from statistics import median

from benchmarks.table import Column, Table
from dusttaichi.compute.processor import usable_cores
from dusttaichi.studies.machine_speed import Timed, machine

SCENE = "omni_box"
SIZES, ROUNDS = (1000, 3000, 11_000), 3
QUICK_STEPS = 200_000_000  # grain-steps of a run with --quick, about a quarter of a minute
FRONT = Column("grains", "grains"), Column("steps", "steps"), Column("threads", "threads")
COLUMNS = (
    Column("rates", "steps/s of each round"),
    Column("over_best", "time over best number", "1", 3),
    Column("share", "searches, %", "%", 1),
    Column("search", "ms per search", "ms", 2),
    Column("cores", "cores in use", "1", 2),
)


def main(*, quick=False, sizes=SIZES, rounds=ROUNDS, log=print) -> Table:
    """Time the same steps by number of threads, in turn, `rounds` times.

    quick: the first quarter of a minute of each run, else all of it.
    """
    threads = ("auto", *sorted({1, usable_cores()}))
    rows = []
    for grains in sizes:
        steps = QUICK_STEPS // grains if quick else None
        runs_by_threads = {n: [] for n in threads}
        for number in range(rounds):
            for thread_count in threads:
                log(f"{grains} grains, threads {thread_count}, round {number + 1} of {rounds}")
                with Timed(f"{__name__}:answer") as process:
                    runs_by_threads[thread_count].append(
                        process.call("run", grains=grains, threads=thread_count, steps=steps)
                    )
        rows += [{"grains": grains} | row for row in _rows(runs_by_threads)]
    title = f"{SCENE}, {'its first steps' if quick else 'whole runs'}"
    return Table(machine(), rows, [(title, FRONT, COLUMNS)])


def _rows(runs_by_threads):
    best = min(
        median(run["seconds"] for run in runs) for n, runs in runs_by_threads.items() if n != "auto"
    )
    for n, runs in runs_by_threads.items():
        yield {
            "threads": n,
            "steps": runs[0]["steps"],
            "rates": ", ".join(f"{run['steps'] / run['seconds']:.0f}" for run in runs),
            "over_best": median(run["seconds"] for run in runs) / best,
            "share": 100.0 * median(run["search"] / run["seconds"] for run in runs),
            "search": 1e3 * median(run["search"] / max(1, run["searches"]) for run in runs),
            "cores": median(run["processor"] / run["seconds"] for run in runs),
        }


def answer(parent, *, do, grains, threads, steps, scene=SCENE):
    """Answer of the worker. do: "run"; scene: name of a bundled one; steps: None for all."""
    from benchmarks.task import Stopwatch
    from dusttaichi.running.interface import simulate
    from dusttaichi.scene import load

    scene = load(scene).with_values({"sample.grains": grains, "numerics.threads": threads})
    with simulate(scene, log=lambda text: None) as run:
        run.advance(10)  # loads the kernels
        search = run._run.sim.search
        search.stopwatch, first = Stopwatch(), search.count
        began, used = time.perf_counter(), time.process_time()
        if steps is None:
            run.run()
        else:
            run.advance(steps)
        return {
            "steps": run.step - 10,
            "seconds": time.perf_counter() - began,
            "processor": time.process_time() - used,
            "search": search.stopwatch.seconds,
            "searches": search.count - first,
        }
