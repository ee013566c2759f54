"""`dust sweep`: a scene over a grid of values of its keys."""

import re
from typing import Annotated

import typer

from dusttaichi.commands import completion, options
from dusttaichi.commands.ensembles import run_sweep
from dusttaichi.errors import DustError


def sweep(
    file: options.SceneFile,
    *,
    settings: Annotated[
        list[str],
        typer.Option(
            "--set",
            help="a key and its values, key=value,value",
            metavar="KEY=VALUES",
            autocompletion=completion.keys,
        ),
    ],
    force: options.ForceResults = False,
    resume: options.ResumeMissing = False,
    part: Annotated[
        str | None, typer.Option(help="only every N-th run, starting from the K-th", metavar="K/N")
    ] = None,
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
    from dusttaichi.studies import sweep as studies
    from dusttaichi.studies.settings import with_common_settings

    options.refuse_both(force, resume)
    scene = options.load_scene(file, threads, extensions=extensions)
    scene, swept = with_common_settings(scene, settings)
    study = studies.sweep(scene, swept, options.beside(scene, "sweep", output))
    with options.writing(force=force, inputs=[file]):
        how = {"force": force, "resume": resume, "scheduler": scheduler, "jobs": jobs}
        how["part"] = _part(part)
        shown = {"quiet": quiet, "verbose": verbose, "figures": figures, "as_json": as_json}
        run_sweep(study, **shown, **how)


def _part(text):
    """(k, n) of "k/n", (1, 1) of None. Raises DustError."""
    found = re.fullmatch(r"(\d+)/(\d+)", text or "1/1")
    k, n = (int(number) for number in found.groups()) if found else (0, 0)
    if not 1 <= k <= n:
        raise DustError(f"--part {text}: allowed: K/N with K from 1 to N, for example 2/8")
    return k, n
