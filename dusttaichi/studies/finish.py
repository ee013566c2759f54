"""End of a study: its dataset, tables and figures, for the commands and for Python."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.results import outputs
from dusttaichi.results.provenance import describe_study
from dusttaichi.running.interrupts import resumable
from dusttaichi.running.progress import show_study
from dusttaichi.studies import engine


@dataclass(frozen=True)
class Results:
    """Results of a finished study.

    Attributes
    ----------
    data
        Its dataset.
    files
        The written files, the dataset first.
    undrawn
        (title, reason) of each figure that could not be drawn.
    failure
        The error about runs that failed, None where all succeeded.
    """

    data: xr.Dataset
    files: list[Path]
    undrawn: list[tuple[str, str]]
    failure: DustError | None


def run_study(study, bar, *, onward, noun="runs", log=None, **engine_options):
    """Run a Study (engine.Study), shown in a bar; returns label -> result of its points.

    onward: how to continue after an interruption. noun: plural noun for its points. log: called
    with lines, by default that of the bar. engine_options: arguments of `engine.run`. Raises
    DustError, Interrupted.
    """
    done = None if study.directory is None else f"finished {noun} are in {study.directory}"
    with resumable(onward, done):
        return engine.run(study, report=show_study(bar, noun), log=log or bar.log, **engine_options)


def build_failure_error(failed, count):
    """The error about failed runs (PointResults), `count` in all, one line for each reason."""
    reasons = {}
    for run in failed:
        reasons.setdefault(run.text, []).append(run.point.label)
    lines = [f"{', '.join(labels)}: {text}" for text, labels in reasons.items()]
    guarded = any(run.code == GuardStop.exit_code for run in failed)
    count = f"{len(failed)} of {count} runs failed:"
    return (GuardStop if guarded else DustError)("\n  ".join([count, *lines]))


def error_of_runs(point_results) -> DustError | None:
    """The error about the failed runs among these, None where all succeeded."""
    failed = [run for run in point_results.values() if not run.ok]
    return build_failure_error(failed, len(point_results)) if failed else None


def error_of_collisions(point_results) -> DustError | None:
    """As `error_of_runs`, of collisions."""
    failed = [collision.text for collision in point_results.values() if not collision.ok]
    if not failed:
        return None
    beginning = f"{len(failed)} of {len(point_results)} collisions failed"
    if len(failed) == len(point_results):
        return DustError(f"{beginning} (--resume tries them again). The first: {failed[0]}")
    return DustError(
        f"{beginning} and are left out of the means, which then underrepresent violent ones "
        f"(--resume tries them again). The first: {failed[0]}"
    )


def finish_sweep(sweep, point_results, figures=True) -> Results:
    """Gather a Sweep, write its dataset and, where wanted, its figures.

    Figures are of all runs; those of a single run are made by `dust plot`. Raises DustError where
    all runs failed.
    """
    failure = _unless_all_failed(error_of_runs(point_results), point_results)
    data = sweep.dataset(point_results)
    save_ensemble(data, sweep.file)
    drawn, undrawn = _draw_sweep(data, sweep) if figures else ([], [])
    return Results(data, [sweep.file, *drawn], undrawn, failure)


def _draw_sweep(data, sweep):
    """(paths of the figures, (title, reason) of those that could not be drawn)."""
    from dusttaichi import plots  # with matplotlib, which the runs do not wait for

    statistics = list(plots.draw_statistics(data))
    drawn = {sweep.file.with_suffix(".png"): plots.ensemble(data)}
    for row, figure, why in statistics:
        if not why:
            drawn[sweep.file.with_name(f"{row.name}.png")] = figure
    undrawn = [(row.title, why) for row, _, why in statistics if why]
    return [plots.save(figure, path) for path, figure in drawn.items()], undrawn


def finish_collisions(study, point_results, figures=True) -> Results:
    """Write the dataset of a study of Collisions, its tables and, where wanted, its figures.

    Raises DustError where all collisions failed.
    """
    from dusttaichi.analysis.collisions import format_collision_table
    from dusttaichi.analysis.threshold_tables import format_threshold_csv
    from dusttaichi.analysis.thresholds import find_thresholds
    from dusttaichi.studies.collide_files import write_collision_files

    failure = _unless_all_failed(error_of_collisions(point_results), point_results)
    data, file = study.dataset(point_results), study.file
    save_ensemble(data, file)
    tables = {file.with_suffix(".csv"): format_collision_table(data)}
    tables[file.with_name("thresholds.csv")] = format_threshold_csv(find_thresholds(data))
    for path, text in tables.items():
        outputs.write(path, text, "")
    paths = []
    if figures:
        from dusttaichi import plots

        for name, figure in plots.collision_figures(data).items():
            paths.append(plots.save(figure, file.with_name(f"{name}.png")))
    paths += write_collision_files(study, point_results)
    return Results(data, [file, *tables, *paths], [], failure)


def unfinished_collisions(data) -> str:
    """Sentence about collisions that ended too early, "" without any."""
    count = int((data.settled == 0).sum())
    if not count:
        return ""
    return f"{count} collisions ended while fragments still changed: increase stop.time"


def finish_study(study, point_results) -> Results:
    """Write the dataset of a study of the user. Raises DustError where all runs failed."""
    failure = _unless_all_failed(error_of_runs(point_results), point_results)
    data = study.dataset(point_results)
    data.attrs = describe_study(study.scene) | data.attrs
    save_ensemble(data, study.file)
    return Results(data, [study.file], [], failure)


def _unless_all_failed(error, point_results):
    """The error of some failed runs; raises it where no run succeeded."""
    if error is not None and not any(run.ok for run in point_results.values()):
        raise error
    return error
