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
from dusttaichi.commands.options import again, resumable
from dusttaichi.commands.progress import Phases, progress_bar
from dusttaichi.errors import DustError, GuardStop


def found_of(study, *, quiet, things="runs", onward=None, log=None, every=None, **how):
    """Run a Study (engine.Study) with a progress bar; returns label -> Found of its points.

    things: what its points are called. onward: command that continues, by default this one with
    --resume. log: called with lines, by default printed above the bar. every: time [s] between two
    lines of progress in a log. how: arguments of `engine.run`. Raises DustError, Interrupted.
    """
    from dusttaichi.running.progress import show_study
    from dusttaichi.studies import engine

    done = nullcontext()
    if study.directory is not None:
        done = resumable(f"finished {things} are in {study.directory}", onward or again("--resume"))
    shown = {} if every is None else {"every": every}
    with progress_bar(quiet, **shown) as bar, done:
        return engine.run(study, report=show_study(bar, things), log=log or bar.log, **how)


def run_sweep(sweep, *, quiet, verbose=False, figures=True, as_json=False, **how):
    """Run a Sweep, gather it, print its table, or its numbers as JSON, and draw its figure.

    figures: one figure of all runs; those of a single run are made by `dust plot`. how: arguments
    of `engine.run`. Raises DustError for invalid input, Interrupted, and, after everything else is
    done, GuardStop or DustError for runs that failed.
    """
    from dusttaichi.analysis.ensemble import save_ensemble
    from dusttaichi.analysis.ensemble_tables import missing
    from dusttaichi.analysis.plain import plain_ensemble

    phases = Phases(verbose)
    phases.end("imports and scenes")
    found = found_of(sweep, quiet=quiet, **how)
    failed = [one for one in found.values() if not one.ok]
    part = how.get("part", (1, 1)) != (1, 1)
    if failed and (part or len(failed) == len(found)):
        raise failure(failed, len(sweep.members))
    phases.end(f"{len(found)} runs")
    if part:
        return say_part(len(found), len(sweep.members), "runs")
    data = sweep.dataset(found)
    save_ensemble(data, sweep.file)
    phases.end("gathered")
    written = [sweep.file, *(_draw(data, sweep) if figures else [])]
    write = remark if as_json else say
    if as_json:
        say_json(plain_ensemble(data))
    else:
        _say_table(data)
        _say_statistics(data)
    for what, label, runs, why in missing(data):
        write(f"no {what} for {runs}{f', {label}' if label else ''}: {why}")
    say_written(written, write)
    if failed:
        raise failure(failed, len(sweep.members))


def say_part(done, total, things):
    """Print how much of a study its part is, and the command that gathers all parts."""
    onward = again("--resume", without="--part")
    say(f"{done} of {total} {things}; when all are done: {onward}")


def _draw(data, sweep):
    from dusttaichi.plots import draw_statistics, ensemble, save

    found = list(draw_statistics(data))
    drawn = {sweep.file.with_suffix(".png"): ensemble(data)}
    drawn |= {sweep.file.with_name(f"{row.name}.png"): one for row, one, why in found if not why}
    say_not_drawn([(row.title, why) for row, _, why in found if why])
    return [save(figure, path) for path, figure in drawn.items()]


def tell(data, show, paths, *, as_json):
    """Print a dataset, or plain data, as JSON, or call show() instead; list the written files."""
    from dusttaichi.analysis.plain import plain, plain_dataset

    if as_json:
        say_json(plain_dataset(data) if hasattr(data, "data_vars") else plain(data))
    else:
        show()
    say_written(paths, remark if as_json else say)


def failure(failed, count):
    """The error about failed runs (engine.Found), `count` in all, one line for each reason."""
    reasons = {}
    for one in failed:
        reasons.setdefault(one.text, []).append(one.point.label)
    lines = [f"{', '.join(labels)}: {text}" for text, labels in reasons.items()]
    guarded = any(one.code == GuardStop.exit_code for one in failed)
    count = f"{len(failed)} of {count} runs failed:"
    return (GuardStop if guarded else DustError)("\n  ".join([count, *lines]))


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

    for row, columns, lines, why in statistics_tables(data):
        if why:
            remark(f"no {row.title}: {why}")
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
