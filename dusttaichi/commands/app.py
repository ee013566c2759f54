"""The command `dust`: run, sweep, trade, sticking, extremes, check, schema, plot, compare, export,
render, fit, bench."""

import shlex
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from dusttaichi import __version__
from dusttaichi.commands.progress import progress_bar
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

Scheduler = Annotated[
    str | None, typer.Option(help="address of a Dask scheduler", metavar="ADDRESS")
]
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
    fresh: Annotated[
        bool, typer.Option("--fresh", help="compute stages again that are kept")
    ] = False,
    error_bar: Annotated[
        bool, typer.Option("--error-bar", help="estimate the error of the time step at the end")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the results")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="CPU threads")] = None,
    scheduler: Scheduler = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="no progress bar")] = False,
):
    """Run the scene of a YAML file: result, figures and a short table."""
    from dusttaichi import analysis, plots
    from dusttaichi.run.loop import execute, run_directory

    scene = _scene(file, force, resume, threads)
    directory = run_directory(scene, output)
    if scene.replicas is not None:
        from dusttaichi.studies import ensemble

        if fresh:
            raise DustError(
                f"--fresh is for a single run; here remove the folder {directory / '.stages'}, "
                "where the finished stages of the replicas are kept"
            )
        plan = ensemble.ensemble_plan(scene, directory)
        again = _again("run", file, output, scheduler, error_bar=error_bar)
        ensemble.command(
            plan,
            again,
            force=force,
            resume=resume,
            scheduler=scheduler,
            quiet=quiet,
            console=console,
            err=err,
            error_bar=error_bar,
        )
        return
    if scheduler is not None:
        raise DustError("--scheduler is for many runs: a scene with replicas, or dust sweep")
    with _bar(quiet) as (watch, say):
        try:
            execute(
                scene,
                directory,
                force=force,
                resume=resume,
                fresh=fresh,
                error_bar=error_bar,
                watch=watch,
                say=say,
            )
        except KeyboardInterrupt:
            again = _again("run", file, output, None, error_bar=error_bar)
            raise DustError(
                f"interrupted; everything up to here is in {directory}. Go on with: {again}"
            ) from None
    with analysis.open_run(directory) as result:
        figures = plots.save_all(result, directory)
        _print_summary(analysis.summary(result), analysis.table)
    for path in [directory / "result.nc", *figures]:
        console.print(f"wrote {path}")


def _scene(file, force, resume, threads):
    from dusttaichi.scene import load

    if force and resume:
        raise DustError("--force starts anew, --resume goes on: give only one of them")
    scene = load(file)
    return scene if threads is None else scene.with_value("numerics.threads", threads)


def _again(command, file, output, scheduler, settings=(), error_bar=False):
    """The command that goes on with what was interrupted."""
    words = ["dust", command, str(file)]
    words += [word for setting in settings for word in ("--set", setting)]
    words += ["--output", str(output)] if output else []
    words += ["--scheduler", scheduler] if scheduler else []
    words += ["--error-bar"] if error_bar else []
    return shlex.join([*words, "--resume"])


@app.command()
def sweep(
    file: SceneFile,
    settings: Annotated[
        list[str],
        typer.Option("--set", help="a key and its values, key=value,value", metavar="KEY=VALUES"),
    ],
    force: Annotated[bool, typer.Option("--force", help="overwrite existing results")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="go on with what is missing")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the results")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="CPU threads a run")] = None,
    scheduler: Scheduler = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="no progress bar")] = False,
):
    """Run a scene over a grid of values of its keys: one dataset, a figure, a table."""
    from dusttaichi.studies import ensemble

    scene = _scene(file, force, resume, threads)
    runs = scene.output.directory
    plan = ensemble.sweep_plan(scene, settings, output or runs.with_name(f"{runs.name}-sweep"))
    again = _again("sweep", file, output, scheduler, settings)
    ensemble.command(
        plan,
        again,
        force=force,
        resume=resume,
        scheduler=scheduler,
        quiet=quiet,
        console=console,
        err=err,
    )


@app.command()
def trade(
    file: SceneFile,
    knobs: Annotated[
        str | None, typer.Option(help="only these knobs, by commas", metavar="KNOB,KNOB")
    ] = None,
    observable: Annotated[
        str | None, typer.Option(help="the number whose error decides", metavar="NAME")
    ] = None,
    tolerance: Annotated[str, typer.Option(help="largest error", metavar="SHARE")] = "5%",
    seeds: Annotated[
        int | None, typer.Option(min=1, help="seeds for the scatter: 4, with --quick 2")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="three rungs a knob, two seeds")] = False,
    pairs: Annotated[
        bool, typer.Option(help="run the default beside each point, to compare costs")
    ] = True,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes at a time: all cores")] = None,
    force: Annotated[bool, typer.Option("--force", help="run kept points again")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the results")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="no progress bar")] = False,
):
    """Cost and error of every knob of a scene: table, figure, and the cheapest setting."""
    from dusttaichi.studies import trade as trading

    scene = _scene(file, False, False, None)
    runs = scene.output.directory
    trading.command(
        scene,
        output or runs.with_name(f"{runs.name}-trade"),
        names=knobs,
        quick=quick,
        seeds=seeds,
        tolerance=tolerance,
        observable=observable,
        jobs=jobs,
        pairs=pairs,
        force=force,
        quiet=quiet,
        again=shlex.join(["dust", *sys.argv[1:]]).replace(" --force", ""),
        console=console,
        err=err,
    )


@app.command()
def sticking(
    file: SceneFile,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="a key and its value; with --map several, key=value,value",
            metavar="KEY=VALUE",
        ),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="relative width of the bracket")] = 1e-3,
    low: Annotated[str | None, typer.Option(help="speed to look from", metavar="SPEED")] = None,
    high: Annotated[str | None, typer.Option(help="speed to look up to", metavar="SPEED")] = None,
    chart: Annotated[
        str | None,
        typer.Option("--map", help="restitution at COUNT speeds", metavar="LOW,HIGH,COUNT"),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the map")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="CPU threads")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="only the result")] = False,
):
    """Sticking speed of a collision by bisection of batches, or restitution over speeds."""
    from dusttaichi.studies import sticking as speeds
    from dusttaichi.studies.ensemble import with_settings

    scene = _scene(file, False, False, threads)
    if chart is not None:
        folder = output or scene.output.directory.with_name(f"{scene.name}-sticking")
        rows, paths = speeds.save_map(scene, chart, folder, tolerance, settings or [])
    else:
        scene = with_settings(scene, settings or [])
        say = (lambda text: None) if quiet else err.print
        ends = (speeds.speed_of(name, text) for name, text in (("--low", low), ("--high", high)))
        rows, paths = speeds.rows(speeds.sticking(scene, tolerance, *ends, say=say)), []
    for what, value in rows:
        console.print(f"{what:<44} {value}", markup=False, soft_wrap=True)
    for path in paths:
        console.print(f"wrote {path}")


@app.command()
def extremes(
    quick: Annotated[bool, typer.Option("--quick", help="fewer cells, two minutes")] = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="one group; may be repeated", metavar="GROUP")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the map")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="try finished cells again")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="no progress bar")] = False,
):
    """Map where runs are stable, refused or stopped by a guard: steps, materials, speeds, sizes."""
    from dusttaichi.studies.extremes.command import command

    try:
        sound = command(
            quick=quick,
            only=only,
            output=output,
            force=force,
            quiet=quiet,
            console=console,
            err=err,
        )
    except KeyboardInterrupt:
        raise DustError("interrupted; finished cells are kept, the same command goes on") from None
    if not sound:
        sys.exit(1)


def _print_summary(summary, rows):
    table = Table(title=summary["name"], title_justify="left", box=None, pad_edge=False)
    for heading in (" ", "run", "literature"):
        table.add_column(heading, no_wrap=heading == " ")  # no label is cut
    for row in rows(summary):
        table.add_row(*row)
    console.print(table)


class _bar:
    """Progress bar: filling factor, pressure, steps a second, time left."""

    def __init__(self, quiet):
        self.quiet = quiet
        self.bar = progress_bar(err, quiet)

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
        self.bar.update(
            self.task,
            description=f"{p.task}step {p.step:,}",
            total=total,
            completed=p.step,
            state="  ".join(parts),
        )


@app.command()
def check(
    file: SceneFile,
    costs: Annotated[
        bool, typer.Option("--costs", help="time the scene with each of its parts left out")
    ] = False,
):
    """Check a YAML file and print the scene resolved: constants, step, size, cost, parts."""
    from dusttaichi.grains.preview import report
    from dusttaichi.scene import load

    scene = load(file)
    console.print(scene.to_yaml().rstrip(), markup=False)
    for title, rows in report(scene, costs, err.print):
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
    """Figures of a run: curves, stress, profile, energy. Several runs: their curves in one."""
    from dusttaichi import analysis, plots

    if len(runs) == 1 and analysis.is_trade(runs[0]):
        data, file = analysis.open_trade(runs[0])
        folder = output or file.parent
        console.print(f"wrote {plots.save_trade(data, folder / 'trade.png')}")
        return
    with ExitStack() as opened:
        results = [opened.enter_context(analysis.open_run(path)) for path in runs]
        if len(results) == 1:
            folder = output or (runs[0] if runs[0].is_dir() else runs[0].parent)
            paths = plots.save_all(results[0], folder)
        else:
            paths = plots.save_together(results, output or Path("."))
    for path in paths:
        console.print(f"wrote {path}")


COLUMNS = (  # heading, key of analysis.compare, shown as, unit; only what the runs have
    ("run", "name", "{}", 1),
    ("grains", "grains", "{:,}", 1),
    ("p_m kPa", "p_m", "{:.1f}", 1e3),
    ("Delta", "delta", "{:.2f}", 1),
    ("rms", "rms", "{:.3f}", 1),
    ("mean", "rms_mean", "{:+.3f}", 1),
    ("covered", "rms_covered", "{:.2f}", 1),
    ("contacts/grain at 0.3", "contacts_per_grain_at_0.3", "{:.2f}", 1),
    ("at 0.45", "contacts_per_grain_at_0.45", "{:.2f}", 1),
    ("phi_init", "phi_init", "{:.3g}", 1),
    ("strength kPa", "strength", "{:.3g}", 1e3),
    ("sigma", "strength_sigma", "{:.2g}", 1e3),
    ("at phi", "strength_phi", "{:.3g}", 1),
    ("T19 eq 33", "strength_law", "{:.3g}", 1e3),
    ("past it", "strength_passed", "{!s}", 1),
    ("P/(E_roll/r^3 phi^3)", "ratio", "{:.2f}", 1),
    ("ledger", "ledger_worst", "{:.0e}", 1),
)


def _cell(value, text, unit):
    if value is None:
        return "-"
    return text.format(value if unit == 1 else value / unit)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(help="run directories or result files")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="CSV file of all numbers")
    ] = None,
):
    """Runs side by side: fit and distance from the law, tensile strength, contacts, ledger."""
    from dusttaichi import analysis

    with ExitStack() as opened:
        rows = analysis.compare([opened.enter_context(analysis.open_run(path)) for path in runs])
    table = Table(box=None, pad_edge=False)
    shown = [column for column in COLUMNS if column[1] in rows[0]]
    for heading, *_ in shown:
        table.add_column(heading, justify="left" if heading == "run" else "right")
    for row in rows:
        table.add_row(*(_cell(row[key], text, unit) for _, key, text, unit in shown))
    console.print(table)
    if output is not None:
        analysis.to_csv(rows, output)
        console.print(f"wrote {output}")


@app.command()
def fit(
    what: Annotated[str, typer.Argument(help="asperities", metavar="WHAT")],
    material: Annotated[str, typer.Option(help="a named material")] = "silica_pd08",
    speed: Annotated[str, typer.Option(help="sticking speed on a flat wall")] = "1.2 m/s",
):
    """Fit a number of the model: `asperities`, their volume, to a sticking speed."""
    from pydantic import TypeAdapter, ValidationError

    from dusttaichi.scene import quantities
    from dusttaichi.studies import asperity_fit

    if what != "asperities":
        raise DustError(f"fit {what}: there is nothing to fit of that name; allowed: asperities")
    mark = Annotated[float, quantities.Quantity("speed", gt=0)]
    try:
        wanted = TypeAdapter(mark).validate_python(speed)
    except ValidationError as error:
        raise DustError(f"--speed = {speed!r}: {error.errors()[0]['msg']}") from None
    for text in asperity_fit.report(material, wanted):
        console.print(text, markup=False, soft_wrap=True)


@app.command()
def bench(
    quick: Annotated[bool, typer.Option("--quick", help="small sizes only, two minutes")] = False,
    parts: Annotated[
        bool, typer.Option("--parts", help="what each part of a scene costs instead")
    ] = False,
    lammps: Annotated[bool, typer.Option(help="time LAMMPS on the same samples")] = True,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="CSV file of the numbers")
    ] = None,
):
    """Measure: ns a contact and a grain-step by size, filling factor, threads; beside LAMMPS."""
    from dusttaichi.studies import bench as benchmark

    if parts:
        from dusttaichi.studies.bench import parts as parts_bench

        parts_bench.command(quick=quick, output=output, say=console.print)
        return
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
        str, typer.Option(help="coordination, speed, height, fragment, body or uniform")
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
