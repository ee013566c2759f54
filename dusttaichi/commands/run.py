"""`dust run`: one scene, or the replicas of one."""

from typing import Annotated

import typer

from dusttaichi.commands.console import (
    console,
    plain_table,
    remark,
    say,
    say_json,
    say_not_drawn,
    say_written,
)
from dusttaichi.commands.ensembles import run_plan
from dusttaichi.commands.options import (
    Extensions,
    Json,
    Output,
    Quiet,
    SceneFile,
    Scheduler,
    Settings,
    Threads,
    again,
    load_scene,
    refuse_both,
    writing,
)
from dusttaichi.commands.progress import ProgressBar
from dusttaichi.commands.report import watched
from dusttaichi.errors import DustError, Interrupted
from dusttaichi.names import NEVER


def run(
    file: SceneFile,
    *,
    settings: Settings = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing result")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="go on with an interrupted run")] = False,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="compute stages again that are kept")
    ] = False,
    error_bar: Annotated[
        bool, typer.Option("--error-bar", help="estimate the error of the time step at the end")
    ] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="show it in a browser while it runs, as dust watch")
    ] = False,
    extensions: Extensions = None,
    output: Output = None,
    threads: Threads = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Run the scene of a YAML file: result, figures and a short table."""
    from dusttaichi.run import run_directory

    refuse_both(force, resume)
    scene = load_scene(file, threads, settings, extensions)
    directory = run_directory(scene, output)
    how = {"settings": settings or (), "scheduler": scheduler, "error_bar": error_bar}
    onward = again("run", file, output, extensions=extensions, **how)
    if scene.replicas is not None:
        from dusttaichi.studies import ensemble

        if fresh:
            raise DustError(
                f"--fresh is for a single run; here remove the folder {directory / '.stages'}, "
                "where the finished stages of the replicas are kept"
            )
        plan = ensemble.ensemble_plan(scene, directory)
        how = {"force": force, "resume": resume, "scheduler": scheduler, "error_bar": error_bar}
        with writing(force=force, inputs=[file]):
            run_plan(plan, onward, quiet=quiet, as_json=as_json, **how)
        return
    if scheduler is not None:
        raise DustError("--scheduler is for many runs: a scene with replicas, or dust sweep")
    how = {"force": force, "resume": resume, "fresh": fresh, "error_bar": error_bar}
    with watched(directory, watch):
        keep_start = _run_one(scene, directory, onward, quiet=quiet, **how)
    with writing(force=force, inputs=[file]):
        _show_result(directory, as_json)
    keep_start()


def _run_one(scene, directory, onward, *, quiet, **how):
    """Run a scene; returns what keeps, at the end of the command, how long it took beside the
    steps. onward: the command that goes on with it. how: as `execute` takes it."""
    from dusttaichi.run import execute
    from dusttaichi.studies.speeds import Timer
    from dusttaichi.studies.starts import Clock

    timer = Timer(scene)
    clock = Clock(scene, timer)
    hooks = {"ready": clock.ready, "advancing": timer}
    with ProgressBar(quiet, "building") as bar:
        try:
            execute(scene, directory, report=_shown(bar), log=bar.log, **hooks, **how)
            timer.keep()
        except Interrupted as stop:
            if not stop.kept:
                raise
            raise Interrupted(f"{stop}. Go on with: {onward}") from None
    return clock.keep


def _shown(bar):
    """What shows the progress of a run in a bar."""
    from dusttaichi.analysis.texts import rate_text

    def show(progress):
        state = []
        if progress.filling_factor is not None:
            state.append(f"phi {progress.filling_factor:.3f}")
        if progress.pressure is not None:
            state.append(f"P {progress.pressure / 1e3:.3g} kPa")
        if progress.steps_per_second > 0.0:
            state.append(f"{rate_text(progress.steps_per_second)} steps/s")
        total = progress.end if progress.end < NEVER else None
        what = f"{progress.task}step {progress.step:,}"
        bar.show(what, progress.step, total, "  ".join(state))

    return show


def _show_result(directory, as_json):
    """Figures and table of a finished run, or its numbers as JSON."""
    from dusttaichi import analysis, plots
    from dusttaichi.analysis.plain import plain_runs

    failed = []
    with analysis.open_run(directory) as result:
        figures = plots.save_all(result, directory, failed=failed)
        written = [directory / "result.nc", *figures]
        if as_json:
            say_json(plain_runs([result]))
            say_written(written, remark)
            say_not_drawn(failed)
            return
        summary = analysis.summary(result)
        rows, frames = analysis.table(summary), result.snapshots
    headings = [
        {"header": heading, "no_wrap": heading == " "}  # no label is cut
        for heading in (" ", "run", "literature")
    ]
    shown = 3 if any(beside for _, _, beside in rows) else 2
    table = plain_table(*headings[:shown], title=summary["name"])
    for row in rows:
        table.add_row(*row[:shown])
    console.print(table)
    say_written(written)
    say_not_drawn(failed)
    _say_next(directory, 0 if frames is None else frames.sizes["snapshot"])


def _say_next(directory, frames):
    """The commands that one may want now."""
    film = " --animate" if frames > 2 else ""
    told = {
        f"dust report {directory}": "a page with figures to zoom into and the particles in 3-D",
        f"dust render {directory}{film}": "a film" if film else "a picture",
        f"dust compare {directory} OTHER": "beside other runs",
    }
    width = max(map(len, told))
    for number, (command, what) in enumerate(told.items()):
        say(f"{'next:' if number == 0 else '':<6}{command:<{width}}  # {what}")
