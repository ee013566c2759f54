"""`dust sweep`: a scene over a grid of values of its keys."""

from typing import Annotated

import typer

from dusttaichi.commands import completion, options
from dusttaichi.commands.ensembles import run_sweep


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
    force: options.ForceResults = False,
    resume: options.ResumeMissing = False,
    part: options.Part = None,
    extensions: options.Extensions = None,
    output: options.Output = None,
    threads: options.Threads = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
    figures: options.Figures = True,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
):
    """Run a scene over a grid of values: dataset, figure, table."""
    from dusttaichi.running import study_directory
    from dusttaichi.studies import sweep as studies
    from dusttaichi.studies.settings import with_common_settings

    options.refuse_both(force, resume)
    scene = options.load_scene(file, threads, extensions=extensions)
    scene, swept = with_common_settings(scene, settings)
    study = studies.sweep(scene, swept, study_directory(scene, "sweep", output))
    with options.writing(force=force, inputs=[file]):
        engine_options = {"force": force, "resume": resume, "scheduler": scheduler, "jobs": jobs}
        engine_options["part"] = options.part_of(part)
        engine_options |= {"quiet": quiet, "verbose": verbose}
        run_sweep(study, figures=figures, as_json=as_json, **engine_options)
