"""`dust extremes`: map of stable, refused and stopped runs."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import say, say_table
from dusttaichi.commands.study_command import study_command


@study_command(
    "cells",
    omit="resume part extensions figures",
    threads=(options.Threads, 1),
    output=(options.MapOutput, None),
    force=(options.flag("--force", "repeat finished cells"), False),
)
def extremes(
    *,
    quick: options.flag("--quick", "fewer cells, two minutes") = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="one group; may be repeated", metavar="GROUP")
    ] = None,
    run,
):
    """Map where runs are stable, refused or stopped by a guard.

    Over time steps, materials, speeds and sizes.
    """
    from dusttaichi import plots
    from dusttaichi.studies.extremes_map import ExtremesMap, save

    folder = run.output or Path("runs/extremes")
    study = ExtremesMap(folder, quick=quick, only=only, threads=run.threads)
    with run.writing():
        data = study.dataset(run.run_again(study))
        paths = save(data, study.file)
        paths.append(plots.save(plots.extremes(data), study.file.with_suffix(".png")))
    run.say_result(data, lambda: _show(data), paths)
    if (data.verdict == "WRONG").any():
        sys.exit(1)


def _show(data):
    from dusttaichi.studies.extremes_map import HEADINGS, summarise

    say_table(summarise(data), *HEADINGS)
    wrong_cells = data.where(data.verdict == "WRONG", drop=True)
    for group, name, reason in zip(
        wrong_cells.group.values, wrong_cells.name.values, wrong_cells.reason.values, strict=True
    ):
        say(f"WRONG  {group}: {name}: {reason}")
