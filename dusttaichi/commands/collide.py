"""`dust collide`: many collisions of a scene, their map and the table for coagulation codes."""

from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say, say_abreast, say_json, say_written
from dusttaichi.commands.ensembles import shown
from dusttaichi.commands.progress import ProgressBar
from dusttaichi.errors import DustError

THRESHOLDS = "thresholds, with 68 % confidence"


def collide(
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    force: options.ForceResults = False,
    resume: options.ResumeMissing = False,
    output: options.Output = None,
    threads: Annotated[
        int | None, typer.Option(min=1, help="CPU threads per collision, default 1")
    ] = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    extensions: options.Extensions = None,
    as_json: options.Json = False,
    figures: options.Figures = True,
    quiet: options.Quiet = False,
):
    """Run many collisions over speed, impact parameter, mass ratio, bodies, seeds: map, table."""
    from dusttaichi.analysis.collisions import summary_columns
    from dusttaichi.analysis.plain import plain_dataset
    from dusttaichi.analysis.thresholds import threshold_columns
    from dusttaichi.studies.collide import collide_and_refine, make_study, write

    options.refuse_both(force, resume)
    scene = options.load_scene(file, threads, settings, extensions)
    runs = scene.output.directory
    study = make_study(scene, output or runs.with_name(f"{runs.name}-collisions"))
    how = {"settings": settings or [], "scheduler": scheduler, "extensions": extensions}
    onward = options.again("collide", file, output, **how)
    with options.writing(force=force, inputs=[file]):
        done = f"finished collisions are in {study.directory}"
        with ProgressBar(quiet) as bar, options.resumable(done, onward):
            how = {"force": force, "resume": resume, "scheduler": scheduler, "jobs": jobs}
            how |= {"report": shown(bar, "collisions"), "log": bar.log}
            study, rows = collide_and_refine(scene, study.directory, **how)
        data, found, written = write(study, rows, figures=figures)
    if as_json:
        say_json(plain_dataset(data))
    else:
        say_abreast(*summary_columns(data), data.attrs["title"])
        say()
        say_abreast(*threshold_columns(found, data.speed.values), THRESHOLDS)
        say()
    open_ends = int((data.settled == 0).sum())
    if open_ends:
        remark(f"{open_ends} collisions ended while fragments still changed: increase stop.time")
    say_written(written, remark if as_json else say)
    failed = [row["error"] for row in rows if "error" in row]
    if failed:
        raise DustError(
            f"{len(failed)} of {len(rows)} collisions failed and are left out of the means, which "
            f"then underrepresent violent ones. The first: {failed[0]}"
        )
