"""`dust extremes`: map of stable, refused and stopped runs."""

import sys
from typing import Annotated

import typer

from dusttaichi.commands.console import remark, say, say_json, say_table, say_written
from dusttaichi.commands.options import Jobs, Json, MapOutput, Quiet, flag, writing
from dusttaichi.commands.progress import ProgressBar
from dusttaichi.errors import Interrupted


def extremes(
    *,
    quick: flag("--quick", "fewer cells, two minutes") = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="one group; may be repeated", metavar="GROUP")
    ] = None,
    jobs: Jobs = None,
    output: MapOutput = None,
    force: flag("--force", "repeat finished cells") = False,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Map where runs are stable, refused or stopped by a guard: steps, materials, speeds, sizes."""
    from dusttaichi.analysis.plain import plain_dataset
    from dusttaichi.studies.extremes.chart import chart

    with writing(force=force), ProgressBar(quiet, "extremes") as bar:
        try:
            how = {"quick": quick, "only": only, "output": output, "force": force, "count": jobs}
            data, paths = chart(report=_shown(bar), log=bar.log, **how)
        except KeyboardInterrupt:
            raise Interrupted(
                "interrupted; finished cells are saved, the same command continues"
            ) from None
    if as_json:
        say_json(plain_dataset(data))
    else:
        _show(data)
    say_written(paths, remark if as_json else say)
    if (data.verdict == "WRONG").any():
        sys.exit(1)


def _shown(bar):
    """Progress bar of the map."""

    def show(group, counts, total):
        state = "  ".join(f"{n} {verdict}" for verdict, n in counts.items() if n)
        bar.show(group, sum(counts.values()), total, state)

    return show


def _show(data):
    from dusttaichi.studies.extremes import results

    headings = [
        {"header": heading, "justify": "right" if n else "left", "no_wrap": True}
        for n, heading in enumerate(results.HEADINGS)
    ]
    say_table(results.summary(data), *headings)
    part = data.where(data.verdict == "WRONG", drop=True)
    for group, name, reason in zip(
        part.group.values, part.name.values, part.reason.values, strict=True
    ):
        say(f"WRONG  {group}: {name}: {reason}")
