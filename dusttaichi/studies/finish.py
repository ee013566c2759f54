"""End of a study: its dataset, tables and figures, for the commands and for Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.results import outputs
from dusttaichi.results.provenance import describe_study
from dusttaichi.running.interrupts import resumable
from dusttaichi.running.progress import show_study
from dusttaichi.studies import study_engine
from dusttaichi.studies.study_types import PointResult, Study

if TYPE_CHECKING:
    from dusttaichi.running.progress import Bar
    from dusttaichi.studies.collide import Collisions
    from dusttaichi.studies.sweep_study import Sweep
    from dusttaichi.studies.user_study import UserStudy


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


def run_study(
    study: Study,
    bar: Bar,
    *,
    onward: str,
    noun: str = "runs",
    log: Callable[[str], None] | None = None,
    **engine_options: Any,
) -> dict[str, PointResult]:
    """Run a Study (study_types.Study), shown in a bar; returns label -> result of its points.

    onward: how to continue after an interruption. noun: plural noun for its points. log: called
    with lines, by default that of the bar. engine_options: arguments of `study_engine.run`. Raises
    DustError, Interrupted.
    """
    message = None if study.directory is None else f"finished {noun} are in {study.directory}"
    with resumable(onward, message):
        return study_engine.run(
            study, report=show_study(bar, noun), log=log or bar.log, **engine_options
        )


def build_failure_error(failed: Sequence[PointResult], count: int) -> DustError:
    """The error about failed runs (PointResults), `count` in all, one line for each reason."""
    labels_by_reason: dict[str, list[str]] = {}
    for run in failed:
        labels_by_reason.setdefault(run.text, []).append(run.point.label)
    lines = [f"{', '.join(labels)}: {text}" for text, labels in labels_by_reason.items()]
    guarded = any(run.code == GuardStop.exit_code for run in failed)
    heading = f"{len(failed)} of {count} runs failed:"
    return (GuardStop if guarded else DustError)("\n  ".join([heading, *lines]))


def find_run_failure(point_results: Mapping[str, PointResult]) -> DustError | None:
    """The error about the failed runs among these, None where all succeeded."""
    failed = [run for run in point_results.values() if not run.ok]
    return build_failure_error(failed, len(point_results)) if failed else None


def find_collision_failure(point_results: Mapping[str, PointResult]) -> DustError | None:
    """As `error_of_runs`, of collisions."""
    failed = [collision.text for collision in point_results.values() if not collision.ok]
    if not failed:
        return None
    beginning = f"{len(failed)} of {len(point_results)} collisions failed"
    if len(failed) == len(point_results):
        return DustError(f"{beginning} (--resume repeats them). The first: {failed[0]}")
    return DustError(
        f"{beginning}; the means are without these, which are mostly violent ones (--resume "
        f"repeats them). The first: {failed[0]}"
    )


def finish_sweep(
    sweep: Sweep, point_results: Mapping[str, PointResult], figures: bool = True
) -> Results:
    """Gather a Sweep, write its dataset and, on request, its figures.

    Figures are of all runs; those of a single run are made by `dust plot`. Raises DustError where
    all runs failed.
    """
    failure = _raise_if_all_failed(find_run_failure(point_results), point_results)
    data = sweep.dataset(point_results)
    save_ensemble(data, sweep.file)
    drawn, undrawn = _draw_sweep(data, sweep) if figures else ([], [])
    return Results(data, [sweep.file, *drawn], undrawn, failure)


def _draw_sweep(data: xr.Dataset, sweep: Sweep) -> tuple[list[Path], list[tuple[str, str]]]:
    """(paths of the figures, (title, reason) of those that could not be drawn)."""
    from dusttaichi import plots  # with matplotlib, which the runs do not wait for

    statistics = list(plots.draw_statistics(data))
    drawn = {sweep.file.with_suffix(".png"): plots.ensemble(data)}
    for row, figure, reason in statistics:
        if figure is not None and not reason:
            drawn[sweep.file.with_name(f"{row.name}.png")] = figure
    undrawn = [(row.title, reason) for row, _, reason in statistics if reason]
    return [plots.save(figure, path) for path, figure in drawn.items()], undrawn


def finish_collisions(
    study: Collisions, point_results: Mapping[str, PointResult], figures: bool = True
) -> Results:
    """Write the dataset of a study of Collisions, its tables and, on request, its figures.

    Raises DustError where all collisions failed.
    """
    from dusttaichi.analysis.collisions import format_collision_table
    from dusttaichi.analysis.threshold_tables import format_threshold_csv
    from dusttaichi.analysis.thresholds import find_thresholds
    from dusttaichi.studies.collide_files import write_collision_files

    failure = _raise_if_all_failed(find_collision_failure(point_results), point_results)
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


def describe_unfinished_collisions(data: xr.Dataset) -> str:
    """Sentence about collisions that ended too early, "" without any."""
    count = int((data.settled == 0).sum())
    if not count:
        return ""
    return f"{count} collisions ended while fragments still changed: increase stop.time"


def finish_study(study: UserStudy, point_results: Mapping[str, PointResult]) -> Results:
    """Write the dataset of a study of the user. Raises DustError where all runs failed."""
    failure = _raise_if_all_failed(find_run_failure(point_results), point_results)
    data = study.dataset(point_results)
    data.attrs = describe_study(study.scene) | data.attrs
    save_ensemble(data, study.file)
    return Results(data, [study.file], [], failure)


def _raise_if_all_failed(
    error: DustError | None, point_results: Mapping[str, PointResult]
) -> DustError | None:
    """The error of some failed runs; raises it where no run succeeded."""
    if error is not None and not any(run.ok for run in point_results.values()):
        raise error
    return error
