"""What `dust run` does with replicas, and `dust sweep`: runs, dataset, figure, table."""

from rich.table import Table

from dusttaichi.analysis import ensemble_tables as analysis
from dusttaichi.analysis.ensemble import save_ensemble as save_dataset
from dusttaichi.commands.progress import progress_bar
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.plots.ensemble import save_ensemble
from dusttaichi.studies.ensemble.gathering import gather_plan
from dusttaichi.studies.ensemble.runs import run_all

SHOWN = 4  # running runs that the progress bar tells of


def command(plan, again, *, force, resume, scheduler, quiet, console, err, error_bar=False):
    """Run a Plan, gather it, draw it, print its table.

    again: the command that goes on after an interruption. Raises DustError: input that cannot be
    used, an interruption; after everything else is done, GuardStop or DustError for runs that
    failed.
    """
    with _bar(err, quiet) as (watch, say):
        try:
            outcomes = run_all(
                plan,
                force=force,
                resume=resume,
                error_bar=error_bar,
                scheduler=scheduler,
                watch=watch,
                say=say,
            )
        except KeyboardInterrupt:
            raise DustError(
                f"interrupted; everything up to here is in {plan.directory}. Go on with: {again}"
            ) from None
    failed = [outcome for outcome in outcomes if outcome.code != 0]
    if len(failed) == len(outcomes):
        raise failure(plan, failed)
    data = gather_plan(plan, outcomes)
    save_dataset(data, plan.file)
    figure = plan.file.with_suffix(".png")
    save_ensemble(data, figure)
    console.print(_table(data), soft_wrap=True)
    for path in (plan.file, figure):
        console.print(f"wrote {path}")
    if failed:
        raise failure(plan, failed)


def failure(plan, failed):
    """The error that tells of runs that failed, one line a reason."""
    reasons = {}
    for outcome in failed:
        reasons.setdefault(outcome.text, []).append(plan.members[outcome.number].label)
    lines = [f"{', '.join(labels)}: {text}" for text, labels in reasons.items()]
    guarded = any(outcome.code == GuardStop.exit_code for outcome in failed)
    count = f"{len(failed)} of {len(plan.members)} runs failed:"
    return (GuardStop if guarded else DustError)("\n  ".join([count, *lines]))


def _table(data):
    axes, names = analysis.axes_of(data), analysis.table_numbers(data)
    table = Table(title=data.attrs["title"], title_justify="left", box=None, pad_edge=False)
    if not axes:
        table.add_column(" ", no_wrap=True)
        table.add_column("mean ± standard deviation", no_wrap=True)
        table.add_column("runs", justify="right")
        for name in names:
            count = int(data[name].notnull().sum())
            table.add_row(name.replace("_", " "), *analysis.number_texts(data, name), str(count))
        return table
    for heading in [axis.split(".")[-1] for axis in axes]:
        table.add_column(heading, no_wrap=True)
    for name in names:
        table.add_column(name.replace("_", " "), justify="right")
    columns = [analysis.number_texts(data, name) for name in names]
    for point, label in enumerate(analysis.point_values(data)):
        table.add_row(*label, *(column[point] for column in columns))
    return table


class _bar:
    """Progress of all runs together."""

    def __init__(self, console, quiet):
        self.console = console
        self.bar = progress_bar(console, quiet)

    def __enter__(self):
        self.bar.start()
        self.task = self.bar.add_task("", total=None, state="", visible=False)
        return self.watch, self.console.print

    def __exit__(self, *_):
        self.bar.stop()

    def watch(self, p):
        shown = [f"{label} {share:.0%}" for label, share in list(p.running.items())[:SHOWN]]
        self.bar.update(
            self.task,
            description=f"{p.done} of {p.total} runs",
            total=p.total,
            completed=p.done + sum(p.running.values()),
            state="  ".join(shown),
            visible=True,
        )
