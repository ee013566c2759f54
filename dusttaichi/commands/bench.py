"""`dust bench`: how fast the simulation is."""

from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands.console import say, say_written
from dusttaichi.commands.options import Overwrite, writing


def bench(
    *,
    quick: Annotated[bool, typer.Option("--quick", help="small sizes only, two minutes")] = False,
    parts: Annotated[
        bool, typer.Option("--parts", help="what each part of a scene costs instead")
    ] = False,
    continuum: Annotated[
        bool, typer.Option("--continuum", help="a particle-step of the continuum instead")
    ] = False,
    counts: Annotated[
        bool,
        typer.Option("--counts", help="instructions a pair and a grain instead, where they count"),
    ] = False,
    runs: Annotated[
        bool,
        typer.Option("--runs", help="runs on one thread, on all cores and as chosen instead"),
    ] = False,
    lammps: Annotated[bool, typer.Option(help="time LAMMPS on the same samples")] = True,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="CSV file of the numbers")
    ] = None,
    force: Overwrite = False,
):
    """Measure: ns a contact and a grain-step by size, filling factor, threads; beside LAMMPS."""
    from dusttaichi.studies.bench import continuum as continuum_bench
    from dusttaichi.studies.bench import counts as counts_bench
    from dusttaichi.studies.bench import measure, timing
    from dusttaichi.studies.bench import parts as parts_bench
    from dusttaichi.studies.bench import runs as runs_bench

    if counts:
        say(timing.machine())
        print("\n".join(found.text() for found in counts_bench.main(log=say)))
        return
    if runs:
        print(f"\n{runs_bench.main(quick=quick, log=say)}")
        return
    if parts and continuum:
        raise typer.BadParameter("--parts is of grains; name one of --parts and --continuum")
    with writing(force=force):
        if continuum:
            table = continuum_bench.main(quick=quick, out=output, log=say)
        elif parts:
            table = parts_bench.main(quick=quick, out=output, log=say)
        else:
            table = measure.main(quick=quick, lammps=lammps, out=output, log=say)
    print(f"\n{table.text()}")
    if output is not None:
        say_written([output])
