"""`dust collide`: many collisions of a scene, their map and the table for coagulation codes."""

from contextlib import suppress

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say, say_abreast
from dusttaichi.commands.ensembles import run_study, say_part, say_result
from dusttaichi.errors import DustError

THRESHOLDS = "thresholds, with 68 % confidence"


def collide(
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    force: options.ForceResults = False,
    resume: options.ResumeMissing = False,
    part: options.Part = None,
    output: options.Output = None,
    threads: options.Threads = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    extensions: options.Extensions = None,
    as_json: options.Json = False,
    figures: options.Figures = True,
    quiet: options.Quiet = False,
):
    """Run many collisions: a map of their outcomes, a table.

    Over speed, impact parameter, mass ratio, bodies and seeds.
    """
    from dusttaichi.running import study_directory
    from dusttaichi.studies.collide import Collisions
    from dusttaichi.studies.finish import (
        error_of_collisions,
        finish_collisions,
        unfinished_collisions,
    )

    options.refuse_both(force, resume)
    scene = options.load_scene(file, threads, settings, extensions)
    study = Collisions(scene, study_directory(scene, "collisions", output))
    _remark_model(scene)
    with options.writing(force=force, inputs=[file]):
        engine_options = {"force": force, "resume": resume, "scheduler": scheduler, "jobs": jobs}
        engine_options["part"] = options.part_of(part)
        point_results = run_study(study, quiet=quiet, noun="collisions", **engine_options)
        if engine_options["part"] != (1, 1):
            say_part(len(point_results), len(study.requests()), "collisions")
            if failure := error_of_collisions(point_results):
                raise failure
            return
        results = finish_collisions(study, point_results, figures)
    if text := unfinished_collisions(results.data):
        remark(text)
    say_result(results.data, lambda: _show(results.data), results.files, as_json=as_json)
    if results.failure:
        raise results.failure


def _remark_model(scene):
    """Print the speeds beyond the contact model, if there are any."""
    from dusttaichi.studies.collide_plan import plan_of

    with suppress(DustError):  # a body that cannot be made: its collisions fail with the reason
        plan = plan_of(scene)
        if plan.beyond:
            remark(f"collisions.speed: {plan.beyond}. Two grains may meet {plan.impact.text()}")


def _show(data):
    from dusttaichi.analysis.collisions import format_collision_summary
    from dusttaichi.analysis.outcome import PAGE
    from dusttaichi.analysis.threshold_tables import (
        explain_missing_thresholds,
        format_threshold_columns,
    )
    from dusttaichi.analysis.thresholds import find_thresholds

    say_abreast(*format_collision_summary(data), data.attrs["title"])
    say()
    say_abreast(*format_threshold_columns(find_thresholds(data)), THRESHOLDS)
    for line in explain_missing_thresholds(data):
        say(line)
    say(f"outcomes, growth efficiency and threshold speeds are defined in {PAGE}")
    say()
