"""`dust sweep`: a scene over a grid of values of its keys."""

from typing import Annotated

import typer

from dusttaichi.commands.ensembles import run_plan
from dusttaichi.commands.options import (
    Extensions,
    Json,
    Output,
    Quiet,
    SceneFile,
    Scheduler,
    again,
    load_scene,
    refuse_both,
    writing,
)


def sweep(
    file: SceneFile,
    *,
    settings: Annotated[
        list[str],
        typer.Option("--set", help="a key and its values, key=value,value", metavar="KEY=VALUES"),
    ],
    force: Annotated[bool, typer.Option("--force", help="overwrite existing results")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="go on with what is missing")] = False,
    extensions: Extensions = None,
    output: Output = None,
    threads: Annotated[int | None, typer.Option(min=1, help="CPU threads a run")] = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Run a scene over a grid of values of its keys: one dataset, a figure, a table."""
    from dusttaichi.studies import ensemble

    refuse_both(force, resume)
    scene = load_scene(file, threads, extensions=extensions)
    runs = scene.output.directory
    plan = ensemble.sweep_plan(scene, settings, output or runs.with_name(f"{runs.name}-sweep"))
    how = {"settings": settings, "scheduler": scheduler, "extensions": extensions}
    onward = again("sweep", file, output, **how)
    with writing(force=force, inputs=[file]):
        how = {"force": force, "resume": resume, "scheduler": scheduler}
        run_plan(plan, onward, quiet=quiet, as_json=as_json, **how)
