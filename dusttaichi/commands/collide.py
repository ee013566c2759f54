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
    from dusttaichi.analysis.thresholds import thresholds
    from dusttaichi.studies.collide import Collisions

    options.refuse_both(force, resume)
    scene = options.load_scene(file, threads, settings, extensions)
    study = Collisions(scene, options.study_directory(scene, "collisions", output))
    _remark_model(scene)
    with options.writing(force=force, inputs=[file]):
        engine_options = {"force": force, "resume": resume, "scheduler": scheduler, "jobs": jobs}
        engine_options["part"] = options.part_of(part)
        point_results = run_study(study, quiet=quiet, noun="collisions", **engine_options)
        failed = [result.text for result in point_results.values() if not result.ok]
        if engine_options["part"] != (1, 1):
            say_part(len(point_results), len(study.requests()), "collisions")
            return _refuse_failed(failed, len(point_results))
        if len(failed) == len(point_results):
            raise DustError(
                f"{len(failed)} of {len(point_results)} collisions failed "
                f"(--resume tries them again). The first: {failed[0]}"
            )
        data = study.dataset(point_results)
        speeds = thresholds(data)
        written = _write(data, speeds, study.file, figures)
    open_ends = int((data.settled == 0).sum())
    if open_ends:
        remark(f"{open_ends} collisions ended while fragments still changed: increase stop.time")
    say_result(data, lambda: _show(data, speeds), written, as_json=as_json)
    _refuse_failed(failed, len(point_results))


def _remark_model(scene):
    """Print the speeds beyond the contact model, if there are any."""
    from dusttaichi.studies.collide_plan import plan_of

    with suppress(DustError):  # a body that cannot be made: its collisions fail with the reason
        plan = plan_of(scene)
        if plan.beyond:
            remark(f"collisions.speed: {plan.beyond}. Two grains may meet {plan.impact.text()}")


def _refuse_failed(failed, count):
    """Raise the DustError of failed collisions (their messages), if there are any."""
    if failed:
        raise DustError(
            f"{len(failed)} of {count} collisions failed and are left out of the means, which "
            f"then underrepresent violent ones (--resume tries them again). The first: {failed[0]}"
        )


def _show(data, speeds):
    from dusttaichi.analysis.collisions import summary_columns
    from dusttaichi.analysis.outcome import PAGE
    from dusttaichi.analysis.threshold_tables import threshold_columns, without_thresholds

    say_abreast(*summary_columns(data), data.attrs["title"])
    say()
    say_abreast(*threshold_columns(speeds), THRESHOLDS)
    for line in without_thresholds(data):
        say(line)
    say(f"outcomes, growth efficiency and threshold speeds are defined in {PAGE}")
    say()


def _write(data, speeds, file, figures):
    """Write the dataset, its tables and, where wanted, figures; returns their paths."""
    from dusttaichi import plots
    from dusttaichi.analysis.collisions import table_text
    from dusttaichi.analysis.ensemble import save_ensemble
    from dusttaichi.analysis.threshold_tables import threshold_text
    from dusttaichi.results import outputs

    save_ensemble(data, file)
    tables = {file.with_suffix(".csv"): table_text(data)}
    tables[file.with_name("thresholds.csv")] = threshold_text(speeds)
    for path, text in tables.items():
        outputs.write(path, text, "")
    if not figures:
        return [file, *tables]
    drawn = plots.collision_figures(data)
    paths = [plots.save(figure, file.with_name(f"{name}.png")) for name, figure in drawn.items()]
    return [file, *tables, *paths]
