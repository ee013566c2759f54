"""`dust study`: the runs that a Python file of the user asks for."""

from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import say_table
from dusttaichi.commands.ensembles import run_study, say_result


def study(
    program: Annotated[Path, typer.Argument(help="Python file of the study", metavar="STUDY")],
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    force: options.ForceResults = False,
    resume: options.ResumeMissing = False,
    output: options.Output = None,
    threads: options.Threads = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    extensions: options.Extensions = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
):
    """Run a study of your own, written in Python.

    The file says which runs of a scene it wants, given those that it has.
    """
    from dusttaichi.running import study_directory
    from dusttaichi.studies import own
    from dusttaichi.studies.finish import finish_study

    options.refuse_both(force, resume)
    scene = options.load_scene(file, threads, settings, extensions)
    mine = own.load(program, scene, study_directory(scene, program.stem, output))
    with options.writing(force=force, inputs=[file]):
        engine_options = {"force": force, "resume": resume, "scheduler": scheduler, "jobs": jobs}
        point_results = run_study(mine, quiet=quiet, **engine_options)
        results = finish_study(mine, point_results)
    data = results.data

    def show():
        names = [name for name in data.data_vars if data[name].dtype.kind in "fi"]
        columns = [data[name].values for name in names]
        rows = [
            (label, *(f"{column[n]:.6g}" for column in columns))
            for n, label in enumerate(point_results)
        ]
        say_table(rows, "point", *names, title=data.attrs.get("title"))

    say_result(data, show, results.files, as_json=as_json)
    if results.failure:
        raise results.failure
