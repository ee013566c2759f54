"""The command line of the benchmarks."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from dusttaichi.commands.app import main
from dusttaichi.commands.console import remark, say_written
from dusttaichi.commands.options import Overwrite, Settings, load_scene, writing

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Benchmarks for the developers of dusttaichi. Speed of this machine: dust bench.",
)
Quick = Annotated[bool, typer.Option("--quick", help="less, in a few minutes")]
Csv = Annotated[Path | None, typer.Option("--output", "-o", help="CSV file of the numbers")]


@app.command()
def speed(
    *,
    quick: Quick = False,
    lammps: Annotated[bool, typer.Option(help="time LAMMPS on the same samples")] = True,
    output: Csv = None,
    force: Overwrite = False,
):
    """Measure ns per contact and per grain-step by size, filling factor, threads; with LAMMPS."""
    from benchmarks import speed

    _show(speed.main, output, force, quick=quick, lammps=lammps)


@app.command()
def parts(
    file: Annotated[
        Path | None, typer.Argument(help="a scene of grains, its own parts", metavar="[FILE]")
    ] = None,
    *,
    settings: Settings = None,
    quick: Quick = False,
    output: Csv = None,
    force: Overwrite = False,
):
    """Measure the cost of each part of a scene: with and without it, in turn."""
    from benchmarks import parts

    scene = None if file is None else load_scene(file, settings=settings)
    _show(parts.main, output, force, quick=quick, scene=scene)


@app.command()
def continuum(*, quick: Quick = False, output: Csv = None, force: Overwrite = False):
    """Measure the time per particle-step of the continuum, in two and three dimensions."""
    from benchmarks import continuum

    _show(continuum.main, output, force, quick=quick)


@app.command()
def size(
    *,
    quick: Quick = False,
    sizes: Annotated[
        str | None, typer.Option(help="numbers of particles, by default 1e3 to 1e7: 1e4,1e5")
    ] = None,
    kinds: Annotated[bool, typer.Option(help="also the kinds of samples")] = True,
    scenes: Annotated[bool, typer.Option(help="also the phases of a run")] = True,
    method: Annotated[
        Literal["grains", "continuum"] | None, typer.Option(help="by default both")
    ] = None,
    output: Csv = None,
    force: Overwrite = False,
):
    """Measure processor time and memory of each phase against the number of particles."""
    from benchmarks import size

    numbers = None if sizes is None else [round(float(n)) for n in sizes.split(",")]
    options = {"sizes": numbers, "kinds": kinds, "scenes": scenes, "method": method}
    _show(size.main, output, force, quick=quick, **options)


@app.command()
def collisions(*, quick: Quick = False, output: Csv = None, force: Overwrite = False):
    """Measure collisions a second against the number side by side, in one and two processes."""
    from benchmarks import collisions

    _show(collisions.main, output, force, quick=quick)


@app.command()
def counts():
    """Count instructions per pair and grain, where the system allows it."""
    from benchmarks import counts

    counts.main(log=remark).show()


@app.command()
def runs(*, quick: Quick = False):
    """Time whole runs with one thread, with all cores and with `threads: auto`, in turn."""
    from benchmarks import runs

    runs.main(quick=quick, log=remark).show()


@app.command()
def busy(*, quick: Quick = False):
    """Time the steps beside programs that compute, which it starts itself."""
    from benchmarks import busy

    busy.main(quick=quick, log=remark).show()


def _show(measure, output, force, **options):
    with writing(force=force):
        measure(out=output, log=remark, **options).show()
    if output is not None:
        say_written([output])


if __name__ == "__main__":
    main(app)
