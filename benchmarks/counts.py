"""Instructions of a step of grains (`python -m benchmarks counts`).

Unlike times, they do not depend on the load of the machine. Where the system does not count
instructions, the process computes a step in single steps.
"""

from concurrent.futures import ThreadPoolExecutor

from benchmarks import sample as bench_sample
from benchmarks.instructions import Stepper
from benchmarks.table import Column, Table
from dusttaichi.studies.machine_speed import Timed, machine

GRAINS, FILLING_FACTOR, STEPS = 1000, 0.35, 100
PRECISIONS = ("f64", "mixed")
PRECISION = (Column("precision", "precision"),)
BLOCKS = (
    (
        "Instructions of a step",
        PRECISION,
        (
            Column("grains", "grains"),
            Column("pairs", "listed pairs"),
            Column("a_pair", "per listed pair", "1", 0),
            Column("a_grain", "per grain", "1", 0),
            Column("by", "counted by"),
        ),
    ),
)


def main(log) -> Table:
    """Count a step in every precision. Raises DustError where counting is impossible."""
    recipe = bench_sample.Recipe(GRAINS, FILLING_FACTOR)
    bench_sample.prepare(recipe, log)
    rows = [_count_step(recipe, precision, log) for precision in PRECISIONS]
    return Table(machine(), rows, BLOCKS)


def _count_step(recipe, precision, log):
    log(f"{precision}: counting a step")
    scene = bench_sample.bench_scene(GRAINS, threads=1, precision=precision).to_yaml()
    with Timed(bench_sample.TASK) as process:
        counts, method = (
            process.call("count", scene=scene, path=str(recipe.path), steps=STEPS),
            "system",
        )
        step = counts["instructions"]
        if step is None:
            method = "single steps"
            log(f"{precision}: in single steps, half a minute")
            step = _count_single_steps(process, counts["process"])
    row = {"precision": precision, "grains": GRAINS, "pairs": counts["pairs"], "by": method}
    return row | {"a_pair": step / counts["pairs"], "a_grain": step / GRAINS}


def _count_single_steps(process, number):
    """Count the instructions of a step: a call with two steps minus a call with one."""
    with ThreadPoolExecutor() as thread, Stepper(number) as stepper:
        thread.submit(process.call, "mark_steps")
        once, twice = stepper.instructions(), stepper.instructions()
    return twice - once
