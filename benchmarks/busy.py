"""Speed of a run beside other programs that compute (`python -m benchmarks busy`).

No, one and two such programs, which it starts itself; with one thread, with all cores and with
`threads: auto`, in turn.
"""

import subprocess
from contextlib import contextmanager
from statistics import median

from benchmarks import runs
from benchmarks.table import Column, Table
from dusttaichi.compute.processes import python_command
from dusttaichi.compute.processor import usable_cores
from dusttaichi.studies.machine_speed import Timed, machine

SCENE, GRAINS = "omni_static", 3000
PROGRAMS = (0, 1, 2)  # that compute beside the run
ROUNDS, QUICK_ROUNDS = 5, 3
STEPS, QUICK_STEPS = 100_000, 40_000  # the first of a run, some 40 and 16 s with one thread
COMPUTE = python_command("timeit", "-n", 10**15, "pass")  # without an end
FRONT = Column("programs", "programs beside it"), Column("threads", "threads")
COLUMNS = (
    Column("rates", "steps/s of each round"),
    Column("ratio", "speed over one thread", "1", 3),
    Column("cores", "cores in use", "1", 2),
)


def main(*, quick=False, programs=PROGRAMS, rounds=None, steps=None, log=print) -> Table:
    """Time the same steps by number of threads, in turn, beside each number of programs.

    quick: fewer steps and rounds.
    """
    steps = steps or (QUICK_STEPS if quick else STEPS)
    rounds = rounds or (QUICK_ROUNDS if quick else ROUNDS)
    threads = (1, "auto", *([usable_cores()] if usable_cores() > 1 else []))
    rows = []
    for count in programs:
        measured = {n: [] for n in threads}
        for number in range(rounds):
            # the first of a round is another one each time
            for n in threads[number % len(threads) :] + threads[: number % len(threads)]:
                log(f"{count} programs, threads {n}, round {number + 1} of {rounds}")
                with Timed(f"{runs.__name__}:answer") as process, computing(count):
                    measured[n].append(
                        process.call("run", scene=SCENE, grains=GRAINS, threads=n, steps=steps)
                    )
        rows += [{"programs": count} | row for row in _rows(measured)]
    title = f"{SCENE}, {GRAINS} grains, its first {steps} steps"
    return Table(machine(), rows, [(title, FRONT, COLUMNS)])


@contextmanager
def computing(count):
    """Context beside that many programs that compute without a pause."""
    programs = [subprocess.Popen(COMPUTE) for _ in range(count)]
    try:
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


def _rows(measured):
    """A row for each number of threads; ratio: the median of those of the rounds."""
    for n, answers in measured.items():
        pairs = zip(measured[1], answers, strict=True)
        yield {
            "threads": n,
            "rates": ", ".join(f"{run['steps'] / run['seconds']:.0f}" for run in answers),
            "ratio": median(
                single_thread_run["seconds"] / run["seconds"] for single_thread_run, run in pairs
            ),
            "cores": median(run["processor"] / run["seconds"] for run in answers),
        }
