"""`dust extremes`: tries all cells, keeps what is finished, writes the map."""

import json
import os
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from rich.table import Table

from dusttaichi import __version__
from dusttaichi.commands.progress import progress_bar
from dusttaichi.errors import DustError
from dusttaichi.studies.extremes import pool, results
from dusttaichi.studies.extremes.cell import Outcome
from dusttaichi.studies.extremes.groups import GROUPS

KEPT = "cells.jsonl"


def command(
    *, quick=False, only=None, output=None, force=False, children=None, quiet=False, console, err
):
    """Try the cells of the map; returns True where none of them is WRONG.

    quick: fewer cells and steps. only: names of groups, all by default. output: directory,
    runs/extremes by default. force: try again what is finished. children: processes side by side,
    as many as there are cores by default.
    Raises DustError for a group that there is not or a directory that cannot be written, and
    KeyboardInterrupt; finished cells are kept, and the next call goes on with the rest.
    """
    from dusttaichi import plots

    cells = _cells(quick, only)
    folder = Path(output or "runs/extremes")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if force:
            (folder / KEPT).unlink(missing_ok=True)
        found = _tried(cells, folder / KEPT, children or _cores(), quiet, err)
        data, paths = results.save(found, folder)
        paths.append(folder / "extremes.png")
        plots.extremes(data).savefig(paths[-1])
    except OSError as error:
        raise DustError(f"The map cannot be written to {folder}: {error}.") from error
    _print(data, console)
    for path in paths:
        console.print(f"wrote {path}")
    return not (data.verdict == "WRONG").any()


def _cores():
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def _cells(quick, only):
    for name in only or ():
        if name not in GROUPS:
            raise DustError(
                f'--only "{name}": there is no such group; allowed: {", ".join(GROUPS)}'
            )
    return [
        cell for name, make in GROUPS.items() if not only or name in only for cell in make(quick)
    ]


def _tried(cells, kept, children, quiet, err):
    """(Cell, Outcome) of all cells in their order; those of the file `kept` are taken from it."""
    known = _known(kept)
    rest = [cell for cell in cells if _mark(cell) not in known]
    if len(rest) < len(cells):
        err.print(
            f"{len(cells) - len(rest)} of {len(cells)} cells are finished and kept in {kept} "
            "(--force tries them again)"
        )
    runs = [
        list(run) for _, run in groupby(rest, lambda c: (c.group, c.alike or c.coordinates["row"]))
    ]
    # the longest first, so that no process is left alone with it
    runs.sort(key=lambda run: -max(c.steps for c in run))
    with progress_bar(err, quiet) as bar, open(kept, "a", encoding="utf-8") as file:
        task = bar.add_task("extremes", total=len(rest), state="")
        counts = dict.fromkeys(("stable", "refused", "stopped", "WRONG"), 0)
        for cell, outcome in pool.attempts(runs, children):
            known[_mark(cell)] = outcome
            file.write(json.dumps([_mark(cell), asdict(outcome)]) + "\n")
            file.flush()
            counts[outcome.verdict] += 1
            state = "  ".join(f"{n} {verdict}" for verdict, n in counts.items() if n)
            bar.update(task, advance=1, description=cell.group, state=state)
    return [(cell, known[_mark(cell)]) for cell in cells]


def _mark(cell):
    """What tells a cell from others, and from the same cell of another version."""
    return json.dumps([__version__, cell.to_dict()], sort_keys=True)


def _known(kept):
    """Outcomes by mark of an earlier call; a line cut short by a kill is left out."""
    known = {}
    if kept.exists():
        for line in kept.read_text(encoding="utf-8").splitlines():
            try:
                mark, outcome = json.loads(line)
                known[mark] = Outcome(**outcome)
            except (ValueError, TypeError):
                continue
    return known


def _print(data, console):
    table = Table(box=None, pad_edge=False)
    for n, heading in enumerate(results.HEADINGS):
        table.add_column(heading, justify="right" if n else "left", no_wrap=True)
    for row in results.summary(data):
        table.add_row(*row)
    console.print(table, soft_wrap=True)
    part = data.where(data.verdict == "WRONG", drop=True)
    for group, name, reason in zip(
        part.group.values, part.name.values, part.reason.values, strict=True
    ):
        console.print(f"WRONG  {group}: {name}: {reason}", markup=False, soft_wrap=True)
