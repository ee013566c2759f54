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
from dusttaichi.commands.options import resume_command
from dusttaichi.commands.progress import Phases, progress_bar


def run_study(study, *, quiet, noun="runs", onward=None, log=None, every=None, **engine_options):
    """Run a Study (engine.Study) with a progress bar; returns label -> result of its points.

    onward: command that continues, by default this command with --resume. every: time [s] between
    two lines of progress in a log. noun, log, engine_options: arguments of `finish.run_study`.
    Raises DustError, Interrupted.
    """
    from dusttaichi.studies import finish

    onward = onward or resume_command("--resume")
    bar_options = {} if every is None else {"every": every}
    with progress_bar(quiet, **bar_options) as bar:
        return finish.run_study(study, bar, onward=onward, noun=noun, log=log, **engine_options)


def run_sweep(sweep, *, quiet, verbose=False, figures=True, as_json=False, **engine_options):
    """Run a Sweep, gather it, print its table, or its numbers as JSON, and draw its figures.

    figures: of all runs; `dust plot` draws the figures of a single run. engine_options: arguments
    of `engine.run`. Raises DustError for invalid input, Interrupted, and, after all output is
    written, GuardStop or DustError for runs that failed.
    """
    from dusttaichi.analysis.ensemble_tables import list_missing_numbers
    from dusttaichi.analysis.plain import convert_ensemble
    from dusttaichi.studies.finish import error_of_runs, finish_sweep

    phases = Phases(verbose)
    phases.end("imports and scenes")
    point_results = run_study(sweep, quiet=quiet, **engine_options)
    phases.end(f"{len(point_results)} runs")
    if engine_options.get("part", (1, 1)) != (1, 1):
        if failure := error_of_runs(point_results):
            raise failure
        return say_part(len(point_results), len(sweep.members), "runs")
    results = finish_sweep(sweep, point_results, figures)
    data = results.data
    phases.end("dataset and figures" if figures else "dataset")
    say_not_drawn(results.undrawn)
    write_line = remark if as_json else say
    if as_json:
        say_json(convert_ensemble(data))
    else:
        _say_table(data)
        _say_statistics(data)
    for number_title, label, runs, reason in list_missing_numbers(data):
        write_line(f"no {number_title} for {runs}{f', {label}' if label else ''}: {reason}")
    say_written(results.files, write_line)
    if results.failure:
        raise results.failure


def say_part(finished, total, noun):
    """Print how many points a part of a study has run, and the command that gathers all parts."""
    onward = resume_command("--resume", without="--part")
    say(f"{finished} of {total} {noun}; when all are done: {onward}")


def say_result(data, show, paths, *, as_json):
    """Print a dataset, or plain data, as JSON, or call show() instead; list the written files."""
    from dusttaichi.analysis.plain import convert_dataset, convert_value

    if as_json:
        say_json(convert_dataset(data) if hasattr(data, "data_vars") else convert_value(data))
    else:
        show()
    say_written(paths, remark if as_json else say)


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
