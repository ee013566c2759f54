"""Common parts of the benchmarks: plan, preparation of samples, time of a step."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks import sample as bench_sample
from dusttaichi.errors import DustError
from dusttaichi.results.outputs import check
from dusttaichi.studies.bench import Timed

TASK = "benchmarks.task:answer"
GRAIN_STEPS, LAMMPS_GRAIN_STEPS = 10_000_000, 1_000_000  # of a measurement, about a second
LEAST_STEPS, LAMMPS_LEAST_STEPS = 200, 30


@dataclass(frozen=True)
class Plan:
    """Plan of a benchmark, with the folder of its kernels."""

    filling_factors: tuple[float, ...]
    threads: tuple[int, ...]
    steps: int | None
    precisions: tuple[str, ...]
    lammps: bool
    rounds: int
    kernels: Path
    log: Callable[[str], None]

    def kernels_of(self, grains: int, precision: str = "f64") -> Path:
        """Folder of the compiled kernels for a number of grains."""
        return self.kernels / f"{grains}_{precision}"

    def our_steps(self, grains: int) -> int:
        """Steps of a measurement."""
        return self.steps or max(LEAST_STEPS, GRAIN_STEPS // grains)

    def lammps_steps(self, grains: int) -> int:
        """Steps of a measurement of LAMMPS."""
        steps = max(LAMMPS_LEAST_STEPS, LAMMPS_GRAIN_STEPS // grains)
        return min(steps, self.steps or steps)


def prepare(recipe, log: Callable[[str], None], kernels: Path | None = None) -> None:
    """Make the sample of a recipe in a process of its own, unless it is stored."""
    if bench_sample.load(recipe.path) is not None:
        return
    log(f"{recipe.grains} grains: making the sample of filling factor {recipe.filling_factor:g}")
    with Timed(TASK, kernels) as process:
        process.ask("prepare", grains=recipe.grains, filling_factor=recipe.filling_factor)


def seconds_a_step(timing: dict) -> float:
    """Seconds of a step: the sum of the answer of `task.Benchmark.time`."""
    return timing["step"] + timing["search"] + timing["ledger"]


def check_file(out) -> None:
    """Raise DustError for a file that cannot be written, before the measurements."""
    if out is None:
        return
    try:
        check(out, "; dusttaichi ").open("a").close()
    except OSError as error:
        raise DustError(f"{out} cannot be written: {error.strerror}") from error
