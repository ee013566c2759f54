"""`dust study`: the runs that a Python file of the user lists."""

from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import say_table
from dusttaichi.commands.study_command import study_command


@study_command(omit="part figures")
def study(
    program: Annotated[Path, typer.Argument(help="Python file of the study", metavar="STUDY")],
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    run,
):
    """Run a study of your own, written in Python.

    The file lists the runs of a scene, also by the results of earlier ones.
    """
    from dusttaichi.studies import user_study
    from dusttaichi.studies.finish import finish_study

    scene = run.load_scene(file, settings)
    study_of_file = user_study.load_study(program, scene, run.find_folder(scene, program.stem))
    with run.writing(file):
        point_results = run.run(study_of_file)
        results = finish_study(study_of_file, point_results)
    data = results.data

    def show():
        names = [name for name in data.data_vars if data[name].dtype.kind in "fi"]
        columns = [data[name].values for name in names]
        rows = [
            (label, *(f"{column[n]:.6g}" for column in columns))
            for n, label in enumerate(point_results)
        ]
        say_table(rows, "point", *names, title=data.attrs.get("title"))

    run.say_result(data, show, results.files, results.failure)
