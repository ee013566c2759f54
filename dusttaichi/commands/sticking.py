"""`dust sticking`: sticking speed of two bodies, or their restitution over speeds."""

from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say
from dusttaichi.commands.study_command import study_command

SHOWN_EVERY = 30.0  # s between two lines of progress in a log: a bundle may take hours


@study_command(
    "collisions",
    omit="part figures",
    force=(options.Overwrite, False),
    resume=(options.flag("--resume", "compute the missing collisions"), False),
)
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
    run,
):
    """Find the sticking speed of a collision, or its restitution.

    The speed by bisection, the restitution over speeds (--map). After an interruption --resume
    continues either.
    """
    from dusttaichi.analysis.plain import convert_value
    from dusttaichi.studies import restitution_map, sticking_search
    from dusttaichi.studies.scene_settings import apply_settings

    scene = options.load_scene(file, run.threads, extensions=run.extensions)
    folder = run.output or scene.output.directory.with_name(f"{scene.name}-sticking")
    # --force is about files of others alone
    options_of_run = {"force": not run.resume, "every": SHOWN_EVERY}
    if chart is not None:
        study = restitution_map.RestitutionMap(scene, folder, chart, tolerance, settings or [])
        _remark_model(study)
        with run.writing(file):
            data = study.dataset(run.run(study, **options_of_run))
            paths = _save_map(data, study.file)
        rows, numbers = restitution_map.list_map_rows(data), data
    else:
        scene = apply_settings(scene, settings or [])
        ends = (sticking_search.parse_speed(*end) for end in (("--low", low), ("--high", high)))
        study = sticking_search.Search(scene, tolerance, *ends, directory=folder, log=run.log)
        _remark_model(study)
        bracket, paths = study.build_result(run.run(study, **options_of_run)), [study.file]
        rows, numbers = (
            sticking_search.list_rows(bracket),
            convert_value(bracket) | {"speed": bracket.speed},
        )

    def show():
        for label, value in rows:
            say(f"{label:<44} {value}")

    run.say_result(numbers, show, paths)


def _remark_model(study):
    """Print which speeds are beyond the contact model, if there are any."""
    if study.beyond:
        remark(study.beyond)


def _save_map(data, file):
    """Save the dataset of a map and its figure; returns their paths."""
    from dusttaichi import plots  # with matplotlib, which a search does not wait for
    from dusttaichi.analysis.ensemble import save_ensemble

    save_ensemble(data, file)
    return [file, plots.save(plots.restitution_map(data), file.with_suffix(".png"))]
