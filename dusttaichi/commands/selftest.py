"""`dust bench` and `dust selftest`: speed of this machine, and correctness of a backend on it."""

import sys
from typing import Annotated, Literal

import typer

from dusttaichi.commands.console import remark, say, say_table
from dusttaichi.errors import DustError


def bench():
    """Measure how fast this machine is: steps/s of two scenes on one thread and on all cores."""
    from dusttaichi.studies import bench

    say(bench.text(bench.main(log=remark)))


def selftest(
    *,
    backend: Annotated[Literal["cpu", "cuda"], typer.Option(help="device of the kernels")] = "cpu",
    sizes: Annotated[
        str, typer.Option(help="grains of the timed samples", metavar="N,N,...")
    ] = "1e4,1e5,1e6",
    speed: Annotated[bool, typer.Option(help="also measure the time of a step")] = True,
):
    """Check a backend: four small scenes against stored states, the ledger, the time of a step.

    The exit code is 1 if a scene differs from its reference. With --backend cuda the CPU is timed
    as well, and a warning lists the sizes at which it is faster.
    """
    from dusttaichi.studies.selftest import checks, scenes

    numbers = _numbers(sizes)
    name, memory = checks.describe(backend)
    size = "" if memory is None else f", {memory / checks.GIB:.1f} GiB of memory"
    say(f"{backend}: {name}{size}\n")
    outcomes = [checks.check(scene, backend) for scene in scenes.CHANGES]
    _show_outcomes(outcomes)
    if speed:
        speeds = [checks.measure_speed(n, backend) for n in numbers]
        others = []
        if backend != "cpu":
            others = [checks.measure_speed(n, "cpu") for n in numbers]
        _show_speeds([*speeds, *others])
        _warn(checks.slower_sizes(speeds, others) if others else [], backend)
    if not all(outcome.passed for outcome in outcomes):
        say("\nThis backend computes wrong results on this machine: do not use it.")
        sys.exit(1)


def _numbers(text):
    """Sizes of the option --sizes."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or any(n != int(n) or not 1e3 <= n <= 1e7 for n in found):
        raise DustError(
            f"--sizes {text}: whole numbers from 1e3 to 1e7 with commas between them are needed, "
            "such as --sizes 1e4,1e5"
        )
    return [int(n) for n in found]


def _show_outcomes(outcomes):
    headings = ("scene", "largest difference", "allowed", "ledger open by", "same bits", "searches")
    rows = [
        (
            o.name,
            f"{o.difference:.1e}",
            f"{o.tolerance:.0e}",
            f"{abs(o.residual):.1e}",
            "yes" if o.same_bits else "no",
            str(o.searches),
            "passed" if o.passed else "WRONG",
        )
        for o in outcomes
    ]
    say_table(rows, *headings, "verdict")


def _show_speeds(speeds):
    headings = ("backend", "grains", "contacts", "ns per contact", "ns per grain-step")
    rows = []
    for s in speeds:
        numbers = (s.grains, s.contacts, s.of_contact, s.of_grain)
        rows.append((s.backend, *(f"{n:.3g}" for n in numbers), f"{1e9 / s.of_grain:.2g}"))
    say()
    say_table(rows, *headings, "grain-steps per second")


def _warn(sizes, backend):
    """Name the sizes at which the CPU is faster."""
    if sizes:
        listed = " and ".join(f"{n:.3g}" for n in sizes)
        say(
            f"\nWarning: with {listed} grains the CPU of this machine is faster than "
            f"{backend}; use numerics.backend: cpu for scenes of that size."
        )
