"""`dust sticking`: sticking speed of two bodies, or their restitution over speeds."""

from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say, say_json, say_written
from dusttaichi.commands.ensembles import shown
from dusttaichi.commands.progress import ProgressBar


def sticking(
    file: options.SceneFile,
    *,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="a key and its value; with --map several, key=value,value",
            metavar="KEY=VALUE",
        ),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="relative width of the bracket")] = 1e-3,
    low: Annotated[str | None, typer.Option(help="lower end of search", metavar="SPEED")] = None,
    high: Annotated[str | None, typer.Option(help="upper end of search", metavar="SPEED")] = None,
    chart: Annotated[
        str | None,
        typer.Option("--map", help="restitution at COUNT speeds", metavar="LOW,HIGH,COUNT"),
    ] = None,
    output: options.MapOutput = None,
    threads: options.ThreadsOfOne = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    extensions: options.Extensions = None,
    force: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
):
    """Find the sticking speed of a collision by bisection, or its restitution over speeds."""
    from dusttaichi.analysis.plain import plain, plain_dataset
    from dusttaichi.studies import engine
    from dusttaichi.studies.settings import with_settings
    from dusttaichi.studies.sticking import restitution, search

    scene = options.load_scene(file, threads, extensions=extensions)
    with ProgressBar(quiet) as bar:
        if chart is not None:
            study = restitution.RestitutionMap(scene, chart, tolerance, settings or [])
        else:
            scene = with_settings(scene, settings or [])
            ends = (search.speed_of(*end) for end in (("--low", low), ("--high", high)))
            log = (lambda text: None) if quiet else bar.log
            study = search.Search(scene, tolerance, *ends, log=log)
        how = {"scheduler": scheduler, "jobs": jobs, "report": shown(bar, "collisions")}
        found = engine.run(study, **how)
    paths = []
    if chart is not None:
        data = study.dataset(found)
        folder = output or scene.output.directory.with_name(f"{scene.name}-sticking")
        with options.writing(force=force, inputs=[file]):
            paths = restitution.save_map(data, folder)
        rows, numbers = restitution.map_rows(data), plain_dataset(data)
    else:
        result = study.result(found)
        rows, numbers = search.rows(result), plain(result) | {"speed": result.speed}
    if as_json:
        say_json(numbers)
    else:
        for what, value in rows:
            say(f"{what:<44} {value}")
    say_written(paths, remark if as_json else say)
