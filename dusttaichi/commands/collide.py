"""`dust collide`: many collisions of a scene, their map and the table for coagulation codes."""

from contextlib import suppress

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say, say_abreast
from dusttaichi.commands.study_command import study_command
from dusttaichi.errors import DustError

THRESHOLDS = "thresholds, with 68 % confidence"


@study_command("collisions")
def collide(
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    batch: options.Batch = "auto",
    run,
):
    """Run many collisions: a map of their outcomes, a table.

    Over speed, impact parameter, mass ratio, bodies and seeds.
    """
    from dusttaichi.studies.collide import Collisions
    from dusttaichi.studies.finish import (
        describe_unfinished_collisions,
        find_collision_failure,
        finish_collisions,
    )

    scene = run.load_scene(file, settings)
    study = Collisions(scene, run.find_folder(scene, "collisions"), batch)
    _remark_model(scene)
    with run.writing(file):
        point_results = run.run(study)
        if run.is_partial:
            run.say_part(point_results, len(study.requests()))
            if failure := find_collision_failure(point_results):
                raise failure
            return
        with run.gathering():
            results = finish_collisions(study, point_results, run.figures)
    if text := describe_unfinished_collisions(results.data):
        remark(text)
    run.say_result(results.data, lambda: _show(results.data), results.files, results.failure)


def _remark_model(scene):
    """Print the speeds beyond the contact model, if there are any."""
    from dusttaichi.studies.collide_plan import plan_of

    with suppress(DustError):  # a body that cannot be made: its collisions fail with the reason
        plan = plan_of(scene)
        if plan.beyond:
            impact = f"Impact speed of two grains: {plan.impact.text()}"
            remark(f"collisions.speed: {plan.beyond}. {impact}")


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
