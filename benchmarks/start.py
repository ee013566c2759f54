"""Time from the start of a process to its first step, and memory per grain."""

import math
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks import sample as bench_sample
from benchmarks.table import Start
from benchmarks.timing import TASK, Plan, prepare
from dusttaichi.errors import DustError
from dusttaichi.studies.bench import Timed


def starts_and_precisions(plan: Plan, sizes, notes) -> tuple[list[Start], tuple[str, ...]]:
    """(a Start for each size and precision, precisions that the build accepts)."""
    starts, usable = [], []
    for precision in plan.precisions:
        try:
            starts += _starts_of(plan, sizes, precision)
            usable.append(precision)
        except Refused as refused:
            reason = " ".join(str(refused).split())
            notes.append(f"{precision}: refused: {reason}")
    if not usable:
        raise DustError("; ".join(notes))
    return starts, tuple(usable)


class Refused(Exception):
    """The build refuses a precision."""


def _starts_of(plan: Plan, sizes, precision: str) -> Iterator[Start]:
    smallest = None
    for grains in sizes:
        plan.log(f"{grains} grains, {precision}: first step and memory")
        recipe = bench_sample.Recipe(grains, bench_sample.CAKE)  # made without kernels
        prepare(recipe, plan.log, plan.kernels_of(grains))
        kernels = plan.kernels_of(grains, precision)
        cold, _ = _first_step(kernels, recipe, precision)
        warm, memory = _first_step(kernels, recipe, precision)
        smallest = smallest or (grains, memory["peak"])
        growth = math.nan
        if grains > smallest[0]:
            growth = (memory["peak"] - smallest[1]) / (grains - smallest[0])
        yield Start(
            grains=grains,
            precision=precision,
            cold=cold,
            warm=warm,
            peak=memory["peak"] / 1e6,
            peak_per_grain=growth,
            fields_per_grain=memory["fields"] / grains,
        )


def _first_step(kernels: Path, recipe, precision: str) -> tuple[float, dict]:
    """Seconds from the start of a process to its first step, and its memory."""
    begin = time.perf_counter()
    with Timed(TASK, kernels) as process:
        try:
            process.ask(
                "build", grains=recipe.grains, path=str(recipe.path), threads=1, precision=precision
            )
        except DustError as error:
            raise Refused(error) from error
        return time.perf_counter() - begin, process.ask("memory")
