"""The command `dust`: run, check, schema, plot, bench, export, render."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from dusttaichi import __version__
from dusttaichi.errors import DustError

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Grain-by-grain simulation of porous dust.",
)
WIDE = 120  # columns where there is no terminal to ask
console = Console(highlight=False, width=None if sys.stdout.isatty() else WIDE)
err = Console(stderr=True, highlight=False, width=None if sys.stderr.isatty() else WIDE)

SceneFile = Annotated[Path, typer.Argument(help="YAML file of the scene", metavar="FILE")]


def _version(value: bool):
    if value:
        console.print(f"dusttaichi {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version")
    ] = False,
):
    pass


@app.command()
def run(
    file: SceneFile,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing result")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="go on with an interrupted run")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the results")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="CPU threads")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="no progress bar")] = False,
):
    """Run the scene of a YAML file: result, figures and a short table."""
    from dusttaichi import analysis, plots
    from dusttaichi.run import execute, run_directory
    from dusttaichi.scene import load

    if force and resume:
        raise DustError("--force starts anew, --resume goes on: give only one of them")
    scene = load(file)
    if threads is not None:
        scene = scene.with_value("numerics.threads", threads)
    directory = run_directory(scene, output)
    with _bar(quiet) as (watch, say):
        try:
            execute(scene, directory, force=force, resume=resume, watch=watch, say=say)
        except KeyboardInterrupt:
            raise DustError(
                f"interrupted; everything up to here is in {directory}. "
                f"Go on with: dust run {file} --resume{f' --output {output}' if output else ''}"
            ) from None
    result = analysis.open_run(directory)
    figures = plots.save_all(result, directory)
    _print_summary(analysis.summary(result), analysis.table)
    for path in [directory / "result.nc", *figures]:
        console.print(f"wrote {path}")


def _print_summary(summary, rows):
    table = Table(title=summary["name"], title_justify="left", box=None, pad_edge=False)
    for heading in (" ", "run", "laboratory"):
        table.add_column(heading, no_wrap=True)
    for row in rows(summary):
        table.add_row(*row)
    console.print(table, soft_wrap=True)


class _bar:
    """Progress bar: filling factor, pressure, steps a second, time left."""

    def __init__(self, quiet):
        self.quiet = quiet
        self.bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>5.1f} %"),
            TextColumn("{task.fields[state]}"),
            TimeRemainingColumn(),
            console=err,
            disable=quiet,
        )

    def __enter__(self):
        self.bar.start()
        self.task = self.bar.add_task("building", total=None, state="")
        return self.watch, self.say

    def __exit__(self, *_):
        self.bar.stop()

    def say(self, text):
        err.print(text)

    def watch(self, p):
        parts = []
        if p.filling_factor is not None:
            parts.append(f"phi {p.filling_factor:.3f}")
        if p.pressure is not None:
            parts.append(f"P {p.pressure / 1e3:.3g} kPa")
        parts.append(f"{p.steps_per_second:,.0f} steps/s")
        total = p.end if p.end < 2**61 else None
        self.bar.update(self.task, description=f"step {p.step:,}", total=total, completed=p.step,
                        state="  ".join(parts))  # fmt: skip


@app.command()
def check(file: SceneFile):
    """Check a YAML file and print the scene resolved: constants, step, size, cost, parts."""
    from dusttaichi.preview import report
    from dusttaichi.scene import load

    scene = load(file)
    console.print(scene.to_yaml().rstrip(), markup=False)
    for title, rows in report(scene):
        console.print(f"\n{title}", markup=False, style="bold")
        for what, value in rows:
            console.print(f"  {what:<42} {value}", markup=False, soft_wrap=True)


@app.command()
def schema():
    """Print the JSON Schema of the YAML, for editors that complete and check it."""
    from dusttaichi.scene import schema_text

    sys.stdout.write(schema_text())


@app.command()
def plot(
    runs: Annotated[list[Path], typer.Argument(help="run directories or result files")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the figures")
    ] = None,
):
    """Figures of a run: compression curve, profile, energy ledger. Several runs: one curve plot."""
    from dusttaichi import analysis, plots

    results = [analysis.open_run(path) for path in runs]
    if len(results) == 1:
        folder = output or (runs[0] if runs[0].is_dir() else runs[0].parent)
        folder.mkdir(parents=True, exist_ok=True)
        paths = plots.save_all(results[0], folder)
    else:
        folder = output or Path(".")
        folder.mkdir(parents=True, exist_ok=True)
        paths = [folder / "compression.png"]
        plots.compression(results, [r.name for r in results]).savefig(paths[0])
    for path in paths:
        console.print(f"wrote {path}")


COLUMNS = (
    ("run", "name", "{}"),
    ("grains", "grains", "{:,}"),
    ("p_m kPa", "p_m", "{:.1f}"),
    ("Delta", "delta", "{:.2f}"),
    ("rms", "rms", "{:.3f}"),
    ("mean", "rms_mean", "{:+.3f}"),
    ("covered", "rms_covered", "{:.2f}"),
    ("contacts/grain at 0.3", "contacts_per_grain_at_0.3", "{:.2f}"),
    ("at 0.45", "contacts_per_grain_at_0.45", "{:.2f}"),
    ("ledger", "ledger_worst", "{:.0e}"),
)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(help="run directories or result files")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="CSV file of all numbers")
    ] = None,
):
    """Compression runs side by side: fit, distance from S12 eq 31, contacts a grain, ledger."""
    from dusttaichi import analysis

    rows = analysis.compare([analysis.open_run(path) for path in runs])
    table = Table(box=None, pad_edge=False)
    for heading, _, _ in COLUMNS:
        table.add_column(heading, justify="left" if heading == "run" else "right")
    for row in rows:
        scaled = row | {"p_m": None if row["p_m"] is None else row["p_m"] / 1e3}
        table.add_row(
            *("-" if scaled[key] is None else text.format(scaled[key]) for _, key, text in COLUMNS)
        )
    console.print(table)
    if output is not None:
        analysis.to_csv(rows, output)
        console.print(f"wrote {output}")


@app.command()
def bench(
    quick: Annotated[bool, typer.Option("--quick", help="small sizes only, two minutes")] = False,
    lammps: Annotated[bool, typer.Option(help="time LAMMPS on the same samples")] = True,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="CSV file of the numbers")
    ] = None,
):
    """Measure: ns a contact and a grain-step by size, filling factor, threads; beside LAMMPS."""
    from dusttaichi import bench as benchmark

    benchmark.command(quick=quick, lammps=lammps, output=output, say=console.print)


RunPath = Annotated[Path, typer.Argument(help="run directory or result file", metavar="RUN")]


@app.command()
def export(
    run: RunPath,
    to: Annotated[str, typer.Option(help="vtk, extxyz or lammps")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the files")
    ] = None,
    snapshot: Annotated[str, typer.Option(help="number, from the end if negative, or all")] = "all",
):
    """Snapshots for other programs: ParaView (vtk), ASE and OVITO (extxyz), OVITO (lammps)."""
    from dusttaichi import analysis
    from dusttaichi.export import export as write

    number = snapshot if snapshot == "all" else _whole("--snapshot", snapshot, " or all")
    with analysis.open_run(run) as result:
        paths = write(result, to, output, number)
    console.print(f"wrote {paths[0]}{f' and {len(paths) - 1} more' if len(paths) > 1 else ''}")


def _whole(option, text, otherwise=""):
    try:
        return int(text)
    except ValueError:
        raise DustError(f"{option}: {text}; allowed: a whole number{otherwise}.") from None


@app.command()
def render(
    run: RunPath,
    snapshot: Annotated[int, typer.Option(help="number, from the end if negative")] = -1,
    color: Annotated[
        str, typer.Option(help="coordination, speed, height, fragment or uniform")
    ] = "coordination",
    view: Annotated[
        str, typer.Option(help="oblique, front, side, top, bottom or x,y,z to look from")
    ] = "oblique",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="file: .png, .pdf; .gif, .mp4")
    ] = None,
    animate: Annotated[bool, typer.Option("--animate", help="a film of all snapshots")] = False,
):
    """Picture of the grains of a snapshot, or a film of all snapshots."""
    from dusttaichi import analysis, plots

    folder = run if run.is_dir() else run.parent
    path = output or folder / ("grains.gif" if animate else "grains.png")
    with analysis.open_run(run) as result:
        if animate:
            plots.animation(result, path, color, view)
        else:
            figure = plots.grains(result, snapshot, color, view)
            try:
                figure.savefig(path)
            except (OSError, ValueError) as error:
                raise DustError(f"The picture cannot be written to {path}: {error}.") from error
    console.print(f"wrote {path}")


def main():
    """Entry point: errors of the user are one clear message, not a traceback."""
    try:
        app(standalone_mode=False)
    except DustError as error:
        err.print(f"dust: {error}", markup=False, style="red", soft_wrap=True)
        sys.exit(130 if str(error).startswith("interrupted") else error.exit_code)
    except typer.Abort:
        sys.exit(130)
    except Exception as error:
        if type(error).__module__.startswith(("click", "typer")):
            error.show()
            sys.exit(error.exit_code)
        raise
