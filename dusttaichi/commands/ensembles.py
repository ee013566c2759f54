"""`dust run` with replicas, and `dust sweep`: dataset, figure, table."""

from contextlib import nullcontext

from dusttaichi.commands.console import (
    remark,
    say,
    say_abreast,
    say_json,
    say_not_drawn,
    say_table,
    say_written,
)
from dusttaichi.commands.options import resumable, resume_command
from dusttaichi.commands.progress import Phases, progress_bar
from dusttaichi.errors import DustError, GuardStop


def run_study(study, *, quiet, noun="runs", onward=None, log=None, every=None, **engine_options):
    """Run a Study (engine.Study) with a progress bar; returns label -> result of its points.

    noun: plural noun for its points, for the user. onward: command that continues, by default this
    command with --resume. log: called with lines, by default printed above the bar. every: time [s]
    between two lines of progress in a log. engine_options: arguments of `engine.run`. Raises
    DustError, Interrupted.
    """
    from dusttaichi.running.progress import show_study
    from dusttaichi.studies import engine

    interruption = nullcontext()
    if study.directory is not None:
        interruption = resumable(
            f"finished {noun} are in {study.directory}", onward or resume_command("--resume")
        )
    bar_options = {} if every is None else {"every": every}
    with progress_bar(quiet, **bar_options) as bar, interruption:
        return engine.run(study, report=show_study(bar, noun), log=log or bar.log, **engine_options)


def run_sweep(sweep, *, quiet, verbose=False, figures=True, as_json=False, **engine_options):
    """Run a Sweep, gather it, print its table, or its numbers as JSON, and draw its figure.

    figures: a figure of all runs; `dust plot` draws the figures of a single run. engine_options:
    arguments of `engine.run`. Raises DustError for invalid input, Interrupted, and, after all
    output is written, GuardStop or DustError for runs that failed.
    """
    from dusttaichi.analysis.ensemble import save_ensemble
    from dusttaichi.analysis.ensemble_tables import missing
    from dusttaichi.analysis.plain import plain_ensemble

    phases = Phases(verbose)
    phases.end("imports and scenes")
    point_results = run_study(sweep, quiet=quiet, **engine_options)
    failed = [result for result in point_results.values() if not result.ok]
    is_part = engine_options.get("part", (1, 1)) != (1, 1)
    if failed and (is_part or len(failed) == len(point_results)):
        raise build_failure_error(failed, len(sweep.members))
    phases.end(f"{len(point_results)} runs")
    if is_part:
        return say_part(len(point_results), len(sweep.members), "runs")
    data = sweep.dataset(point_results)
    save_ensemble(data, sweep.file)
    phases.end("gathered")
    written = [sweep.file, *(_draw(data, sweep) if figures else [])]
    write_line = remark if as_json else say
    if as_json:
        say_json(plain_ensemble(data))
    else:
        _say_table(data)
        _say_statistics(data)
    for number_title, label, runs, reason in missing(data):
        write_line(f"no {number_title} for {runs}{f', {label}' if label else ''}: {reason}")
    say_written(written, write_line)
    if failed:
        raise build_failure_error(failed, len(sweep.members))


def say_part(finished, total, noun):
    """Print how many points a part of a study has run, and the command that gathers all parts."""
    onward = resume_command("--resume", without="--part")
    say(f"{finished} of {total} {noun}; when all are done: {onward}")


def _draw(data, sweep):
    from dusttaichi.plots import draw_statistics, ensemble, save

    statistics_figures = list(draw_statistics(data))
    figures = {sweep.file.with_suffix(".png"): ensemble(data)}
    figures |= {
        sweep.file.with_name(f"{row.name}.png"): drawing
        for row, drawing, reason in statistics_figures
        if not reason
    }
    say_not_drawn([(row.title, reason) for row, _, reason in statistics_figures if reason])
    return [save(drawing, path) for path, drawing in figures.items()]


def say_result(data, show, paths, *, as_json):
    """Print a dataset, or plain data, as JSON, or call show() instead; list the written files."""
    from dusttaichi.analysis.plain import plain, plain_dataset

    if as_json:
        say_json(plain_dataset(data) if hasattr(data, "data_vars") else plain(data))
    else:
        show()
    say_written(paths, remark if as_json else say)


def build_failure_error(failed, count):
    """The error about failed runs (results of their points), with a line for each reason.

    count: number of all runs of the study.
    """
    reasons = {}
    for result in failed:
        reasons.setdefault(result.text, []).append(result.point.label)
    lines = [f"{', '.join(labels)}: {text}" for text, labels in reasons.items()]
    has_guard_stop = any(result.code == GuardStop.exit_code for result in failed)
    count = f"{len(failed)} of {count} runs failed:"
    return (GuardStop if has_guard_stop else DustError)("\n  ".join([count, *lines]))


def _say_table(data):
    from dusttaichi.analysis import ensemble_tables as tables
    from dusttaichi.analysis.outcome import definition_line

    if not tables.axes_of(data):
        return _say_replicas(data, tables.table_numbers(data))
    keys, columns, remark = tables.head_and_columns(data)
    say_abreast(keys, columns, data.attrs["title"])
    if line := definition_line(heading for heading, _ in columns):
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
