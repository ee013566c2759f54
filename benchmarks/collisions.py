"""Collisions a second against the number side by side (`python -m benchmarks collisions`).

One process, and two at the same time as `dust collide` has on two cores, make the same collisions,
whose samples are made before the clock starts. Processor time, which other programs affect less
than wall time.
"""

from __future__ import annotations

import statistics
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

from benchmarks.table import Column, Table, check_file
from dusttaichi.errors import DustError
from dusttaichi.studies.bench import Timed, machine

TASK = "benchmarks.collisions:answer"
SCENE = """
name: collisions
material: ice_t19
interaction: {{damping: {{model: scaled, coefficient: 0.01}}}}
sample:
  kind: collision
  target: {{kind: pca, grains: {grains}, seed: 1}}
  projectile: {{kind: pca, grains: {grains}, seed: 1001}}
  speed: 30 m/s
boundary: {{kind: open}}
stop: {{time: 0.2 us}}
numerics: {{threads: 1}}
"""
SIZES = (16, 64, 250)  # grains of a body
QUICK = (16,)
PROCESSES = (1, 2)
ABREAST = (1, 2, 4, 8, 16, 32, 64)
MOST = 4000  # grains side by side
LEAST = 8  # collisions that are timed
FRONT = (Column("grains", "grains of both"), Column("processes", "processes"))
NUMBERS = (
    Column("abreast", "side by side"),
    Column("rate", "collisions a second of processor time", "1/s", 2),
    Column("gain", "over one by one", "1", 2),
    Column("spread", "spread, %", "%", 0),
)
NOTE = (
    "Of collisions that touch head-on, without their samples; of two processes the sum of both. "
    "Medians of the repetitions and their spread."
)


def main(*, out=None, quick=False, repetitions=3, log=print) -> Table:
    """Measure every number side by side of every size; out: CSV file. log: called with lines."""
    check_file(out)
    rows, table = [], None
    for grains in QUICK if quick else SIZES:
        numbers = [n for n in ABREAST if 2 * grains * n <= MOST]
        for processes in PROCESSES:
            rates = _rates(grains, numbers, processes, repetitions, log)
            for abreast, values in rates.items():
                rate = statistics.median(values)
                row = {"grains": 2 * grains, "processes": processes, "abreast": abreast}
                row |= {"rate": rate, "gain": rate / statistics.median(rates[1])}
                row["spread"] = 100.0 * (max(values) - min(values)) / rate
                rows.append(row)
            table = Table(machine(), rows, [("Collisions side by side", FRONT, NUMBERS)], (NOTE,))
            if out is not None:
                table.to_csv(out)
    return table


def _rates(grains, numbers, processes, repetitions, log):
    """Number side by side -> collisions a second of each repetition, all in turn."""
    rates = {number: [] for number in numbers}
    count = max(LEAST, numbers[-1])
    with ExitStack() as stack:
        timed = [stack.enter_context(Timed(TASK)) for _ in range(processes)]
        pool = stack.enter_context(ThreadPoolExecutor(processes))

        def ask(do, **how):
            return list(pool.map(lambda process: process.ask(do, **how), timed))

        ask("prepare", grains=grains, count=count)
        for number in numbers:  # kernels
            ask("make", abreast=number, count=number)
        for _ in range(repetitions):
            for number in numbers:
                seconds = [answer["seconds"] for answer in ask("make", abreast=number, count=count)]
                rates[number].append(sum(count / s for s in seconds))
                log(f"{2 * grains} grains, {number} side by side: {seconds} s")
    return rates


PREPARED: list = []


def answer(parent, *, do, **arguments):
    """Task of the process: `prepare` collisions, or `make` some of them."""
    return {"prepare": _prepare, "make": _make}[do](**arguments)


def _prepare(grains, count):
    from dusttaichi import samples
    from dusttaichi.scene import from_yaml
    from dusttaichi.studies.collide_course import Collision

    base = from_yaml(SCENE.format(grains=grains))
    for number in range(count):
        seeds = {"sample.target.seed": 1 + number, "sample.projectile.seed": 1001 + number}
        scene = base.with_values(seeds)
        PREPARED.append(Collision(number, scene, samples.make(scene)))


def _make(abreast, count):
    import time

    from dusttaichi.studies.collide_batch import make_collisions

    errors, began = [], time.process_time()
    make_collisions(
        iter(PREPARED[:count]), abreast, 10**9, lambda label, row, *error: errors.extend(error)
    )
    if errors:
        raise DustError(str(errors[0]))
    return {"seconds": time.process_time() - began}
