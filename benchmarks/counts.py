"""Instructions of a step and the bytes it moves (`python -m benchmarks counts`).

Unlike times, neither depends on the load of the machine. Where the system does not count
instructions, the process computes a step in single steps.
"""

from concurrent.futures import ThreadPoolExecutor

from benchmarks import sample as bench_sample
from benchmarks.instructions import Stepper
from benchmarks.table import Column, Table
from dusttaichi.studies.bench import Timed, machine

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
    (
        "Bytes per listed pair and step",
        (*PRECISION, Column("what", "number")),
        (
            Column("contacts", "contacts", "B", 0),
            Column("passed_grains", "grains", "B", 0),
            Column("at_once", "at once", "B", 0),
        ),
    ),
)


def main(log) -> Table:
    """Count a step in every precision. Raises DustError where counting is impossible."""
    recipe = bench_sample.Recipe(GRAINS, FILLING_FACTOR)
    bench_sample.prepare(recipe, log)
    rows = [row for precision in PRECISIONS for row in _count_step(recipe, precision, log)]
    return Table(machine(), rows, BLOCKS)


def _count_step(recipe, precision, log):
    log(f"{precision}: counting a step")
    scene = bench_sample.bench_scene(GRAINS, threads=1, precision=precision).to_yaml()
    with Timed(bench_sample.TASK) as process:
        counts, method = (
            process.ask("count", scene=scene, path=str(recipe.path), steps=STEPS),
            "system",
        )
        step = counts["instructions"]
        if step is None:
            method = "single steps"
            log(f"{precision}: in single steps, half a minute")
            step = _count_single_steps(process, counts["process"])
    row = {"precision": precision, "grains": GRAINS, "pairs": counts["pairs"], "by": method}
    row |= {"a_pair": step / counts["pairs"], "a_grain": step / GRAINS}
    for quantity, moved in counts["traffic"].items():
        passes = zip(("contacts", "passed_grains", "at_once"), moved, strict=True)
        yield row | {"what": quantity, **dict(passes)}


def _count_single_steps(process, number):
    """Count the instructions of a step: a call with two steps minus a call with one."""
    with ThreadPoolExecutor() as thread, Stepper(number) as stepper:
        thread.submit(process.ask, "mark_steps")
        once, twice = stepper.instructions(), stepper.instructions()
    return twice - once
