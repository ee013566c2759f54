"""`dust sticking`: sticking speed of two bodies, or their restitution over speeds."""

from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say, say_json, say_written


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
    threads: options.Threads = None,
    extensions: options.Extensions = None,
    force: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="only the result")] = False,
):
    """Find the sticking speed of a collision by bisection, or its restitution over speeds."""
    from dusttaichi.analysis.plain import plain, plain_dataset
    from dusttaichi.studies import sticking as speeds
    from dusttaichi.studies.settings import with_settings

    scene = options.load_scene(file, threads, extensions=extensions)
    if chart is not None:
        folder = output or scene.output.directory.with_name(f"{scene.name}-sticking")
        with options.writing(force=force, inputs=[file]):
            data, paths = speeds.save_map(scene, chart, folder, tolerance, settings or [])
        rows, numbers = speeds.map_rows(data), plain_dataset(data)
    else:
        scene, paths = with_settings(scene, settings or []), []
        log = (lambda text: None) if quiet else remark
        ends = (speeds.speed_of(name, text) for name, text in (("--low", low), ("--high", high)))
        found = speeds.sticking(scene, tolerance, *ends, log=log)
        rows, numbers = speeds.rows(found), plain(found) | {"speed": found.speed}
    if as_json:
        say_json(numbers)
    else:
        for what, value in rows:
            say(f"{what:<44} {value}")
    say_written(paths, remark if as_json else say)
