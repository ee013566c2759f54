"""`dust sweep`: a scene over a grid of values of its keys."""

from typing import Annotated

import typer

from dusttaichi.commands import completion, options
from dusttaichi.commands.ensembles import run_sweep
from dusttaichi.commands.study_command import study_command


@study_command()
def sweep(
    file: options.SceneFile,
    *,
    settings: Annotated[
        list[str],
        typer.Option(
            "--set",
            help="a key and its values, key=value,value",
            metavar="KEY=VALUES",
            autocompletion=completion.complete_keys,
        ),
    ],
    verbose: options.Verbose = False,
    run,
):
    """Run a scene over a grid of values: dataset, figure, table."""
    from dusttaichi.studies import sweep_study
    from dusttaichi.studies.scene_settings import apply_common_settings

    scene, swept = apply_common_settings(run.load_scene(file), settings)
    study = sweep_study.sweep(scene, swept, run.find_folder(scene, "sweep"))
    with run.writing(file):
        run_sweep(study, run, verbose=verbose)
