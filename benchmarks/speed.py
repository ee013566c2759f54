"""Speed, start and memory, compared with LAMMPS (`python -m benchmarks speed`).

Because of the noise of machines, every configuration of a size stays in a process of its own, each
round times all of them in turn, and a ratio is that of two consecutive measurements.
"""

import math
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from statistics import median

from benchmarks import lammps as lammps_bench
from benchmarks import sample as bench_sample
from benchmarks.sample import TASK, prepare
from benchmarks.table import Column, Table, check_file
from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.scene.numerics import PRESETS
from dusttaichi.studies.machine_speed import Timed, machine

SIZES = (1_000, 11_000, 100_000)
FILLING_FACTORS, THREADS = (0.15, 0.35, 0.55), (1, 2)
PRECISION = PRESETS["balanced"]["precision"]
ROUNDS, QUICK_ROUNDS = 3, 2
GRAIN_STEPS, LAMMPS_GRAIN_STEPS = 10_000_000, 1_000_000  # of a measurement, about a second
LEAST_STEPS, LAMMPS_LEAST_STEPS = 200, 30

# medians over the rounds; of a step with contacts, grains, walls, search and ledger
SPEED = (
    Column("grains", "grains"),
    Column("filling_factor", "filling factor", "", 3),
    Column("precision", "precision"),
    Column("threads", "threads"),
), (
    Column("contacts", "contacts per grain", "1/grain", 2),
    Column("ns_per_contact", "ns per contact", "ns", 1),
    Column("ns_per_grain_step", "ns per grain-step", "ns", 1),
    Column("search", "search %", "%", 1),
    Column("ledger", "ledger %", "%", 1),
    Column("spread", "spread %", "%", 0),  # largest minus smallest round over the median
    Column("speed_up", "speed-up x 1 thread", "x 1 thread", 2),
    Column("lammps_ns_per_contact", "LAMMPS, ns per contact", "ns", 0),
    Column("lammps_ratio", "LAMMPS x ours", "x ours", 1),
)  # fmt: skip
# of a process with one thread; cold: with an empty cache of kernels
START = (SPEED[0][0], SPEED[0][2]), (
    Column("cold", "first step cold, s", "s", 1),
    Column("warm", "first step warm, s", "s", 1),
    Column("peak", "peak memory MB", "MB", 0),
    Column("peak_per_grain", "peak, B per grain", "B", 0),
    Column("fields_per_grain", "fields, B per grain", "B", 0),
)  # fmt: skip
NOTES = (
    "Time: contacts, grains, walls, search at its rate, ledger every 1000 steps; medians of {} "
    "rounds; per contact of two grains. Speed-up and LAMMPS: ratios of two times of one round.",
    "Scene: silicate, modified model (rolling 8, sliding 2.5), viscous damping 1e-6 g/s, step "
    "0.3 ns, wall at 1 cm/s, grains start at 1 cm/s rms.",
    "First step: from the start of the process; cold minus warm is compilation. Peak per grain: "
    "growth from the smallest sample.",
)


def main(
    sizes=None,
    filling_factors=FILLING_FACTORS,
    threads=THREADS,
    *,
    steps: int | None = None,
    lammps: bool = True,
    out: str | Path | None = None,
    quick: bool = False,
    rounds: int | None = None,
    log=lambda line: None,
) -> Table:
    """Measure speed, start and memory for every combination; ten minutes, `quick` two.

    sizes: numbers of grains; by default 1e3, 1.1e4 and, if not quick, 1e5. steps: of a measurement;
    by default for about a second. lammps: time LAMMPS, too; a missing one becomes a note. out: CSV
    file to write. rounds: 3, quick 2. log: called with lines on the progress. Raises DustError when
    a process of the benchmark fails.
    """
    check_file(out)
    rounds = rounds or (QUICK_ROUNDS if quick else ROUNDS)
    rows, about, notes = [], [], [NOTES[0].format(rounds), *NOTES[1:]]
    try:
        about += [f"LAMMPS {lammps_bench.lammps_version()}"] if lammps else []
    except DustError as error:
        notes.append(f"Without a comparison: {error}")
    with tempfile.TemporaryDirectory(prefix="dust-bench-") as scratch:
        smallest = None
        for grains in sizes or (SIZES[:2] if quick else SIZES):
            kernels = Path(scratch) / f"{grains}"
            start = _measure_start(grains, kernels, log)
            smallest = smallest or start
            extra_grains = grains - smallest["grains"]
            growth = (
                1e6 * (start["peak"] - smallest["peak"]) / extra_grains
                if extra_grains
                else math.nan
            )
            cases = [(f, n) for f in filling_factors for n in threads]
            options = {"steps": steps, "rounds": rounds, "lammps": bool(about), "log": log}
            speed_rows = _measure_speed(grains, cases, kernels, notes, **options)
            rows += [start | {"peak_per_grain": growth} | row for row in speed_rows]
    blocks = ("Speed", *SPEED), ("Start and memory", *START)
    table = Table(machine(*about), rows, blocks, tuple(dict.fromkeys(notes)))
    if out is not None:
        table.to_csv(out)
    return table


# -- start and memory ------------------------------------------------------------------------------


def _measure_start(grains, kernels, log) -> dict:
    """Time from the start of a process to its first step, and memory."""
    log(f"{grains} grains: first step and memory")
    recipe = bench_sample.Recipe(grains, bench_sample.CAKE)  # made without kernels
    prepare(recipe, log, kernels)
    (cold, _), (warm, memory) = (_first_step(recipe, kernels) for _ in range(2))
    measures = {"cold": cold, "warm": warm, "peak": memory["peak"] / 1e6}
    return {"grains": grains, **measures, "fields_per_grain": memory["fields"] / grains}


def _first_step(recipe, kernels):
    """(seconds from the start of a process to its first step, its memory)."""
    begin = time.perf_counter()
    with Timed(TASK, kernels) as process:
        process.call("build", **_build_arguments(recipe, 1))
        return time.perf_counter() - begin, process.call("memory")


def _build_arguments(recipe, threads):
    """Assemble the arguments of task.Benchmark.build."""
    scene = bench_sample.bench_scene(recipe.grains, threads=threads, precision=PRECISION)
    return {"scene": scene.to_yaml(), "path": str(recipe.path)}


# -- speed -------------------------------------------------------------------------------------


def _measure_speed(grains, cases, kernels, notes, *, steps, rounds, lammps, log) -> list[dict]:
    """A row for each case, (filling factor, threads)."""
    recipes = {f: bench_sample.Recipe(grains, f) for f, _ in cases}
    for recipe in recipes.values():
        prepare(recipe, log, kernels)
    steps_of_ours = steps or max(LEAST_STEPS, GRAIN_STEPS // grains)
    theirs_steps = max(LAMMPS_LEAST_STEPS, LAMMPS_GRAIN_STEPS // grains)
    theirs_steps = min(theirs_steps, steps or theirs_steps)
    with ExitStack() as stack:
        processes, boxes = {}, {}
        for case in cases:
            processes[case] = stack.enter_context(Timed(TASK, kernels))
            boxes[case] = processes[case].call(
                "build", **_build_arguments(recipes[case[0]], case[1])
            )["box"]
            processes[case].call("time", steps=max(steps_of_ours // 5, 1))  # loads the kernels
        ours, theirs = {case: [] for case in cases}, {case: [] for case in cases}
        for number in range(rounds):
            log(f"{grains} grains: round {number + 1} of {rounds}")
            for case in cases:
                ours[case].append(processes[case].call("time", steps=steps_of_ours))
                if lammps:
                    recipe, box = recipes[case[0]], boxes[case]
                    theirs[case] += _time_lammps(recipe, case[1], box, theirs_steps, notes)
    return [_make_row(recipes[case[0]], case, ours, theirs[case]) for case in cases]


def _time_lammps(recipe, threads, box, steps, notes):
    """A list of one timing of LAMMPS, or of none with a note on the reason."""
    sample, scene = bench_sample.load(recipe.path), bench_sample.bench_scene(recipe.grains)
    try:
        timing = lammps_bench.time_lammps(
            sample.positions,
            scene.material,
            bench_sample.MODIFIERS,
            box,
            steps=steps,
            time_step_s=bench_sample.TIME_STEP,
            threads=threads,
            velocities_m_s=sample.velocities,
            kappa=bench_sample.KAPPA,
        )
    except DustError as error:
        notes.append(f"LAMMPS on {threads} processes: {error}")
        return []
    return [timing]


def _make_row(recipe, case, ours, theirs) -> dict:
    """Row of a case. ours: answers of task.Benchmark.time by case. theirs: LAMMPS's, or none."""
    sample, grains = bench_sample.load(recipe.path), recipe.grains
    radius = bench_sample.bench_scene(grains).material.radius
    seconds = {
        case_of_seconds: [timing["seconds"] for timing in timings]
        for case_of_seconds, timings in ours.items()
    }
    step, contacts = median(seconds[case]), median(timing["contacts"] for timing in ours[case])
    case_of_seconds = seconds.get((case[0], 1))
    row = {
        "filling_factor": samples.filling_factor(sample, radius),
        "precision": PRECISION,
        "threads": case[1],
        "contacts": contacts / grains,
        "ns_per_contact": 1e9 * step / contacts if contacts else math.nan,
        "ns_per_grain_step": 1e9 * step / grains,
        "search": _median_share("search", ours[case]),
        "ledger": _median_share("ledger", ours[case]),
        "spread": 100 * (max(seconds[case]) - min(seconds[case])) / step,
        "speed_up": _median_ratio(case_of_seconds, seconds[case]) if case_of_seconds else math.nan,
    }
    if len(theirs) == len(seconds[case]):
        row["lammps_ns_per_contact"] = median(1e9 * s / max(1, n) for s, n in theirs)
        row["lammps_ratio"] = _median_ratio([s for s, _ in theirs], seconds[case])
    return row


def _median_share(phase: str, rounds) -> float:
    return 100 * median(timing[phase] / timing["seconds"] for timing in rounds)


def _median_ratio(above, below) -> float:
    return median(a / b for a, b in zip(above, below, strict=True))
