"""`dust run` with replicas, and `dust sweep`: dataset, figure, table."""

from dusttaichi.commands.console import (
    remark,
    say,
    say_abreast,
    say_json,
    say_not_drawn,
    say_table,
    say_written,
)
from dusttaichi.commands.progress import Phases


def run_sweep(sweep, run, *, verbose=False):
    """Run a Sweep, gather it, print its table, or its numbers as JSON, and draw its figures.

    run: StudyRun with the options. Figures are of all runs; `dust plot` draws those of a single
    run. Raises DustError for invalid input, Interrupted, and, after all output is written,
    GuardStop or DustError for runs that failed.
    """
    from dusttaichi.analysis.ensemble_tables import list_missing_numbers
    from dusttaichi.analysis.plain import convert_ensemble
    from dusttaichi.studies.finish import find_run_failure, finish_sweep

    phases = Phases(verbose)
    phases.end("imports and scenes")
    point_results = run.run(sweep)
    phases.end(f"{len(point_results)} runs")
    if run.is_partial:
        if failure := find_run_failure(point_results):
            raise failure
        return run.say_part(point_results, len(sweep.members))
    with run.gathering():
        results = finish_sweep(sweep, point_results, run.figures)
    data = results.data
    phases.end("dataset and figures" if run.figures else "dataset")
    say_not_drawn(results.undrawn)
    write_line = remark if run.as_json else say
    if run.as_json:
        say_json(convert_ensemble(data))
    else:
        _say_table(data)
        _say_statistics(data)
    for number_title, label, runs, reason in list_missing_numbers(data):
        write_line(f"no {number_title} for {runs}{f', {label}' if label else ''}: {reason}")
    say_written(results.files, write_line)
    if results.failure:
        raise results.failure


def _say_table(data):
    from dusttaichi.analysis import ensemble_tables as tables
    from dusttaichi.analysis.outcome import format_definition_line

    if not tables.axes_of(data):
        return _say_replicas(data, tables.table_numbers(data))
    keys, columns, remark = tables.head_and_columns(data)
    say_abreast(keys, columns, data.attrs["title"])
    if line := format_definition_line(heading for heading, _ in columns):
        say(line)
    if remark:
        say(remark)


def _say_statistics(data):
    from dusttaichi.analysis.ensemble_tables import statistics_tables

    for row, columns, lines, reason in statistics_tables(data):
        if reason:
            remark(f"no {row.title}: {reason}")
        if columns:
            say()
            say_abreast(columns[:1], columns[1:], row.title)
        for line in lines:
            say(line)


def _say_replicas(data, names):
    from dusttaichi.analysis import ensemble_tables as tables

    say_table(
        (
            (tables.title_of(name), *tables.number_texts(data, name), f"{int(data[name].count())}")
            for name in names
        ),
        {"header": " ", "no_wrap": True},
        {"header": "mean ± standard deviation", "no_wrap": True},
        "runs",
        title=data.attrs["title"],
    )
